"""The parts of a budget in verify's draws, references that err, noise and alignment in flight."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from planner.physics.earth import gravity
from planner.plan.spec_to_trajectory import trajectory_of
from planner.verify.beside import ALIGNMENT, noise_name
from planner.verify.chance import Chance
from planner.verify.draws import _over, gauss_markov
from planner.verify.experiment import experiment, units_left, units_measured
from planner.verify.flights import beside_coefficients, exact_coefficients
from tests.specs import loaded
from tests.verify.plans import flown, plan_of

UNITS = 1000
STANDING = {"name": "static", "duration": "60 s", "sampling_rate": "50 Hz"}
NOUGHT = {"run_to_run": "1e-15 deg/s"}
NEAR = 5.0 / np.sqrt(UNITS)  # five standard errors of a correlation near nought


def changed(change, **options):
    """The experiment of the spec `flown` with its tree changed, on the plan of the unchanged one."""
    spec = copy.deepcopy(flown())
    change(spec)
    one = loaded(spec)
    trajectory = trajectory_of(one.spec.trajectory, one.folder)
    return experiment(plan_of("flown").document, one.spec, trajectory, **({"seed": 5} | options))


def only(part, value):
    """A unit with nothing but a part of the gyro's bias."""

    def change(spec):
        spec["unit"] = {
            "gyro": {"bias": NOUGHT | {part: value}, "scale_factor": {"run_to_run": "1e-15 %"}},
            "accelerometer": {"bias": {"run_to_run": "1e-15 g"}},
        }

    return change


def records_of_bias(e, units=UNITS):
    made = units_measured(e, 0, units)
    (error,) = [x for x in made.errors if x.name == "gyro.bias"]
    return error.records


# ---------------------------------------------------------------- budgets


@pytest.mark.parametrize("seconds", [30.0, 600.0])
def test_in_run_drift_is_forgotten_with_its_own_correlation_time(seconds):
    e = changed(only("in_run", {"value": "0.001 deg/s", "correlation_time": f"{seconds} s"}))
    records, on = records_of_bias(e), e.records.conditions.time_on
    run = e.records.runs[0]
    found = np.corrcoef(records[:, run, 0].T)
    wanted = np.exp(-np.abs(np.subtract.outer(on[run], on[run])) / seconds)
    assert np.abs(found - wanted).max() < NEAR


def test_the_flights_drift_has_the_correlation_time_too():
    e = changed(only("in_run", {"value": "0.001 deg/s", "correlation_time": "40 s"}))
    (left,) = [x for x in units_left(e, 0, UNITS) if x.name == "gyro.bias"]
    drift, at = left.parts[1, :, :, 0], e.flight.moments
    assert np.diff(at).max() <= 4.0  # a tenth of it
    found = np.corrcoef(drift.T)
    assert np.abs(found - np.exp(-np.abs(np.subtract.outer(at, at)) / 40.0)).max() < NEAR


def test_run_to_run_is_forgotten_over_temperature():
    t = np.array([-40.0, 20.0, -40.0, 0.0, 60.0])
    rng = np.random.default_rng(1)
    z = _over(t, rng.normal(size=(UNITS, 3)), 40.0, rng)
    assert z.shape == (UNITS, 5, 3)
    np.testing.assert_array_equal(z[:, 0], z[:, 2])
    wanted = np.exp(-0.5 * (np.subtract.outer(t, t) / 40.0) ** 2)
    assert np.abs(np.cov(z[:, :, 1].T) - wanted).max() < 2.0 * NEAR


def test_power_ons_are_drawn_one_by_one():
    e = changed(only("run_to_run", {"value": "0.002 deg/s", "temperature_correlation": "30 K"}))
    records = records_of_bias(e)
    first = np.array([run[0] for run in e.records.runs])
    found = np.corrcoef(records[:, first, 0].T)
    assert np.abs(found - np.eye(len(first))).max() < NEAR
    for run in e.records.runs:
        assert np.all(records[:, run, :] == records[:, run[:1], :])


@pytest.mark.parametrize("days", [0.0, 60.0, 240.0])
def test_storage_walks_on_until_the_flight(days):
    def change(spec):
        only("storage", "0.001 deg/s")(spec)
        spec["flown_after"] = f"{days} d"

    e = changed(change)
    (left,) = [x for x in units_left(e, 0, UNITS) if x.name == "gyro.bias"]
    wanted = np.radians(0.001) * np.sqrt((e.records.end_day - np.max(e.records.on_day) + days) / 60.0)
    # three axes of a thousand units: five standard errors of a standard deviation are 6.5 %
    assert np.sqrt(np.mean(left.parts[2] ** 2)) == pytest.approx(wanted, rel=0.065)


def test_gauss_markov_starts_anew_at_every_run():
    z = gauss_markov(np.array([0.0, 1.0, 2.0]), np.array([0, 2]), 1e9, (UNITS, 1), np.random.default_rng(2))
    assert np.allclose(z[:, 0], z[:, 1], atol=1e-3)
    assert abs(np.corrcoef(z[:, 1, 0], z[:, 2, 0])[0, 1]) < NEAR


# ---------------------------------------------------------------- references


def accurate(**accuracy):
    def change(spec):
        spec["benches"]["rate_table"]["accuracy"] = accuracy

    return change


def test_a_tilted_base_is_one_draw_for_all_repeats():
    e = changed(accurate(level="0.1 deg"), chance=Chance(temperature_jitter=0.0))
    met = units_measured(e, 0, UNITS).met
    off = (met.true.specific_force - met.shown.specific_force).reshape(UNITS, -1, 3)
    turned = np.array([m.turned for m in e.records.motions])
    first = np.flatnonzero(np.abs(turned - turned[0]).max(axis=(1, 2)) < 1e-12)
    assert len(first) > 5
    assert np.ptp(off[:, first], axis=1).max() < 1e-12
    across = np.linalg.norm(off[:, first[0]], axis=1)
    assert np.sqrt(np.mean(across**2)) == pytest.approx(np.radians(0.1) * 9.80665 * np.sqrt(2), rel=0.1)


def test_a_rate_table_that_is_off_is_a_scale_factor_that_no_repeat_tells():
    """Relative 0.1 %: every estimate of the gyros' scale factor is off by the same draw.

    (The Earth's rate in the static records would tell one of 1 %.)
    """
    e = changed(accurate(rate="0.1 %"))
    (left,) = [x for x in units_left(e, 0, UNITS) if x.name == "gyro.scale_factor"]
    off = left.at_nodes[:, 0, :]
    assert np.abs(np.corrcoef(off.T) - 1.0).max() < 0.01
    assert np.std(off[:, 0]) == pytest.approx(0.001, rel=0.12)


def test_a_thermometer_that_is_off_moves_the_curve_and_not_the_table():
    e = changed(accurate(temperature="2 K"))
    met = units_measured(e, 0, 20).met
    off = (met.true.temperature_degc - met.shown.temperature_degc).reshape(20, -1)
    assert np.ptp(off, axis=1).max() < 1e-12
    assert np.std(off[:, 0]) > 0.5


def test_perfect_references_are_what_they_say():
    met = units_measured(changed(lambda spec: None), 0, 3).met
    for name, value in vars(met.true).items():
        np.testing.assert_array_equal(value, getattr(met.shown, name))


# ---------------------------------------------------------------- noise and alignment in flight


def noisy(spec):
    spec["unit"]["noise"] = {"gyro": "0.3 deg/sqrt(h)", "accelerometer": "0.06 m/s/sqrt(h)"}
    spec["trajectory"] = STANDING


def test_noise_in_flight_is_the_random_walk_of_the_integrals():
    """At rest for T: φ by N√T; velocity by N√T; position by N √(T³/3), and by gyros g N √(T⁵/20)."""
    e = changed(noisy)
    beside, history = e.flight.beside, e.flight.linear
    assert beside.names == ("gyro noise", "accelerometer noise")
    T = 60.0
    gyro, force = np.radians(0.3) / 60.0, 0.06 / 60.0
    one = {s: np.eye(3 * (len(beside.edges) - 1)) * n for s, n in beside.noise.items()}
    width = np.repeat(np.sqrt(np.diff(beside.edges)), 3)
    spread = {
        s: beside_coefficients(e.flight, {noise_name(s): one[s] / width[:, None]}, len(one[s])) for s in one
    }

    def sigma(of, sensor):
        return np.sqrt(np.sum((getattr(history, of)[-1] @ spread[sensor].T) ** 2, axis=1))

    g = float(gravity(e.flight.trajectory.latitude[:1], e.flight.trajectory.altitude[:1])[0])
    # the Earth turns by 0.25 deg in the minute; Schuler's and the vertical loop change 0.1 % of the position
    assert sigma("attitude", "gyro")[:2] == pytest.approx(gyro * np.sqrt(T), rel=2e-3)
    assert sigma("velocity", "accelerometer") == pytest.approx(force * np.sqrt(T), rel=2e-3)
    assert sigma("position", "accelerometer") == pytest.approx(force * np.sqrt(T**3 / 3.0), rel=3e-3)
    assert sigma("position", "gyro")[:2] == pytest.approx(g * gyro * np.sqrt(T**5 / 20.0), rel=3e-3)


def test_noise_that_only_simulate_assumes_does_not_fly():
    e = changed(lambda spec: None)
    assert e.chance.white["gyro"] > 0
    assert e.flight.beside.names == ()


def aligned(**said):
    def change(spec):
        spec["initial_alignment"] = said
        spec["trajectory"] = STANDING | {"heading": "30 deg"}

    return change


@pytest.mark.parametrize(("angle", "place"), [("roll_pitch", 0), ("roll_pitch", 1), ("heading", 2)])
def test_the_attitude_is_off_from_the_start_as_drawn(angle, place):
    e = changed(aligned(**{angle: "0.5 deg"}))
    drawn = e.flight.beside.drawn(e.flight.trajectory, UNITS, (1, 0))
    flown = e.flight.navigate(beside_coefficients(e.flight, drawn, UNITS))
    end = np.degrees(flown.attitude[-1, place])
    assert np.std(end) == pytest.approx(0.5, rel=0.12)
    others = np.delete(np.degrees(flown.attitude[-1]), [0, 1] if angle == "roll_pitch" else [2], axis=0)
    assert np.abs(others).max() < 0.02  # the Earth's rate in a minute, 0.25 deg, times 1.5 deg


def test_accelerometers_that_level_themselves_feel_no_error_of_theirs():
    """A bias of the accelerometers makes a tilt that hides it: the unit does not run away, but leans."""

    def change(spec):
        aligned(self_aligned=True)(spec)
        only("run_to_run", "1e-15 deg/s")(spec)
        spec["unit"]["accelerometer"]["bias"] = {"run_to_run": "1 mg"}

    e = changed(change, chance=Chance(white={"gyro": 1e-9, "accelerometer": 1e-9}))
    left = units_left(e, 0, 50)
    own = e.flight.navigate(exact_coefficients(e.flight, left))
    bare = e.flight.without_beside()
    given = bare.navigate(exact_coefficients(bare, left))
    horizontal = [np.linalg.norm(h.position[-1, :2], axis=0) for h in (own, given)]
    assert np.median(horizontal[0] / horizontal[1]) < 0.003  # of 18 m
    size = np.degrees(np.linalg.norm(own.attitude[-1, :2], axis=0))
    assert np.sqrt(np.mean(size**2)) == pytest.approx(np.degrees(1e-3) * np.sqrt(2), rel=0.25)
    assert ALIGNMENT in e.beside


def test_budgets_of_the_bench_do_not_fly():
    def change(spec):
        spec["effects"] = [*spec["effects"], "earth_rate"]

    e = changed(change)
    assert ("gyro", "earth_rate") not in e.errors
    assert "gyro.earth_rate" not in [x.name for x in units_measured(e, 0, 3).errors]
    (triad,) = e.estimators["gyro"]
    assert triad.model.channels == (0, 1, 2)
