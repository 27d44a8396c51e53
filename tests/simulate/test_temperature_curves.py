"""Curves of every family leave what the table says; their second moments are those of the drawn curves."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import gamma, kv

from planner.nouns.array import Array
from planner.simulate.curves.cubic import Cubic
from planner.simulate.curves.grid import POINTS, Shape, along, centred, even_table, places
from planner.simulate.curves.kink import Kink
from planner.simulate.curves.matern import Matern
from planner.simulate.temperature_curves import LARGEST, Figure, TableCurves, curve_family, second_moment
from planner.spec.temperature_residual import CURVE_NAMES, CurveName

PUBLISHED = {1: 0.032, 3: 0.0085, 5: 0.0035, 7: 0.0029, 10: 0.0026, 20: 0.0021}  # K table 2.10
SCALED: tuple[CurveName, ...] = ("kink", "cubic", "matern")  # by one number, where the figure is a sigma

tables = st.dictionaries(st.integers(1, 20), st.floats(1e-3, 1.0), min_size=1, max_size=6).map(
    lambda t: dict(zip(sorted(t), sorted(t.values(), reverse=True), strict=True))
)
shapes = st.sampled_from(CURVE_NAMES)


def rms_left(curves: Array, table: Mapping[int, float]) -> dict[int, float]:
    """Root mean square over temperature and units of what N points leave, relative to the table."""
    return {n: float(np.sqrt(np.mean((curves - even_table(curves, n)) ** 2))) / table[n] for n in table}


def units(family: TableCurves, count: int = 3000, seed: int = 8) -> Array:
    return family.draws(count, np.random.default_rng(seed))


# ---------------------------------------------------------------- every family


@given(table=tables, shape=shapes, seed=st.integers(0, 1000))
@settings(deadline=None, max_examples=60)
def test_a_curve_keeps_to_its_table_and_meets_it_once(
    table: dict[int, float], shape: CurveName, seed: int
) -> None:
    """But for those that would be larger than any unit's curve."""
    family = curve_family(table, -60.0, 60.0, shape=shape)
    curves = units(family, 20, seed)
    x = np.linspace(0.0, 1.0, POINTS)
    middle = np.median(np.sqrt(np.mean(units(family) ** 2, axis=1)))
    for curve in curves:
        shares = [np.abs(curve - lines(curve, x, n)).max() / left for n, left in table.items()]
        if np.sqrt(np.mean(curve**2)) < 0.9 * LARGEST * middle:
            assert max(shares) == pytest.approx(1.0, rel=1e-9)
        assert max(shares) <= 1.0 + 1e-9
        assert np.sqrt(np.mean(curve**2)) <= 1.1 * LARGEST * middle


def lines(curve: Array, x: Array, points: int) -> Array:
    """Straight lines between even nodes, by NumPy alone."""
    nodes = np.linspace(0.0, 1.0, points) if points > 1 else np.array([0.5])
    return np.interp(x, nodes, np.interp(nodes, x, curve))


@given(table=tables, shape=shapes, figure=st.sampled_from(["largest", "sigma"]), power=st.integers(-20, 20))
@settings(deadline=None, max_examples=40)
def test_the_mean_is_taken_off_and_the_unit_of_the_table_is_that_of_the_curves(
    table: dict[int, float], shape: CurveName, figure: Figure, power: int
) -> None:
    family = curve_family(table, -40.0, 70.0, figure, shape)
    curves = units(family, 5)
    np.testing.assert_allclose(curves.mean(axis=1), 0.0, atol=1e-12 * np.abs(curves).max())
    size = 2.0**power  # exact: where modes serve a table equally well, rounding chooses among them
    larger = curve_family({n: size * left for n, left in table.items()}, -40.0, 70.0, figure, shape)
    np.testing.assert_allclose(units(larger, 5), size * curves, atol=1e-7 * size * np.abs(curves).max())
    assert (family.grid[0], family.grid[-1], len(family.grid)) == (-40.0, 70.0, POINTS)


@pytest.mark.parametrize("shape", CURVE_NAMES)
def test_one_curve_is_the_first_of_many(shape: CurveName) -> None:
    family = curve_family(PUBLISHED, -60.0, 60.0, shape=shape)
    one = family.draw(np.random.default_rng(3))
    np.testing.assert_array_equal(one, units(family, 1, 3)[0])
    assert one.shape == (POINTS,)


def test_cosines_drawn_together_are_those_drawn_one_after_the_other() -> None:
    family, rng = curve_family(PUBLISHED, -60.0, 60.0), np.random.default_rng(5)
    several = np.array([family.draw(rng) for _ in range(4)])
    np.testing.assert_allclose(units(family, 4, 5), several, atol=1e-14)


@pytest.mark.parametrize("shape", CURVE_NAMES)
@pytest.mark.parametrize("figure", ["largest", "sigma"])
def test_a_table_of_zeros_leaves_no_curve(shape: CurveName, figure: Figure) -> None:
    assert not units(curve_family({1: 0.0, 3: 0.0}, -60.0, 60.0, figure, shape), 3).any()


@pytest.mark.parametrize("shape", CURVE_NAMES)
@pytest.mark.parametrize("figure", ["largest", "sigma"])
def test_second_moments_are_those_of_drawn_curves(shape: CurveName, figure: Figure) -> None:
    """4000 curves know a mean square to 3 % of the largest (one sigma, kurtosis up to 5)."""
    family = curve_family(PUBLISHED, -40.0, 60.0, figure, shape)
    at = np.array([-43.0, -40.0, -3.1, 20.0, 20.0, 55.0, 61.0])
    found = second_moment(family, at, 4000, np.random.default_rng(0))
    drawn = np.array([along(at, family.grid, c) for c in units(family, 4000)])
    np.testing.assert_allclose(found, drawn.T @ drawn / 4000, atol=0.12 * np.diag(found).max())
    assert (np.abs(drawn.mean(axis=0)) < 5.0 * np.sqrt(np.diag(found) / 4000)).all()


# ---------------------------------------------------------------- the largest residual, and sigma


def test_a_largest_residual_has_a_root_mean_square_of_a_third_of_it() -> None:
    """0.36 of the figure at every N of a long table; more where fewer entries bind."""
    for n, share in rms_left(units(curve_family(PUBLISHED, -60.0, 60.0)), PUBLISHED).items():
        assert share == pytest.approx(0.36, abs=0.02), n
    assert min(rms_left(units(curve_family({5: 0.01}, -60.0, 60.0)), {5: 0.01}).values()) > 0.5


def test_a_cosines_curve_is_smooth_and_no_noise() -> None:
    for curve in units(curve_family(PUBLISHED, -60.0, 60.0), 5):
        assert np.abs(curve - even_table(curve, 1)).max() > 3.0 * np.abs(curve - even_table(curve, 5)).max()


def test_cosines_meet_a_sigma_over_temperature_and_units() -> None:
    """K's table to 6 %, one number of points exactly; the mean of 3000 squares is known to 2 %."""
    for n, share in rms_left(units(curve_family(PUBLISHED, -60.0, 60.0, "sigma")), PUBLISHED).items():
        assert share == pytest.approx(1.0, abs=0.08), n
    (share,) = rms_left(units(curve_family({5: 0.01}, -60.0, 60.0, "sigma")), {5: 0.01}).values()
    assert share == pytest.approx(1.0, abs=0.04)


@given(table=tables, shape=st.sampled_from(SCALED))
@settings(deadline=None, max_examples=40)
def test_the_others_meet_a_sigma_at_one_number_of_points_and_exceed_it_at_none(
    table: dict[int, float], shape: CurveName
) -> None:
    """The root of the mean over temperature of what straight lines leave of the second moment."""
    family = curve_family(table, 0.0, 1.0, "sigma", shape)
    moment = second_moment(family, family.grid, 1, np.random.default_rng(0))
    x = places()
    shares = []
    for n, left in table.items():
        operator = np.array([one - lines(one, x, n) for one in np.eye(POINTS)]).T
        shares.append(np.sqrt(np.trace(operator @ moment @ operator.T) / POINTS) / left)
    assert max(shares) == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize("shape", SCALED)
def test_drawn_curves_have_the_sigma(shape: CurveName) -> None:
    shares = rms_left(units(curve_family(PUBLISHED, -60.0, 60.0, "sigma", shape), 6000), PUBLISHED)
    assert max(shares.values()) == pytest.approx(1.0, abs=0.04)


# ---------------------------------------------------------------- the shapes themselves


@pytest.mark.parametrize("shape", [Kink(), Cubic(), Matern()])
def test_the_rows_of_a_shape_are_its_second_moment(shape: Shape) -> None:
    some = slice(None, None, 60)
    curves = shape.draws(40_000, np.random.default_rng(2))[:, some]
    rows = shape.rows()[:, some]
    np.testing.assert_allclose(rows.T @ rows, curves.T @ curves / len(curves), atol=0.05)


def test_matern_is_that_of_the_bessel_function() -> None:
    """σ² 2^(1−ν)/Γ(ν) (√(2ν) d/l)^ν K_ν(√(2ν) d/l), ν = 3/2, l = 1/2 (Rasmussen and Williams, 4.14)."""
    rows, x, nu = Matern().rows(), places(), 1.5
    for i, j in ((0, 1), (0, 100), (37, 300), (0, POINTS - 1)):
        r = np.sqrt(2.0 * nu) * abs(x[i] - x[j]) / 0.5
        assert rows[:, i] @ rows[:, j] == pytest.approx(
            2.0 ** (1.0 - nu) / gamma(nu) * r**nu * kv(nu, r), rel=1e-9
        )
        assert rows[:, i] @ rows[:, i] == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(("i", "j"), [(0, 0), (0, 480), (100, 333), (240, 241)])
def test_kinks_are_spread_evenly(i: int, j: int) -> None:
    rows, x = Kink().rows(), places()
    kinks, _ = quad(lambda k: abs(x[i] - k) * abs(x[j] - k), 0.0, 1.0, points=[x[i], x[j]], epsabs=1e-13)
    assert rows[:, i] @ rows[:, j] == pytest.approx((x[i] - 0.5) ** 2 * (x[j] - 0.5) ** 2 + kinks, rel=1e-11)


def test_a_cubic_has_no_fourth_difference() -> None:
    curves = Cubic().draws(5, np.random.default_rng(1))
    np.testing.assert_allclose(np.diff(curves[:, ::48], 4), 0.0, atol=1e-12)
    assert np.abs(np.diff(curves[:, ::48], 3)).min() > 1e-4


# ---------------------------------------------------------------- the grid


@given(
    grid=st.lists(st.floats(-100.0, 100.0), min_size=2, max_size=6, unique_by=lambda v: round(v, 2)),
    at=st.lists(st.floats(-150.0, 150.0), min_size=1, max_size=8),
    slope=st.floats(-3.0, 3.0),
)
def test_between_points_a_curve_is_straight_and_goes_on_beyond_the_last(
    grid: list[float], at: list[float], slope: float
) -> None:
    x, t = np.sort(grid), np.array(at)
    line = 2.0 + slope * x
    np.testing.assert_allclose(along(t, x, line), 2.0 + slope * t, atol=1e-6)
    bent = np.sin(x)
    inside = (t >= x[0]) & (t <= x[-1])
    np.testing.assert_allclose(along(t, x, bent)[inside], np.interp(t[inside], x, bent), atol=1e-12)
    both = along(t, x, np.array([line, bent]))
    np.testing.assert_array_equal(both, [along(t, x, line), along(t, x, bent)])


@pytest.mark.parametrize("points", [1, 2, 3, 7, 20])
def test_an_even_table_is_numpys(points: int) -> None:
    curves = centred(np.random.default_rng(4).normal(size=(3, POINTS)))
    x = places()
    np.testing.assert_allclose(
        even_table(curves, points), [lines(one, x, points) for one in curves], atol=1e-12
    )
