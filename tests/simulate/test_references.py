"""A bench whose references are off: what the unit truly sees, against rotations written anew here."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from planner.campaign.design import DEFAULT_LATITUDE, Design
from planner.campaign.exposure import Misplaced, exposure, rotation
from planner.export.truth import truth_text
from planner.physics.earth import EARTH_RATE_RADPS
from planner.simulate.campaign import Settings, Unit, prepared, simulate
from planner.simulate.references import drawn_references
from planner.spec.references import BenchAccuracy
from planner.units import STANDARD_GRAVITY_MPS2
from tests.documents import keeps
from tests.simulate.benches import campaign_of, noiseless

G = STANDARD_GRAVITY_MPS2
LATITUDE = np.radians(52.0)
angles = st.floats(-0.05, 0.05)
EARTH = EARTH_RATE_RADPS * np.array([np.cos(LATITUDE), 0.0, np.sin(LATITUDE)])


@given(x=st.floats(-3, 3), y=st.floats(-3, 3), z=st.floats(-3, 3))
@settings(deadline=None, max_examples=40)
def test_a_rotation_is_the_exponential_of_its_vector(x: float, y: float, z: float) -> None:
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    np.testing.assert_allclose(rotation(np.array([x, y, z])), expm(cross), atol=1e-12)


@given(
    p1=st.floats(-180, 180), p2=st.floats(-90, 90), a=angles, b=angles, d=st.tuples(angles, angles, angles)
)
@settings(deadline=None, max_examples=40)
def test_at_rest_level_turns_the_world_before_the_table_and_mounting_everything_after(
    p1: float, p2: float, a: float, b: float, d: tuple[float, float, float]
) -> None:
    level, mounting = np.array([a, b]), np.array(d)
    seen = exposure(
        {"position_1_deg": p1, "position_2_deg": p2},
        60.0,
        LATITUDE,
        references=Misplaced(level, mounting, 0.01),
    )
    table = Rotation.from_euler("z", -p1, degrees=True) * Rotation.from_euler("y", -p2, degrees=True)
    whole = Rotation.from_rotvec(mounting) * table * Rotation.from_rotvec([a, b, 0.0])
    np.testing.assert_allclose(seen.specific_force, whole.apply([0.0, 0.0, G]), atol=1e-11 * G)
    np.testing.assert_allclose(seen.rate, whole.apply(EARTH), atol=1e-11 * EARTH_RATE_RADPS)


@pytest.mark.parametrize("mount", [0, 1, 2])
def test_mounting_is_in_body_axes_however_the_unit_stands(mount: int) -> None:
    mounting = np.array([0.01, 0.03, -0.02])
    seen = exposure({"position_1_deg": 40.0}, 60.0, LATITUDE, mount=mount, references=_mounted(mounting))
    x, y, z = Rotation.from_euler("z", -40.0, degrees=True).apply(EARTH)
    body = np.zeros(3)
    body[[mount, (mount + 1) % 3, (mount + 2) % 3]] = z, x, y
    np.testing.assert_allclose(seen.rate, Rotation.from_rotvec(mounting).apply(body), atol=1e-16)


def _mounted(mounting: np.ndarray) -> Misplaced:
    return Misplaced(np.zeros(2), mounting, 0.0)


@pytest.mark.parametrize(
    "motion", [{"rate_1_dps": 17.0, "position_2_deg": 30.0}, {"rate_2_dps": -41.0, "position_1_deg": 70.0}]
)
def test_in_a_turn_the_driven_rate_is_off_by_its_error_and_knows_no_level(motion: dict[str, float]) -> None:
    level, mounting, error = np.array([0.02, -0.01]), np.array([0.01, 0.03, -0.02]), 0.003
    seen = exposure(motion, 7.0, LATITUDE, references=Misplaced(level, mounting, error))
    t = (np.arange(20_000) + 0.5) / 20_000 * 7.0
    p1, p2 = (motion.get(f"position_{k}_deg", 0.0) + motion.get(f"rate_{k}_dps", 0.0) * t for k in (1, 2))
    axes = ("z", -(p1 + 0.0 * t)), ("y", -(p2 + 0.0 * t))
    one, two = (Rotation.from_euler(axis, angle[:, None], degrees=True) for axis, angle in axes)
    base, unit = Rotation.from_rotvec([0.02, -0.01, 0.0]), Rotation.from_rotvec(mounting)
    axis = [0.0, 0.0, 1.0] if "rate_1_dps" in motion else one.apply([0.0, 1.0, 0.0])
    driven = np.radians(motion.get("rate_1_dps", 0.0) + motion.get("rate_2_dps", 0.0)) * (1.0 + error)
    rate = unit.apply((one * two * base).apply(EARTH) + driven * np.asarray(axis))
    force = unit.apply((one * two * base).apply([0.0, 0.0, G]))
    np.testing.assert_allclose(seen.rate, np.mean(rate, axis=0), rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(seen.specific_force, np.mean(force, axis=0), atol=1e-6 * G)


@pytest.mark.parametrize("mount", [0, 1, 2])
def test_a_centrifuge_that_turns_faster_loads_with_the_square(mount: int) -> None:
    arm, load, error = 0.4, 50.0, 0.002
    tilted = Misplaced(np.array([0.03, 0.04]), np.zeros(3), error)
    seen = exposure({"acceleration_g": -load}, 20.0, LATITUDE, arm=arm, mount=mount, references=tilted)
    speed = (1.0 + error) * np.sqrt(load * G / arm)
    base = Rotation.from_rotvec([0.03, 0.04, 0.0])
    up, along = mount, (mount + 1) % 3  # z, x, y lie where the table's z and x are, cyclically
    assert seen.specific_force[along] == pytest.approx(-arm * speed**2)
    assert seen.specific_force[up] == pytest.approx(G * base.apply([0.0, 0.0, 1.0])[2])
    assert seen.rate[up] == pytest.approx(speed + base.apply(EARTH)[2])


def test_perfect_references_change_nothing_at_all() -> None:
    motion = {"position_1_deg": 10.0, "rate_2_dps": 33.0}
    plain = exposure(motion, 20.0, LATITUDE)
    same = exposure(motion, 20.0, LATITUDE, references=Misplaced(np.zeros(2), np.zeros(3), 0.0))
    assert plain.rate.tobytes() == same.rate.tobytes()
    assert plain.specific_force.tobytes() == same.specific_force.tobytes()


# ---------------------------------------------------------------- in a campaign

ACCURACY = BenchAccuracy.model_validate(
    {"level": "0.01 deg", "mounting": "0.02 deg", "rate": "20 ppm", "temperature": "0.1 K"}
)


def with_accuracy(accuracy: BenchAccuracy = ACCURACY) -> tuple[Unit, Design]:
    spec, plan = campaign_of(temperatures=1)
    return replace(prepared(spec), accuracies={"rate_table": accuracy}), plan


def test_the_table_says_the_nominal_and_the_readings_are_of_what_truly_was() -> None:
    unit, plan = with_accuracy()
    ideal = replace(unit, budgets={}, families={})
    table, truth = simulate(plan, ideal, 3, settings=noiseless())
    assert np.array_equal(table.ref_rate, plan.conditions.rate)
    assert np.array_equal(table.ref_acc, plan.conditions.specific_force)
    r = truth.references
    base = Rotation.from_rotvec([r["rate_table.level_x"], r["rate_table.level_y"], 0.0])
    body = Rotation.from_rotvec([r[f"rate_table.mounting_{axis}_1"] for axis in "xyz"])
    row = next(i for i, a in enumerate(plan.asked) if not any("rate" in key for key in a.motion))
    motion = plan.asked[row].motion
    table_turns = Rotation.from_euler(
        "z", -motion.get("position_1_deg", 0.0), degrees=True
    ) * Rotation.from_euler("y", -motion.get("position_2_deg", 0.0), degrees=True)
    np.testing.assert_allclose(table.acc[row], (body * table_turns * base).apply([0, 0, G]), atol=1e-11)
    earth = EARTH_RATE_RADPS * np.array([np.cos(DEFAULT_LATITUDE), 0.0, np.sin(DEFAULT_LATITUDE)])
    np.testing.assert_allclose(table.gyro[row], (body * table_turns * base).apply(earth), atol=1e-15)


def test_the_rate_error_is_a_common_scale_factor_of_what_is_driven() -> None:
    unit, plan = with_accuracy(BenchAccuracy.model_validate({"rate": "100 ppm"}))
    table, truth = simulate(plan, replace(unit, budgets={}, families={}), 3, settings=noiseless())
    assert set(truth.references) == {"rate_table.rate"}
    fast = np.linalg.norm(table.ref_rate, axis=1) > 1.0
    assert fast.any()
    off = np.linalg.norm(table.gyro[fast], axis=1) / np.linalg.norm(table.ref_rate[fast], axis=1) - 1.0
    # the Earth's share of 1 rad/s is 7e-5, and that is not off
    np.testing.assert_allclose(off, truth.references["rate_table.rate"], rtol=2e-4)
    np.testing.assert_array_equal(table.acc, table.ref_acc)


def test_a_thermometer_that_is_off_shifts_the_true_temperature_and_not_the_shown() -> None:
    unit, plan = with_accuracy(BenchAccuracy.model_validate({"temperature": "5 K"}))
    perfect = replace(unit, accuracies={})
    (off, truth), (right, _) = (simulate(plan, u, 3, settings=noiseless()) for u in (unit, perfect))
    assert np.array_equal(off.temperature_degc, right.temperature_degc)
    true = float(off.temperature_degc[0]) + truth.references["rate_table.temperature"]
    first = truth.at("gyro.bias", "x", true) - truth.at("gyro.bias", "x", float(off.temperature_degc[0]))
    still = int(np.argmin(np.linalg.norm(off.ref_rate, axis=1)))
    # at rest the scale factor and the misalignment over temperature work on the Earth's rate only
    assert off.gyro[still, 0] - right.gyro[still, 0] == pytest.approx(first, rel=1e-2)


def test_draws_have_the_stated_spread_and_change_with_every_installation_and_seed() -> None:
    _, plan = with_accuracy()
    half = len(plan) // 2
    twice = replace(plan, installation=np.where(np.arange(len(plan)) < half, 1, 2))
    drawn = [drawn_references(twice, {"rate_table": ACCURACY}, seed).by_name for seed in range(2000)]
    spread = {name: np.std([one[name] for one in drawn]) for name in drawn[0]}
    assert len(spread) == 2 + 1 + 1 + 2 * 3
    for name, sigma in spread.items():  # 2000 draws: 1.6 % each; 4.5 of them
        quantity = name.split(".")[1].split("_")[0]
        assert sigma == pytest.approx(getattr(ACCURACY, quantity), rel=0.07), name
    mounted = np.array(
        [[one[f"rate_table.mounting_{a}_{k}"] for a in "xyz" for k in (1, 2)] for one in drawn]
    )
    np.testing.assert_allclose(np.corrcoef(mounted.T), np.eye(6), atol=0.1)  # 4.5 of 2.2 %


def test_references_are_drawn_with_keys_of_their_own_and_can_be_switched_off() -> None:
    unit, plan = with_accuracy()
    perfect, _ = simulate(plan, replace(unit, accuracies={}), 5)
    off, truth = simulate(plan, unit, 5, settings=Settings(references=False))
    assert off.gyro.tobytes() == perfect.gyro.tobytes()
    assert truth.references == {}
    drawn, truth = simulate(plan, unit, 5)
    # 0.1 K, 20 ppm and 0.02 deg of 700 deg/s and 1 g: the same unit, a little elsewhere
    assert 0.0 < np.abs(drawn.gyro - perfect.gyro).max() < 0.05
    assert set(truth.references) == set(json.loads(truth_text(truth))["references_si"])
    keeps(json.loads(truth_text(truth)), "truth")
    assert "references_si" not in truth_text(replace(truth, references={}))
