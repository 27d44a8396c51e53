"""Curves of every family: verify's own against the simulator's, laws of each, what the spec says of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.pipelines.promise import FlightOptions, verify
from planner.simulate.families import curve_families
from planner.simulate.temperature_curves import second_moment
from planner.spec.curve_names import families_of
from planner.verify.curve_shapes import DRAWN, ROWS, SHAPES
from planner.verify.curves import family, table_of, tabled
from planner.verify.families import curves_in, usual_family
from planner.verify.second_moments import moments_of
from tests.specs import loaded, shipped, small
from tests.verify.plans import flown, planned_from

TABLE = {1: 0.03, 3: 0.0085, 5: 0.0035}


def with_residual(residual: dict) -> dict:
    spec = small()
    spec["unit"]["gyro"]["bias"] |= {"temperature_residual": residual}
    return spec


@pytest.mark.parametrize("shape", sorted(DRAWN))
def test_rows_are_the_second_moment_of_what_is_drawn(shape):
    """40 000 draws: a moment is known to 0.7 % of the largest, one sigma."""
    drawn = DRAWN[shape](40_000, np.random.default_rng(2))
    rows = ROWS[shape]()
    wanted = rows.T @ rows
    np.testing.assert_allclose(drawn.T @ drawn / len(drawn), wanted, atol=0.04 * wanted.max())


@settings(max_examples=20)
@given(
    shape=st.sampled_from(SHAPES),
    sizes=st.lists(st.floats(0.1, 1.0), min_size=2, max_size=4),
    seed=st.integers(0, 100),
)
def test_the_largest_residual_meets_the_table_at_one_n_and_exceeds_it_at_none(shape, sizes, seed):
    table = dict(zip((1, 3, 5, 8), np.cumprod(sizes).tolist(), strict=False))
    curves = family(table, -40.0, 60.0, "largest", shape).drawn(5, np.random.default_rng(seed))
    left = np.array([np.abs(curves - tabled(curves, n)).max(axis=1) / size for n, size in table.items()])
    np.testing.assert_allclose(left.max(axis=0), 1.0, rtol=1e-9)
    np.testing.assert_allclose(curves.mean(axis=1), 0.0, atol=1e-12)


@pytest.mark.parametrize("shape", sorted(DRAWN))
def test_a_sigma_is_exceeded_at_no_n_and_met_at_one(shape):
    """8000 curves: an rms is known to 1.5 %, two sigma of the curves that scatter most."""
    curves = family(TABLE, -40.0, 60.0, "sigma", shape).drawn(8000, np.random.default_rng(3))
    left = [np.sqrt(np.mean((curves - tabled(curves, n)) ** 2)) / size for n, size in TABLE.items()]
    assert max(left) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("spec", "name"),
    [("helicopter", "cubic"), ("helicopter", "kink"), ("tactical_leg", "measured")],
)
@pytest.mark.further(
    ("spec", "name"),
    [("helicopter", name) for name in SHAPES if name not in ("cubic", "kink")],
)
def test_both_codes_draw_the_same_world(spec, name):
    """Second moments, error by error: 20 000 curves each agree to 4 % of the largest.

    Less the chord: a table that begins at three points says nothing of a slope, and among the curves that are
    nearly straight there are some of any slope.
    """
    spec = shipped(spec).spec
    theirs, own = curve_families(spec, name), curves_in(spec, name)
    assert theirs.keys() == own.keys()
    at = np.linspace(*spec.plan.temperatures.range, 12)
    share = np.linspace(0.0, 1.0, 12)
    bent = np.eye(12) - np.outer(1.0 - share, np.eye(12)[0]) - np.outer(share, np.eye(12)[-1])
    for error, moment in moments_of(own).items():
        wanted = bent @ second_moment(theirs[error], at, 20_000, np.random.default_rng(4)) @ bent.T
        found = bent @ moment.at(at) @ bent.T
        np.testing.assert_allclose(found, wanted, atol=0.04 * wanted.max(), err_msg=str(error))


def test_the_curves_of_several_units_have_their_mean_and_covariance():
    units = [{-60.0: a, 0.0: b, 60.0: c} for a, b, c in ((3, 0, 1), (1, 1, 0), (2, -1, -1), (6, 0, 4))]
    written = [{f"{t} degC": f"{v} deg/s" for t, v in unit.items()} for unit in units]
    spec = loaded(with_residual({"curve": written})).spec
    assert families_of(spec)[0] == "cosines"  # of the accelerometer's table
    drawn = curves_in(spec, "kink")["gyro", "bias"].drawn(40_000, np.random.default_rng(5))
    values = np.radians(np.array([list(unit.values()) for unit in units], dtype=float))
    spread = values.std(axis=0, ddof=1)
    np.testing.assert_allclose(drawn.mean(axis=0), values.mean(axis=0), atol=0.03 * spread.max())
    np.testing.assert_allclose(np.cov(drawn.T), np.cov(values.T), atol=0.05 * spread.max() ** 2)


def test_a_family_that_the_spec_names_is_flown_whatever_is_asked():
    spec = loaded(with_residual(dict.fromkeys(TABLE, "0.01 deg/s") | {"curve": "kink"})).spec
    one, other = (
        curves_in(spec, name)["gyro", "bias"].drawn(3, np.random.default_rng(6)) for name in SHAPES[:2]
    )
    np.testing.assert_array_equal(one, other)
    assert usual_family(spec) == "cosines"


def test_the_usual_curves_of_a_measured_one_are_itself():
    spec = shipped("tactical_leg").spec
    assert usual_family(spec) == "measured"
    measured = spec.unit.gyro["bias"].measured_curve
    drawn = curves_in(spec, "measured")["gyro", "bias"].drawn(4, np.random.default_rng(7))
    np.testing.assert_array_equal(np.abs(drawn), np.abs(np.tile(measured.values, (4, 1))))


def test_what_points_leave_of_a_measured_curve_is_its_table():
    t = np.array([-40.0, 0.0, 40.0, 80.0])
    found = table_of(t, np.array([0.0, 1.0, 0.0, 1.0]), -40.0, 80.0)
    assert found == pytest.approx({1: 0.5, 2: 2.0 / 3.0, 3: 2.0 / 3.0})


def test_worst_is_where_the_linear_model_says():
    """A bias known at one temperature alone is worst at the end of the range that is farther away."""
    spec = flown(name="worst")
    wanted = [
        {"error": "position", "limit": "9 km", "rule": {"percentile": "95 %"}, "temperature": "worst"},
        {
            "error": "position",
            "limit": "9 km",
            "rule": "rss",
            "temperature": {"distribution": {"20 degC": 1}},
        },
    ]
    fixed = {test: {"temperatures": ["20 degC"], "repeats": 3} for test in ("static", "rates")}
    plan = spec["plan"] | {"fixed": fixed, "method": "published"}
    plan["temperatures"] = plan["temperatures"] | {"range": ["-60 degC", "40 degC"]}
    spec |= {"requirement": wanted, "plan": plan}
    one = planned_from(spec)
    found = verify(one.loaded, one.document, FlightOptions(50, through_files=0), lambda message: None)
    assert [o.starts for o in found.outcomes] == ["from -60 degC on, the worst", "from 20 degC on"]


@pytest.mark.parametrize("figure", ["sigma", "largest"])
@pytest.mark.parametrize("after_five", [0.0045, 0.00555, 0.007])
def test_fast_waves_of_a_table_that_falls_slowly_are_whole(figure, after_five):
    """A table that 3 and 5 points meet by waves of 24 points each: their variance between nodes is all there.

    2000 curves of one shape: a mean square is known to 3 %; a sixth of the fast wave's was missing.
    """
    table = {1: 0.083, 3: 0.0131, 5: after_five}
    one = family(table, -20.0, 70.0, figure)
    assert one.amplitude[20:].max() > 0.0
    at = np.linspace(-20.0, 70.0, 333)
    drawn = one.drawn(2000, np.random.default_rng(4))
    seen = np.array([np.interp(at, one.grid, curve) for curve in drawn])
    flat = seen - tabled(seen, 5)
    lost = np.eye(len(at)) - tabled(np.eye(len(at)), 5).T
    moment = moments_of({("gyro", "bias"): one}, 2000)["gyro", "bias"].at(at)
    assert np.trace(lost @ moment @ lost.T) / len(at) == pytest.approx(np.mean(flat**2), rel=0.06)
