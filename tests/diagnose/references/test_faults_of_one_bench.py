"""What is wrong with a bench is wrong with its records and no others; it is named, and no sensor blamed.

Campaigns of plain NumPy. A base that leaned under one of two benches was told by a quarter of its size, and
the rest as a cross-coupling of 27 sigma; faces of a fixture and cogs of a table became curves of sensors.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import catalog
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.effects._bench_frame import load
from planner.nouns.diagnosis import ReferenceSuspect, UnitDiagnosis
from tests.diagnose.hall import EARTH, LATITUDE, Hall, axes_apart, days, hidden, read
from tests.diagnose.labs.unit import campaign
from tests.specs import shipped

SPEC = shipped("small_uav").spec


def _turned(v: np.ndarray, angles: np.ndarray) -> np.ndarray:
    return np.asarray(v + np.cross(angles, v))


def _tilted(hall: Hall, here: np.ndarray, tilt: float) -> Hall:
    lean = np.radians(tilt) * (0.8 * hall.north + 0.6 * np.cross(hall.north, hall.up))
    return replace(hall, up=hall.up + np.where((here & ~hall.turns)[:, None], lean, 0.0))


def _blamed(found: UnitDiagnosis) -> list[str]:
    return [e.effect for e in found.effects if not catalog.effects()[e.effect].bench_only]


def _suspect(found: UnitDiagnosis, hypothesis: str) -> ReferenceSuspect:
    """The only one, of a unit whose sensors are not blamed."""
    assert not _blamed(found)
    assert not found.unknown
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == hypothesis
    return suspect


@pytest.mark.parametrize("column", [True, False])
@pytest.mark.parametrize("seed", [81])
@pytest.mark.further("seed", [82, 83, 84])
def test_a_base_leans_under_one_bench_of_two(seed: int, column: bool) -> None:
    """By the column `bench`; without it by what power-ons with turns and those without have."""
    hall = axes_apart(seed, 3)
    turns = np.isin(hall.run, hall.run[hall.turns])
    second = np.zeros(len(turns), dtype=bool) if column else ~turns
    if column:  # every other visit to a temperature is on the second bench, turns and all
        second = np.asarray((hall.run - 1) // 4 % 2 == 1)
    table = read(hall, seed, felt=_tilted(hall, second, 0.2))
    if column:
        table = replace(table, bench=np.where(second, "two", "one"))
    suspect = _suspect(diagnose(table, SPEC), "base_tilt")
    assert abs(suspect.value - 0.2) < 0.02
    first = np.unique(hall.run[second & ~hall.turns])[0]
    assert not column or f"it is the bench of run {first}, " in suspect.check  # else these are all rests


@pytest.mark.parametrize("share", [1.2e-3, -6e-4])
@pytest.mark.parametrize("seed", [85])
@pytest.mark.further("seed", [86, 87])
def test_gravity_is_another_one_on_one_bench_of_two(seed: int, share: float) -> None:
    """Scale factors were said to scatter from power-on to power-on beyond their budget, and no more."""
    hall = axes_apart(seed, 4)
    second = np.asarray((hall.run - 1) // 4 % 2 == 1)
    felt = replace(hall, up=hall.up * (1.0 + share * second[:, None]))
    table = replace(read(hall, seed, felt=felt), bench=np.where(second, "two", "one"))
    suspect = _suspect(diagnose(table, SPEC), "local_gravity")
    one = "it is the bench of run 5, " in suspect.check  # the one is heavier by what the other is lighter
    assert abs(suspect.value - (share if one else -share)) < 0.1 * abs(share)


@pytest.mark.parametrize("share", [1.5e-3, -5e-4])
@pytest.mark.parametrize("seed", [88])
@pytest.mark.further("seed", [89, 90])
def test_one_table_of_two_turns_faster(seed: int, share: float) -> None:
    hall = axes_apart(seed, 4)
    second = np.asarray((hall.run - 1) // 4 % 2 == 1)
    felt = replace(hall, turn=hall.turn * (1.0 + share * second[:, None]))
    table = replace(read(hall, seed, felt=felt), bench=np.where(second, "two", "one"))
    suspect = _suspect(diagnose(table, SPEC), "table_rate")
    one = "it is the bench of run 6, " in suspect.check
    assert abs(suspect.value - (share if one else -share)) < 0.1 * abs(share)


@pytest.mark.parametrize("seed", [91])
@pytest.mark.further("seed", [92, 93, 94, 95])
def test_faces_of_a_fixture_that_lean_by_angles_of_their_own(seed: int) -> None:
    hall = days(seed, 20)
    rng = np.random.default_rng([seed, 50])
    angles = np.radians(0.05) * rng.normal(size=(6, 3))
    axis = np.argmax(np.abs(hall.up), axis=1)
    face = 2 * axis + (hall.up[np.arange(len(axis)), axis] < 0)
    up = np.where(hall.turns[:, None], hall.up, _turned(hall.up, angles[face]))
    _suspect(diagnose(read(hall, seed, felt=replace(hall, up=up)), SPEC), "mounting")


@pytest.mark.parametrize("seed", [101])
@pytest.mark.further("seed", [102, 103, 104])
def test_a_product_of_forces_on_one_accelerometer_is_no_fixture(seed: int) -> None:
    """It is seen on that one alone, though the angles of faces would explain it there."""
    hall = days(seed, 20)
    up = hall.up * ~hall.turns[:, None]
    found = diagnose(hidden(read(hall, seed), "acc", 1, 2e-3 * up[:, 0] ** 2), SPEC)
    assert not found.reference_suspects
    channels = [c for e in found.effects for c in e.channels] + [c for u in found.unknown for c in u.channels]
    assert set(channels) == {"accelerometer_y"}


@pytest.mark.parametrize("seed", [111])
@pytest.mark.further("seed", [112, 113, 114])
def test_the_cogs_of_a_table(seed: int) -> None:
    """The angle of every turn is off by what the encoder is at its end, the same of all three gyros."""
    hall = days(seed, 20)
    rate = np.where(hall.turns, np.sum(hall.turn, axis=1), 0.0)
    share = np.where(hall.turns, 0.02 * np.sin(np.radians(rate * 31.7) + 0.7), 0.0) / np.where(
        hall.turns, rate, 1.0
    )
    found = diagnose(read(hall, seed, felt=replace(hall, turn=hall.turn * (1.0 + share[:, None]))), SPEC)
    _suspect(found, "table_rate")


@pytest.mark.parametrize("seed", [121])
@pytest.mark.further("seed", [122, 123, 124])
def test_the_earths_rate_is_left_out_of_turns_alone(seed: int) -> None:
    hall = days(seed, 20)
    table = read(hall, seed)
    rate = np.where(hall.turns[:, None], np.radians(hall.turn), np.radians(hall.rate))
    suspect = _suspect(diagnose(replace(table, ref_rate=rate), SPEC), "earth_rate")
    vertical = np.degrees(EARTH) * 3600.0 * np.sin(LATITUDE)
    assert suspect.low < vertical < suspect.high


@pytest.mark.parametrize("seed", [93050])
@pytest.mark.further("seed", [93051, 93052, 93053])
def test_a_centrifuge_whose_rate_is_rounded(seed: int) -> None:
    """To a fifth of a deg/s, by its counter: curves over the load of all accelerometers were claimed."""
    table, _ = campaign(seed)
    conditions = table.conditions()
    arm = load(conditions).any(axis=1)
    rate: np.ndarray = np.degrees(np.linalg.norm(conditions.rate, axis=1))
    share = np.where(arm, np.round(rate / 0.2) * 0.2 / np.maximum(rate, 1e-9) - 1.0, 0.0)[:, None]
    table = replace(
        table,
        ref_rate=conditions.rate * (1.0 + share),
        ref_acc=conditions.specific_force + load(conditions) * ((1.0 + share) ** 2 - 1.0),
    )
    _suspect(diagnose(table, SPEC), "table_rate")
