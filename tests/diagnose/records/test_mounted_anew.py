"""A unit that is mounted anew, or upside down, is the same unit: its angles or its labels are told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.records.another_unit import another_unit
from planner.diagnose.records.not_as_said import screened
from planner.dwells.mix_ups import mix_ups
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import Hall, days, read
from tests.specs import shipped

SPEC = shipped("small_uav").spec
ANGLES = np.radians([-0.06, -0.02, 0.06])
OVER = np.array([1.0, -1.0, -1.0])  # half a turn about x


def _turned(hall: Hall, later: np.ndarray, own: np.ndarray) -> Hall:
    """The hall with every vector of some rows put through a small rotation and factors of the axes."""

    def there(v: np.ndarray) -> np.ndarray:
        return np.where(later[:, None], own * (v + np.cross(ANGLES * np.all(own == 1.0), v)), v)

    return replace(hall, up=there(hall.up), north=there(hall.north), turn=there(hall.turn))


def _mounted_anew(seed: int) -> DwellTable:
    hall = days(seed)
    return read(hall, seed, felt=_turned(hall, hall.run > 20, np.ones(3)))


@pytest.mark.parametrize("seed", [11])
@pytest.mark.further("seed", [12, 13, 14])
def test_a_unit_that_is_mounted_anew_is_no_other_unit(seed: int) -> None:
    """By 0.085 deg: leans and scale factors were "of another unit", and half of the rows not judged."""
    table = _mounted_anew(seed)
    assert another_unit(table, np.ones(len(table), dtype=bool)) is None
    found = diagnose(table, SPEC)
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == "mounting"
    assert suspect.low < np.degrees(np.linalg.norm(ANGLES)) < suspect.high
    assert "before run 21" in suspect.check
    assert (found.effects, found.unknown) == ((), ())


@pytest.mark.parametrize("seed", [11, 12])
def test_another_unit_is_one_all_the_same(seed: int) -> None:
    """Its leans are twelve numbers, and three angles leave three quarters of what they explain."""
    hall = days(seed)
    one, other = read(hall, seed), read(hall, seed + 50)
    later = (hall.run > 20)[:, None]
    table = replace(one, gyro=np.where(later, other.gyro, one.gyro), acc=np.where(later, other.acc, one.acc))
    found = another_unit(table, np.ones(len(table), dtype=bool))
    assert found is not None
    assert found.suspect.value == 21


def test_power_ons_upside_down_are_labels_and_no_unit_of_measurement() -> None:
    """A third of them: the readings are 0.3 times their reference by sums, and the file was refused."""
    hall = days(15)
    over = hall.run % 3 == 0
    table = read(hall, 15, felt=_turned(hall, over, OVER))
    triads = {
        "gyro": np.degrees(table.gyro), "acc": table.acc / 9.80665,
        "ref_rate": np.degrees(table.ref_rate), "ref_acc": table.ref_acc / 9.80665,
    }  # fmt: skip
    assert not list(mix_ups(triads))
    seen = screened(table)
    assert [s.hypothesis for s in seen.suspects] == ["wrong_label"]
    assert not seen.kept[over].any()  # not even where it stands along x, and half a turn changes nothing
    assert seen.kept[~over].all()
    found = diagnose(table, SPEC)
    assert (found.effects, found.unknown) == ((), ())


def test_a_sign_of_one_axis_of_the_turns_keeps_the_rests() -> None:
    """Rests that stand as they are labelled speak against a unit that is turned over."""
    hall = days(16)
    off = (hall.run % 6 == 0)[:, None] & hall.turns[:, None]
    table = read(hall, 16, felt=replace(hall, turn=np.where(off, hall.turn * OVER, hall.turn)))
    seen = screened(table)
    assert [s.hypothesis for s in seen.suspects] == ["wrong_label"]
    assert seen.kept[~hall.turns].all()
