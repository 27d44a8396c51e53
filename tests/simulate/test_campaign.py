from __future__ import annotations

import hashlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.campaign.design import design
from planner.campaign.exposure import exposure
from planner.errors import InputError
from planner.nouns.plan_file import steps_of
from planner.physics.earth import EARTH_RATE_RADPS
from planner.plan.default_campaign import default_campaign
from planner.plan.schedule_to_steps import steps
from planner.simulate.campaign import Settings, prepared, simulate
from planner.simulate.hidden import hidden_effect
from planner.units import STANDARD_GRAVITY_MPS2
from tests.simulate.benches import campaign_of, noiseless, shipped

G = STANDARD_GRAVITY_MPS2
LATITUDE = np.radians(52.0)

# ---------------------------------------------------------------- where a motion puts the unit


@given(p1=st.floats(-360, 360), p2=st.floats(-180, 180))
@settings(deadline=None, max_examples=40)
def test_a_rest_feels_one_g_and_the_earth(p1: float, p2: float) -> None:
    seen = exposure({"position_1_deg": p1, "position_2_deg": p2}, 60.0, LATITUDE)
    a, b = np.radians([p1, p2])
    up = np.array([-np.sin(b) * np.cos(a), np.sin(b) * np.sin(a), np.cos(b)])
    np.testing.assert_allclose(seen.specific_force, G * up, atol=1e-12 * G)
    np.testing.assert_allclose(np.linalg.norm(seen.rate), EARTH_RATE_RADPS, rtol=1e-12)
    np.testing.assert_allclose(seen.rate @ up, EARTH_RATE_RADPS * np.sin(LATITUDE), rtol=1e-9)


@pytest.mark.parametrize(
    "motion",
    [
        {"position_2_deg": 30.0, "rate_1_dps": 17.0},
        {"position_1_deg": 20.0, "rate_2_dps": 3.0},
    ],
)
@pytest.mark.further("motion", [{"position_1_deg": 90.0, "rate_2_dps": -41.0}])
def test_a_turn_is_the_mean_of_its_rests(motion: dict[str, float]) -> None:
    duration, n = 7.0, 4000
    t = (np.arange(n) + 0.5) / n * duration
    still = [
        exposure(
            {f"position_{k}_deg": motion.get(f"position_{k}_deg", 0.0) + motion.get(f"rate_{k}_dps", 0.0) * s
             for k in (1, 2)},
            1.0,
            LATITUDE,
        )
        for s in t
    ]  # fmt: skip
    seen = exposure(motion, duration, LATITUDE)
    # a midpoint rule of 4000 instants is good to 1e-7 of the sum
    np.testing.assert_allclose(
        seen.specific_force, np.mean([e.specific_force for e in still], 0), atol=1e-6 * G
    )
    driven = seen.rate - np.mean([e.rate for e in still], 0)
    asked = np.radians(sum(abs(motion.get(f"rate_{k}_dps", 0.0)) for k in (1, 2)))
    np.testing.assert_allclose(np.linalg.norm(driven), asked, rtol=1e-6)


def test_body_x_turns_about_axis_2_with_axis_1_at_ninety() -> None:
    seen = exposure({"position_1_deg": 90.0, "rate_2_dps": 100.0}, 36.0, LATITUDE)  # ten full turns
    np.testing.assert_allclose(np.abs(np.degrees(seen.rate[0])), 100.0, rtol=1e-4)
    np.testing.assert_allclose(seen.specific_force, 0.0, atol=1e-9)


def test_a_centrifuge_loads_along_the_arm() -> None:
    seen = exposure({"acceleration_g": -50.0}, 20.0, 0.0, arm=0.4)
    np.testing.assert_allclose(seen.specific_force, [-50.0 * G, 0.0, G])
    np.testing.assert_allclose(seen.rate[2], np.sqrt(50.0 * G / 0.4))


@pytest.mark.parametrize("mount", [0, 1, 2])
def test_a_remounted_unit_is_loaded_along_the_next_axis(mount: int) -> None:
    seen = exposure({"acceleration_g": -50.0}, 20.0, 0.0, arm=0.4, mount=mount)
    assert np.argmax(np.abs(seen.rate)) == mount  # the axis of the turn stands upright
    along = (mount + 1) % 3
    np.testing.assert_allclose(seen.specific_force[along], -50.0 * G)
    np.testing.assert_allclose(seen.specific_force[mount], G)


@pytest.mark.parametrize("mount", [0, 1, 2])
def test_a_remounted_unit_stands_on_another_axis(mount: int) -> None:
    seen = exposure({"rate_1_dps": 10.0}, 36.0, LATITUDE, mount=mount)
    assert np.argmax(seen.specific_force) == mount
    assert np.argmax(seen.rate) == mount


# ---------------------------------------------------------------- the campaign


@pytest.mark.parametrize(
    ("name", "seed", "digest"),
    [("small_uav.yaml", 1, "20a838b153a58810"), ("high_g.yaml", 7, "815262218da48d21")],
)
def test_a_spec_without_new_keys_gives_the_dwells_that_it_always_gave(
    name: str, seed: int, digest: str
) -> None:
    """Nine digits: the last ones are the processor's (its exp, its sin), and say nothing of the program.

    Those of high_g changed once: where gravity goes round, its cubes are the mean of cubes.
    """
    table, truth = simulate(
        design(steps(shipped(name), default_campaign(shipped(name))), shipped(name)),
        prepared(shipped(name)),
        seed,
    )
    columns = (table.gyro, table.acc, table.temperature_degc, table.time_on, table.ref_rate, table.ref_acc)
    numbers = np.concatenate([np.ravel(c) for c in (*columns, [t.value for t in truth.terms])])
    text = " ".join(f"{x + 0.0:.9g}" for x in np.where(np.abs(numbers) < 1e-12, 0.0, numbers))
    assert hashlib.sha256((text + " ".join(table.step)).encode()).hexdigest()[:16] == digest


def test_same_seed_same_bytes_and_another_seed_another_unit() -> None:
    spec, plan = campaign_of(temperatures=3)
    unit = prepared(spec)
    (a, truth), (b, _), (c, _) = (simulate(plan, unit, seed) for seed in (4, 4, 5))
    assert a.gyro.tobytes() == b.gyro.tobytes()
    assert not np.array_equal(a.gyro, c.gyro)
    assert truth.seed == 4


def test_a_hidden_effect_changes_nothing_else() -> None:
    """Draws have keys of their own: with and without it the rest of the unit is the same to the bit."""
    spec, plan = campaign_of(temperatures=1)
    unit = prepared(spec)
    plain, _ = simulate(plan, unit, 2)
    hidden, truth = simulate(plan, unit, 2, hidden=[hidden_effect("g_sensitivity=0.01deg/s/g")])
    k = np.array([t.value for t in truth.terms if t.hidden]).reshape(3, 3)
    np.testing.assert_allclose(np.abs(k).max(), np.radians(0.01) / G)
    np.testing.assert_allclose(hidden.gyro - plain.gyro, plain.ref_acc @ k.T, atol=1e-15)
    assert np.array_equal(hidden.acc, plain.acc)


def test_the_measurement_equation_has_its_products() -> None:
    spec, plan = campaign_of(temperatures=1)
    table, truth = simulate(plan, prepared(spec), 3, settings=noiseless())

    def of(effect: str, term: str) -> float:
        return truth.at(f"gyro.{effect}", term, float(table.temperature_degc[0]))

    u = table.ref_rate
    v = u[:, 0] + of("misalignment", "xy") * u[:, 1] + of("misalignment", "xz") * u[:, 2]
    expected = (1.0 + of("scale_factor", "x")) * v + of("bias", "x")
    np.testing.assert_allclose(table.gyro[:, 0], expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("sensor", ["gyro", "accelerometer"])
def test_spreads_are_those_of_the_budget(sensor: str) -> None:
    """Run-to-run of the bias over 400 power-ons: its spread is known to 3.5 %; 4 sigma of that."""
    spec, plan = campaign_of(temperatures=1, repeats=200)
    with_spread, _ = simulate(plan, prepared(spec), 1, settings=Settings(**quiet("run_to_run")))
    without, _ = simulate(plan, prepared(spec), 1, settings=Settings(**quiet()))
    readings = "gyro" if sensor == "gyro" else "acc"
    first = plan.starts[:200]  # static records: the rotations add their own scale factors and misalignment
    change = (getattr(with_spread, readings) - getattr(without, readings))[first]
    budget = getattr(spec.unit, sensor)
    force = 0.0 if sensor == "gyro" else G * budget["misalignment"].run_to_run.si
    sigma = np.hypot(np.interp(20.0, *_table(budget["bias"].run_to_run)), force)
    np.testing.assert_allclose(np.std(change[:, :2]), sigma, rtol=0.12)


def _table(spread) -> tuple[list[float], list[float]]:
    if not isinstance(spread, dict):
        return [0.0], [spread.si]
    return sorted(spread), [spread[t].si for t in sorted(spread)]


def quiet(*kept: str) -> dict:
    parts = ("run_to_run", "in_run", "storage")
    white = {"gyro": 0.0, "accelerometer": 0.0}
    return {name: name in kept for name in parts} | {"white": white, "temperature_jitter": 0.0}


def test_a_worst_unit_has_all_of_its_budget() -> None:
    spec, plan = campaign_of(temperatures=1)
    _, truth = simulate(plan, prepared(spec), 1, settings=Settings(case="worst", signs="plus"))
    for term in truth.terms:
        sensor, effect = term.error.split(".")
        assert term.value == getattr(spec.unit, sensor)[effect].systematic.si


def test_power_ons_and_times_come_from_the_plan() -> None:
    spec, plan = campaign_of(temperatures=1, repeats=2)
    assert len(plan.starts) == 2 * len(spec.tests)
    static = spec.tests["static"]
    expected = static.power_on + 5.0 + static.record / 2.0  # small_uav moves in 5 s
    assert plan.conditions.time_on[0] == pytest.approx(expected)
    assert (np.diff(plan.conditions.day) > 0).all()


# ---------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("g_sensitivity", "write EFFECT=VALUE"),
        ("g_sensitivty=0.01deg/s/g", "did you mean 'g_sensitivity'"),
        ("g_sensitivity=0.01deg/s", "must have a unit like deg/s/g"),
        ("accelerometer.g_sensitivity=0.01deg/s/g", "none of its sensors"),
        ("gyro.g_sensitivity.xw=0.01deg/s/g", "no term 'xw'"),
        ("warm_up=nan deg/s", "not a finite number"),
        ("=1 g", "no effect is called"),
    ],
)
def test_a_hidden_effect_that_cannot_be_is_refused(text: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        hidden_effect(text)


def test_a_term_and_a_sensor_can_be_asked_for() -> None:
    found = hidden_effect("gyro.g_sensitivity.xx=0.01deg/s/g")
    assert (found.sensors, found.term) == (("gyro",), "xx")
    assert hidden_effect("warm_up=0.1 mg").sensors == ("accelerometer",)
    assert hidden_effect("scale_factor_asymmetry=0.1 %").sensors == ("gyro", "accelerometer")


def test_a_plan_without_records_is_refused() -> None:
    with pytest.raises(InputError, match="no record steps"):
        design([], shipped("small_uav.yaml"))
    with pytest.raises(InputError, match=r"steps\.x\.bench: Field required"):
        steps_of({"steps": [{"id": "x"}]})
