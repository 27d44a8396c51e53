"""A gain that becomes another one in mid-campaign: of the read-out, of the table, of gravity at a site."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.records import other_from_run_on as asked
from planner.protocols import Sensor
from tests.diagnose.hall import Noise, axes_apart, days, hidden, read
from tests.specs import shipped

SPEC = shipped("small_uav").spec
FIRST = 12


@pytest.mark.parametrize("what", ["mixed_units", "table_rate"])
@pytest.mark.further("what", ["local_gravity"])
@pytest.mark.parametrize("seed", [131])
@pytest.mark.further("seed", [132, 133, 134])
def test_it_is_named_with_its_size(seed: int, what: str) -> None:
    """Silent where the noise had it as a spread of scale factors, or curves over days and rates."""
    hall = days(seed, 20)
    by = 1.0 + 1e-3 * (hall.run >= FIRST)[:, None]
    table = read(hall, seed)
    assert table.gyro is not None
    assert table.acc is not None
    if what == "mixed_units":
        table = replace(table, gyro=table.gyro * by, acc=table.acc * by)
    elif what == "table_rate":
        table = read(hall, seed, felt=replace(hall, turn=hall.turn * by))
    else:
        table = read(hall, seed, felt=replace(hall, up=hall.up * by))
    found = diagnose(table, SPEC)
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == what
    assert f"from run {FIRST} on" in suspect.check
    assert abs(suspect.value - 1e-3) < 5e-5
    assert not found.effects
    assert not found.unknown


@pytest.mark.parametrize("seed", [135])
@pytest.mark.further("seed", [136, 137, 138])
def test_scale_factors_that_every_power_on_draws_are_no_gain(seed: int) -> None:
    hall = days(seed, 20)
    drawn = read(hall, seed, gyro=Noise(4e-4, 1e-3, scale=3e-5), acc=Noise(5e-5, 6e-4, scale=3e-5))
    assert not diagnose(drawn, SPEC).reference_suspects


@pytest.mark.parametrize("seed", [139])
@pytest.mark.further("seed", [140])
def test_one_gyro_whose_scale_factor_steps_is_that_gyro(seed: int) -> None:
    hall = days(seed, 20)
    step = 1e-3 * (hall.run >= FIRST) * np.asarray(hall.rate)[:, 2]
    assert not diagnose(hidden(read(hall, seed), "gyro", 2, step), SPEC).reference_suspects


@pytest.mark.parametrize("seed", [141])
@pytest.mark.further("seed", [142, 143, 144, 145])
def test_a_table_that_turns_faster_is_no_other_unit(seed: int) -> None:
    """Leans of quick turns grow by that share too: the rows from there on were said to be another unit's."""
    hall = axes_apart(seed, 5, turns=(-400.0, -150.0, 150.0, 400.0))
    first = int(hall.run.max()) // 2 + 2
    felt = replace(hall, turn=hall.turn * (1.0 + 3e-3 * (hall.run >= first)[:, None]))
    found = diagnose(read(hall, seed, gyro=Noise(1e-4, 1e-3), felt=felt), SPEC)
    assert not found.effects
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == "table_rate"
    assert abs(suspect.value - 3e-3) < 3e-4


@pytest.mark.parametrize("told", [True, False])
def test_a_read_out_is_said_by_both_sensors(told: bool) -> None:
    """A step of the table was put right in accelerometers that had no say; gravity was then off by it."""
    there = np.array([told])

    def sums(sensor: Sensor, heard: float) -> asked._Sums:
        """1e-3 ± 1e-4 of a channel that is heard."""
        return asked._Sums(sensor, "x", np.full((1, 1, 1), 1e8 * heard), np.full((1, 1), 1e5 * heard), there)

    both = [*(3 * [sums("gyro", 1.0)]), *(3 * [sums("accelerometer", float(told))])]
    assert asked._says("gyro", both, 0, 1.0)
    assert asked._says("accelerometer", both, 0, 1.0) == told
