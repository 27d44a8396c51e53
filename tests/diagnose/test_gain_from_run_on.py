"""A gain that becomes another one in mid-campaign: of the read-out, of the table, of gravity at a site."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from tests.diagnose.hypotheses.hall import Noise, days, hidden, read
from tests.specs import shipped

SPEC = shipped("small_uav").spec
FIRST = 12


@pytest.mark.parametrize("what", ["mixed_units", "table_rate", "local_gravity"])
@pytest.mark.parametrize("seed", [131, 132])
@pytest.mark.further("seed", [133, 134])
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


@pytest.mark.parametrize("seed", [135, 136])
@pytest.mark.further("seed", [137, 138])
def test_scale_factors_that_every_power_on_draws_are_no_gain(seed: int) -> None:
    hall = days(seed, 20)
    drawn = read(hall, seed, gyro=Noise(4e-4, 1e-3, scale=3e-5), acc=Noise(5e-5, 6e-4, scale=3e-5))
    assert not diagnose(drawn, SPEC).reference_suspects


@pytest.mark.parametrize("seed", [139, 140])
def test_one_gyro_whose_scale_factor_steps_is_that_gyro(seed: int) -> None:
    hall = days(seed, 20)
    step = 1e-3 * (hall.run >= FIRST) * np.asarray(hall.rate)[:, 2]
    assert not diagnose(hidden(read(hall, seed), "gyro", 2, step), SPEC).reference_suspects
