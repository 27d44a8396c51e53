"""Verify's own code against the planner's: two codes written apart say the same of the same world."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.campaign.design import design
from planner.campaign.exposure import Misplaced, exposure
from planner.campaign.model import campaign
from planner.campaign.power_ons import of_design
from planner.campaign.reference_errors import reference_errors
from planner.nouns.plan_file import steps_of
from planner.protocols import SENSORS
from planner.simulate.campaign import Settings
from planner.simulate.temperature_curves import curve_family
from planner.spec.model import Spec, Unit
from planner.spec.references import BenchAccuracy
from planner.verify.chance import Chance
from planner.verify.curves import family
from planner.verify.exposures import BENCH_LATITUDE, motion_of, turned_by
from planner.verify.records import records_of
from planner.verify.references import directions, felt
from tests.verify.plans import SPECS, plan_of

angle = st.floats(-360.0, 360.0)
speed = st.floats(-400.0, 400.0).filter(lambda w: abs(w) > 0.1)
MOTIONS = st.one_of(
    st.fixed_dictionaries({"position_1_deg": angle, "position_2_deg": angle}),
    st.fixed_dictionaries({"rate_1_dps": speed, "position_2_deg": angle}),
    st.fixed_dictionaries({"position_1_deg": angle, "rate_2_dps": speed}),
    st.fixed_dictionaries({"acceleration_g": st.floats(-50.0, 50.0)}),
    st.fixed_dictionaries(
        {"acceleration_g": st.floats(1.0, 50.0), "position_2_deg": st.sampled_from([0.0, 90.0, 180.0])}
    ),
)
small = st.floats(-0.01, 0.01)


@settings(deadline=None, max_examples=200)
@given(
    asked=MOTIONS,
    seconds=st.floats(5.0, 300.0),
    mount=st.sampled_from([0, 1, 2]),
    arm=st.sampled_from([None, 2.0]),
    level=st.tuples(small, small),
    mounting=st.tuples(small, small, small),
    faster=small,
)
def test_benches_do_to_a_unit_what_simulate_says(asked, seconds, mount, arm, level, mounting, faster):
    off = Misplaced(np.array(level), np.array(mounting), faster)
    wanted = exposure(asked, seconds, BENCH_LATITUDE, arm=arm, mount=mount, references=off)
    base, held = turned_by(np.array([[*level, 0.0]])), turned_by(np.array([mounting]))
    rate, force = felt(motion_of(asked, seconds, arm, mount), base, held, np.array([faster]))
    np.testing.assert_allclose(rate[0], wanted.rate, atol=1e-11)
    np.testing.assert_allclose(force[0], wanted.specific_force, atol=1e-10)


def erring(spec: Spec, **said: str) -> Spec:
    """The spec with benches whose levels and rates err, or what else is said."""
    accuracy = BenchAccuracy.model_validate(said or {"level": "0.05 deg", "rate": "100 ppm"})
    benches = {name: bench.model_copy(update={"accuracy": accuracy}) for name, bench in spec.benches.items()}
    return spec.model_copy(update={"benches": benches})


def test_what_errs_on_a_bench_adds_to_first_order_what_verify_says():
    """Levels about north and west, and the rate, of records that lie, stand and turn."""
    plan = plan_of("flown")
    spec = erring(plan.loaded.spec)
    made = design(steps_of(plan.document), spec)
    own = reference_errors(made.asked, made.bench.tolist(), spec)
    ways = directions(records_of(plan.document, spec), spec)
    wanted = np.zeros_like(own)
    for number, way in enumerate(ways):  # two levels and a rate of every bench
        wanted[:, number % 3] += np.stack([way.rate, way.specific_force], axis=1)
    assert len(ways) == 3 * len(dict.fromkeys(made.bench.tolist()))
    assert np.abs(wanted[:, :2, 1][np.linalg.norm(made.conditions.rate, axis=1) > 0.1]).max() > 1.0
    np.testing.assert_allclose(own, wanted, atol=1e-6 * np.abs(wanted).max())


def test_a_table_whose_motions_nobody_knows_is_as_well_known_as_a_plan_of_it():
    """What a tilt adds to rests and to turns is then told by the conditions alone."""
    plan = plan_of("flown")
    right = plan.loaded.spec
    spec = erring(right)
    runs = of_design(design(steps_of(plan.document), spec), spec)
    table = replace(runs, misplaced=None)
    for channel, known in campaign(spec, runs).channels.items():
        sigma, without = known.sigma(), campaign(right, runs).channels[channel].sigma()
        assert np.any(sigma > 1.01 * without)
        np.testing.assert_allclose(campaign(spec, table).channels[channel].sigma(), sigma, rtol=0.01)


def test_a_mounting_that_errs_makes_quiet_gyros_no_noisier():
    """Turns about the other axes tell it; a millionth of what it adds at 500 deg/s was taken for noise."""
    plan = plan_of("flown")
    right = plan.loaded.spec
    still = {"systematic": "1 deg/h", "run_to_run": "0.01 deg/h"}
    unit = {"noise": {"gyro": "0.003 deg/sqrt(h)"}, "gyro": {"bias": still}}
    quiet = right.model_copy(update={"unit": Unit.model_validate(unit), "effects": ("bias", "scale_factor")})
    runs = of_design(design(steps_of(plan.document), quiet), quiet)
    off, perfect = (campaign(one, runs).channels for one in (erring(quiet, mounting="0.05 deg"), quiet))
    for channel in (c for c in off if c[0] == "gyro"):
        np.testing.assert_allclose(off[channel].sigma(), perfect[channel].sigma(), rtol=1e-3)


@pytest.mark.parametrize("name", SPECS)
def test_the_records_of_a_plan_are_those_of_simulate(name):
    plan = plan_of(name)
    theirs = design(steps_of(plan.document), plan.loaded.spec)
    own = records_of(plan.document, plan.loaded.spec)
    assert own.step.tolist() == theirs.step.tolist()
    assert own.run.tolist() == theirs.run.tolist()
    np.testing.assert_allclose(own.duration, theirs.duration)
    for key, value in vars(theirs.conditions).items():
        np.testing.assert_allclose(getattr(own.conditions, key), value, atol=1e-12, err_msg=key)


@pytest.mark.parametrize("figure", ["largest", "sigma"])
@pytest.mark.parametrize("table", [{1: 0.03, 3: 0.0085, 5: 0.0035}, {3: 500.0, 5: 150.0, 10: 70.0}, {2: 0.0}])
def test_curves_are_those_of_the_family(table, figure):
    theirs = curve_family(table, -40.0, 60.0, figure)
    own = family(table, -40.0, 60.0, figure)
    (found,) = own.drawn(1, np.random.default_rng(1))
    np.testing.assert_array_equal(own.grid, theirs.grid)
    # the amplitudes are a least-squares solution of either code: 1e-9 of the largest residual
    np.testing.assert_allclose(found, theirs.draw(np.random.default_rng(1)), atol=1e-9 * max(table.values()))


def test_records_without_a_noise_in_the_spec_are_as_noisy_as_simulate_makes_them():
    assert {s: Chance().white[s] for s in SENSORS} == pytest.approx(dict(Settings().white))
    assert Chance().temperature_jitter == Settings().temperature_jitter
