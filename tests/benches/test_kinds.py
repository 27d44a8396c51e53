"""Kinds of bench: what they can show, and motions that show it."""

from __future__ import annotations

import numpy as np
import pytest

from planner.catalog import benches, effects
from planner.protocols import BenchKind

KINDS = sorted(benches())
every_kind = pytest.mark.parametrize("kind", KINDS)
KEYS = {"position_1_deg", "position_2_deg", "rate_1_dps", "rate_2_dps", "acceleration_g"}


def up(motion: dict[str, float]) -> np.ndarray:
    """The body direction that points up: axis 1 is body z, axis 2 is body y at zero."""
    p1, p2 = np.radians(motion["position_1_deg"]), np.radians(motion["position_2_deg"])
    z = np.array([[np.cos(p1), -np.sin(p1), 0], [np.sin(p1), np.cos(p1), 0], [0, 0, 1]])
    y = np.array([[np.cos(p2), 0, np.sin(p2)], [0, 1, 0], [-np.sin(p2), 0, np.cos(p2)]])
    return (y @ z).T @ [0, 0, 1]


def spin(motion: dict[str, float]) -> np.ndarray:
    """The body rate of a motion in deg/s."""
    p1 = np.radians(motion.get("position_1_deg", 0.0))
    about_2 = np.array([np.sin(p1), np.cos(p1), 0])
    return motion.get("rate_1_dps", 0.0) * np.array([0, 0, 1]) + motion.get("rate_2_dps", 0.0) * about_2


def test_the_kinds_are_all_there() -> None:
    assert set(KINDS) >= {"rate_table", "centrifuge"}


@every_kind
def test_offers_itself_as_the_protocol_says(kind: str) -> None:
    assert isinstance(benches()[kind], BenchKind)
    assert benches()[kind].name == kind
    assert benches()[kind].excites <= {"rate", "gravity", "acceleration", "temperature"}


@every_kind
@pytest.mark.parametrize("axes", [1, 2, 3])
@pytest.mark.parametrize("count", [1, 2, 3, 5, 6, 7, 12, 26, 30, 100])
def test_gives_as_many_motions_as_asked_for_and_the_same_again(kind: str, axes: int, count: int) -> None:
    bench = benches()[kind]
    motions = bench.motions(count, axes)
    assert len(motions) == count
    assert motions == bench.motions(count, axes)
    assert all(motion and set(motion) <= KEYS for motion in motions)
    assert all(np.isfinite(list(motion.values())).all() for motion in motions)


def test_one_motion_of_a_table_is_a_rest_at_zero() -> None:
    assert benches()["rate_table"].motions(1, 2) == ({"position_1_deg": 0.0, "position_2_deg": 0.0},)
    assert benches()["rate_table"].motions(1, 1) == ({"position_1_deg": 0.0},)


@pytest.mark.parametrize("kind", ["rate_table", "levelled_plate"])
def test_six_rests_are_the_faces_of_a_cube(kind: str) -> None:
    faces = {tuple(up(motion).round(6) + 0.0) for motion in benches()[kind].motions(6, 2)}
    assert faces == {(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)}


def test_further_rests_are_edges_and_corners_all_different() -> None:
    rests = benches()["rate_table"].motions(26, 2, calibrates=("accelerometer.scale_factor",))
    found = np.array([up(motion) for motion in rests])
    assert len({tuple(direction.round(6)) for direction in found}) == 26
    np.testing.assert_allclose(found.sum(axis=0), 0, atol=1e-6)  # for every direction its opposite


def test_thirty_turns_are_three_axes_two_directions_five_rates() -> None:
    spins = np.array([spin(motion) for motion in benches()["rate_table"].motions(30, 2)]).round(6)
    for axis in range(3):
        along = spins[np.abs(spins[:, axis]) > 1]
        assert len(along) == 10
        assert np.abs(np.delete(along, axis, axis=1)).max() < 1e-3
        np.testing.assert_array_equal(np.unique(along[:, axis]), np.unique(-along[:, axis]))
        assert len(np.unique(np.abs(along[:, axis]))) == 5


@pytest.mark.parametrize("limit", [5.0, 60.0, 100.0, 2000.0])
def test_no_turn_is_faster_than_the_table(limit: float) -> None:
    motions = benches()["rate_table"].motions(30, 2, rate_limit_dps=limit)
    rates = [abs(value) for motion in motions for key, value in motion.items() if key.startswith("rate")]
    assert len(rates) == 30
    assert max(rates) <= limit


@pytest.mark.parametrize("axes", [1, 2])
def test_no_load_is_more_than_the_centrifuge_can_give(axes: int) -> None:
    motions = benches()["centrifuge"].motions(12, axes, load_limit_g=50.0)
    loads = [motion["acceleration_g"] for motion in motions]
    assert max(map(abs, loads)) == 50.0
    if axes == 1:
        assert sum(loads) == 0.0  # each load in both directions


@pytest.mark.parametrize("count", [6, 20, 24, 30])
def test_on_an_arm_of_one_axis_every_mounting_has_loads_both_ways(count: int) -> None:
    """As many loads as possible in each third of the motions, after which the unit is remounted."""
    loads = np.array([m["acceleration_g"] for m in benches()["centrifuge"].motions(count, 1)])
    third = np.array([3 * k // count for k in range(count)])
    assert len(loads) == count
    for mounting in range(3):
        own = loads[third == mounting]
        assert own.max() > 0 > own.min()
        assert len(set(np.abs(own))) == min(8, -(-len(own) // 2))


def test_what_a_test_calibrates_chooses_between_turns_and_rests() -> None:
    table = benches()["rate_table"]
    turns = table.motions(6, 2, calibrates=("gyro.scale_factor", "gyro.misalignment"))
    assert all(np.abs(spin(motion)).max() > 1 for motion in turns)
    rests = table.motions(30, 2, calibrates=("accelerometer.scale_factor",))
    assert all(np.abs(spin(motion)).max() == 0 for motion in rests)


# ---------------------------------------------------------------- what a bench can show


@every_kind
def test_observes_only_errors_that_exist(kind: str) -> None:
    errors = {f"{sensor}.{effect.name}" for effect in effects().values() for sensor in effect.sensors}
    assert benches()[kind].observes <= errors
    assert {"gyro.bias", "accelerometer.bias"} <= benches()[kind].observes


@pytest.mark.parametrize(
    ("error", "kinds"),
    [
        ("gyro.scale_factor", {"rate_table", "centrifuge"}),
        ("gyro.misalignment", {"rate_table", "centrifuge"}),
        ("gyro.scale_factor_nonlinearity", {"rate_table", "centrifuge"}),
        ("gyro.scale_factor_acceleration", {"centrifuge"}),  # 1 g everywhere: a scale factor like any other
        ("gyro.g_sensitivity", {"rate_table", "centrifuge", "levelled_plate"}),
        ("gyro.g_squared_sensitivity", {"centrifuge"}),
        ("accelerometer.scale_factor", {"rate_table", "centrifuge", "levelled_plate"}),
        ("accelerometer.misalignment", {"rate_table", "centrifuge", "levelled_plate"}),
        ("accelerometer.scale_factor_nonlinearity", {"centrifuge"}),
        ("gyro.bias_temperature", {"rate_table", "centrifuge", "levelled_plate"}),
        ("accelerometer.warm_up", {"rate_table", "centrifuge", "levelled_plate"}),
    ],
)
def test_each_error_is_seen_where_its_cause_is_excited(error: str, kinds: set[str]) -> None:
    assert {kind for kind in KINDS if error in benches()[kind].observes} == kinds


def test_without_a_chamber_temperature_stays_unseen() -> None:
    from planner.benches._excitation import Observable

    cold = Observable(frozenset({"rate", "gravity"}))
    assert not {error for error in cold if "temperature" in error}
    assert cold < benches()["rate_table"].observes
