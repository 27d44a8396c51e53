"""Which curves every error of a spec has, by the name of a family; curves that were measured."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from planner.cli import app
from planner.errors import InputError
from planner.simulate.campaign import prepared, simulate
from planner.simulate.curves.cosines import Cosines
from planner.simulate.curves.cubic import Cubic
from planner.simulate.curves.grid import Shape, along, largest_left, places
from planner.simulate.curves.kink import Kink
from planner.simulate.curves.matern import Matern
from planner.simulate.curves.measured import OneUnit, SeveralUnits, one_unit, several_units, table_of
from planner.simulate.families import curve_families, family_named
from planner.simulate.temperature_curves import CurveFamily, TableCurves, second_moment
from planner.spec.budget import ErrorBudget
from planner.spec.curve_names import FAMILY_NAMES, FamilyName, families_of
from planner.spec.model import Spec
from planner.spec.temperature_residual import CURVE_NAMES, CurveName, MeasuredCurve
from tests.simulate.benches import campaign_of, noiseless, shipped
from tests.specs import SHIPPED

SHAPES: dict[CurveName, type[Shape]] = {"cosines": Cosines, "kink": Kink, "cubic": Cubic, "matern": Matern}
TABLE = {1: "3 mg", 3: "1 mg"}
ONE = {"-60 degC": "5 mg", "-10 degC": "1 mg", "20 degC": "0 mg", "60 degC": "-3 mg"}
OTHER = {"-50 degC": "2 mg", "0 degC": "4 mg", "70 degC": "-1 mg"}
milligs = st.floats(-9.0, 9.0).map(lambda v: round(v, 3))
THIRD = {"-60 degC": "0 mg", "60 degC": "-5 mg"}


def measured(values: dict[float, float]) -> MeasuredCurve:
    return MeasuredCurve.model_validate({"curve": {f"{t} degC": f"{v} mg" for t, v in values.items()}})


def varied(*residuals: Any) -> Spec:
    """The small UAV's spec with these temperature residuals on as many errors, and no others."""
    spec = shipped("small_uav.yaml")
    budgets = [ErrorBudget.model_validate({"temperature_residual": one}) for one in residuals]
    names = ["bias", "scale_factor", "misalignment", "g_sensitivity"]
    unit = spec.unit.model_copy(update={"gyro": {}, "accelerometer": dict(zip(names, budgets, strict=False))})
    return spec.model_copy(update={"unit": unit})


# ---------------------------------------------------------------- which families count


@pytest.mark.parametrize(
    ("residuals", "names"),
    [
        ([], ("cosines",)),
        ([TABLE], CURVE_NAMES),
        ([TABLE | {"curve": "kink"}], ("kink",)),
        ([TABLE | {"curve": "kink"}, TABLE | {"curve": "kink"}], ("kink",)),
        ([TABLE | {"curve": "matern"}, TABLE | {"curve": "kink"}], ("kink", "matern")),
        ([TABLE | {"curve": "kink"}, TABLE], CURVE_NAMES),
        ([{"curve": ONE}], FAMILY_NAMES),
        ([{"curve": ONE}, TABLE | {"curve": "kink"}], FAMILY_NAMES),
        ([{"curve": [ONE, OTHER, THIRD]}], ("measured",)),
        ([{"curve": [ONE, OTHER, THIRD]}, TABLE | {"curve": "cubic"}], ("cubic", "measured")),
        ([{"curve": [ONE, OTHER, THIRD]}, TABLE], CURVE_NAMES),
    ],
)
def test_what_is_named_counts_where_all_name_one(residuals: list[Any], names: tuple[FamilyName, ...]) -> None:
    assert families_of(varied(*residuals)) == names


@pytest.mark.parametrize("name", FAMILY_NAMES)
def test_an_error_has_the_curves_of_the_family_or_of_the_one_it_names(name: FamilyName) -> None:
    spec = varied(TABLE, TABLE | {"curve": "matern"}, {"curve": ONE}, {"curve": [ONE, OTHER, THIRD]})
    table, own, one, several = curve_families(spec, name).values()
    assert shape_of(own) is Matern
    assert isinstance(several, SeveralUnits)
    if name == "measured":
        assert isinstance(one, OneUnit)
        assert shape_of(table) is Cosines
    else:
        assert shape_of(one) is shape_of(table) is SHAPES[name]


def shape_of(family: CurveFamily) -> type[Shape]:
    assert isinstance(family, TableCurves)
    return type(family.shape)


def test_where_names_differ_every_family_is_the_same() -> None:
    spec = varied(TABLE | {"curve": "matern"}, TABLE | {"curve": "kink"}, {"curve": [ONE, OTHER, THIRD]})
    first, *others = (
        [family.draw(np.random.default_rng(1)) for family in curve_families(spec, name).values()]
        for name in FAMILY_NAMES
    )
    for one in others:
        for a, b in zip(first, one, strict=True):
            np.testing.assert_array_equal(a, b)


def test_a_word_that_is_no_family() -> None:
    with pytest.raises(InputError, match=r"--curves 'kinck'.*'kink'"):
        family_named("kinck")
    assert [family_named(name) for name in FAMILY_NAMES] == [*FAMILY_NAMES]


# ---------------------------------------------------------------- the curve of one unit


@given(st.dictionaries(st.integers(-60, 60), milligs, min_size=2, max_size=14))
@settings(deadline=None, max_examples=60)
def test_every_family_leaves_what_the_measured_curve_leaves(values: dict[int, float]) -> None:
    curve = measured({float(t): v for t, v in values.items()})
    table = table_of(curve, -60.0, 60.0)
    x = -60.0 + 120.0 * places()
    whole = along(x, curve.temperatures_degc, curve.values)
    assert set(table) <= set(range(1, min(10, len(values) - 1) + 1))
    for n, left in table.items():
        nodes = np.linspace(-60.0, 60.0, n) if n > 1 else np.zeros(1)
        straight = np.interp(x, nodes, along(nodes, curve.temperatures_degc, curve.values))
        # the grid lies up to an eighth of a kelvin beside the nodes
        near = 0.13 * np.abs(np.gradient(whole, x)).max()
        assert left == pytest.approx(np.abs(whole - straight).max(), abs=near)
    flat = len(set(values.values())) == 1
    assert (not table) == flat
    for shape in CURVE_NAMES:
        spec = varied({"curve": {f"{t} degC": f"{v} mg" for t, v in values.items()}})
        (family,) = curve_families(spec, shape).values()
        drawn = family.draws(3, np.random.default_rng(1))
        for one in drawn:
            shares = [float(largest_left(one, n)) / left for n, left in table.items()]
            assert flat or max(shares) == pytest.approx(1.0, rel=1e-9)
        assert flat == (not drawn.any())


def test_as_many_even_points_as_were_measured_say_nothing() -> None:
    """Straight lines through all measured points leave nothing: not a word on what is between them."""
    even = measured({-60.0: 5.0, -20.0: 1.0, 20.0: 0.0, 60.0: -3.0})
    assert [*table_of(even, -60.0, 60.0)] == [1, 2, 3]
    corner = measured({-60.0: 5.0, -30.0: 2.5, 0.0: 0.0, 30.0: 2.5, 60.0: 5.0})
    assert [*table_of(corner, -60.0, 60.0)] == [1, 2, 4]  # three points stand on its three corners
    assert [*table_of(measured({-60.0: 5.0, 60.0: -3.0}), -60.0, 60.0)] == [1]


def test_the_measured_family_is_the_curve_itself_up_to_its_sign() -> None:
    curve = measured({-60.0: 5.0, -20.0: 1.0, 20.0: 0.0, 70.0: -3.0})
    family, rng = one_unit(curve), np.random.default_rng(3)
    drawn = family.draws(50, rng)
    signs = drawn[:, 0] / curve.values[0]
    assert set(signs) == {1.0, -1.0}
    np.testing.assert_array_equal(drawn, signs[:, None] * curve.values)
    at = np.array([-70.0, -40.0, 33.0])
    seen = along(at, curve.temperatures_degc, curve.values)
    np.testing.assert_allclose(second_moment(family, at, 1, rng), np.outer(seen, seen), rtol=1e-12)


# ---------------------------------------------------------------- the curves of several units


def test_several_units_have_the_mean_and_the_covariance_of_the_measured_curves() -> None:
    """As NumPy's mean and covariance (N − 1) of the curves, measured at temperatures of their own."""
    curves = [
        measured({-60.0: 5.0, -20.0: 1.0, 60.0: -3.0}),
        measured({-60.0: 1.0, 10.0: 2.0, 30.0: 0.0, 60.0: 3.0}),
        measured({-60.0: -2.0, 60.0: 4.0}),
        measured({-60.0: 0.0, 0.0: 4.0, 60.0: 4.0}),
    ]
    family = several_units(curves)
    at = np.linspace(-60.0, 60.0, 25)
    seen = np.array([np.interp(at, c.temperatures_degc, c.values) for c in curves])
    mean, covariance = seen.mean(axis=0), np.cov(seen.T)
    found = second_moment(family, at, 1, np.random.default_rng(0))
    np.testing.assert_allclose(found, np.outer(mean, mean) + covariance, atol=1e-15)
    drawn = along(at, family.grid, family.draws(20_000, np.random.default_rng(1)))
    size = np.sqrt(np.diag(covariance).max())
    np.testing.assert_allclose(drawn.mean(axis=0), mean, atol=0.03 * size)
    np.testing.assert_allclose(np.cov(drawn.T), covariance, atol=0.05 * size**2)


# ---------------------------------------------------------------- drawn units


@pytest.mark.parametrize("name", FAMILY_NAMES)
def test_a_drawn_unit_has_the_curves_of_the_family(name: FamilyName) -> None:
    spec, laid = campaign_of(temperatures=3, repeats=1)
    residual = ErrorBudget.model_validate({"temperature_residual": {"curve": ONE}})
    unit = spec.unit.model_copy(update={"gyro": {}, "accelerometer": {"bias": residual}})
    spec = spec.model_copy(update={"unit": unit})
    _, truth = simulate(laid, prepared(spec, name), 4, settings=noiseless())
    (family,) = curve_families(spec, name).values()
    for term in truth.terms:
        assert term.curve is not None
        assert term.temperatures_degc is not None
        np.testing.assert_array_equal(term.temperatures_degc, family.grid)
        itself = len(term.curve) == len(ONE)
        assert itself == (name == "measured")
        if not itself:
            table = table_of(residual.measured_curve or measured({}), -60.0, 60.0)
            shares = [float(largest_left(term.curve, n)) / left for n, left in table.items()]
            assert max(shares) == pytest.approx(1.0, rel=1e-9)


def test_left_out_the_curves_are_the_measured_ones_and_cosines() -> None:
    spec, laid = campaign_of(temperatures=3, repeats=1, name="tactical_leg.yaml")
    table, _ = simulate(laid, prepared(spec), 4)
    same, _ = simulate(laid, prepared(spec, "measured"), 4)
    other, _ = simulate(laid, prepared(spec, "cosines"), 4)
    np.testing.assert_array_equal(table.gyro, same.gyro)
    np.testing.assert_array_equal(table.acc, other.acc)  # its tables leave cosines either way
    assert np.abs(table.gyro - other.gyro).max() > 0


def test_plus_signs_take_a_measured_curve_as_it_is() -> None:
    spec = varied({"curve": ONE})
    _, laid = campaign_of(temperatures=3, repeats=1)
    plus = replace(noiseless(), signs="plus")
    for seed in range(4):
        _, truth = simulate(laid, prepared(spec), seed, settings=plus)
        for term in truth.terms:
            assert term.curve is not None
            assert term.curve[0] > 0


def test_the_command_draws_the_family_that_it_is_told(tmp_path: Any) -> None:
    def written(name: str, *words: str) -> bytes:
        out = tmp_path / f"{name}.csv"
        asked = ["simulate", str(SHIPPED / "small_uav.yaml"), *words, "-o", str(out)]
        assert CliRunner().invoke(app, asked).exit_code == 0
        return out.read_bytes()

    assert written("a") == written("b", "--curves", "cosines")
    assert written("c", "--curves", "kink") != written("a")
    refused = CliRunner().invoke(
        app, ["simulate", str(SHIPPED / "small_uav.yaml"), "--curves", "cubik", "-o", str(tmp_path / "d.csv")]
    )
    assert refused.exit_code != 0
