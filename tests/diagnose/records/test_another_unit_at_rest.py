"""Another unit that comes with the last tumbles of a campaign is told from one that was mounted anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.records.another_unit import another_unit
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import G, Hall, Noise, axes_apart, read


def _tumbles_at_the_end(seed: int, count: int = 3, visits: int = 2) -> Hall:
    """Rests and turns at three temperatures, and `count` power-ons of rests behind them."""
    hall = axes_apart(seed, visits)
    rests = [run for run in np.unique(hall.run) if not hall.turns[hall.run == run].any()][:count]
    rows = np.concatenate([np.arange(len(hall.run)), *(np.flatnonzero(hall.run == run) for run in rests)])
    new = np.concatenate(
        [hall.run, *(np.full(np.sum(hall.run == run), hall.run.max() + 1 + k) for k, run in enumerate(rests))]
    )
    later = np.append(np.zeros(len(hall.run)), np.ones(len(rows) - len(hall.run)))
    names = ("time_on", "temperature", "ramp", "up", "north", "turn")
    return Hall(run=new, day=hall.day[rows] + 5.0 * later, **{k: getattr(hall, k)[rows] for k in names})


def _from(hall: Hall, seed: int, first: int) -> DwellTable:
    one, other = read(hall, seed), read(hall, seed + 1000)
    later = (hall.run >= first)[:, None]
    assert one.gyro is not None
    assert one.acc is not None
    assert other.gyro is not None
    assert other.acc is not None
    return replace(one, gyro=np.where(later, other.gyro, one.gyro), acc=np.where(later, other.acc, one.acc))


def _every(table: DwellTable) -> np.ndarray:
    return np.ones(len(table), dtype=bool)


@pytest.mark.parametrize("seed", [61, 62, 63, 64])
def test_another_unit_in_the_last_tumbles(seed: int) -> None:
    """Loads, faces and days of the accelerometers were blamed for it."""
    hall = _tumbles_at_the_end(seed)
    first = int(hall.run.max()) - 1
    table = _from(hall, seed, first)
    found = another_unit(table, _every(table))
    assert found is not None
    assert found.suspect.hypothesis == "mixed_units"
    assert found.suspect.value == first


@pytest.mark.parametrize("seed", [61, 62, 63, 64])
def test_a_unit_that_stays_or_is_mounted_anew(seed: int) -> None:
    """A mounting of the last power-ons turns all channels alike, and a tilt of the base leans them alike."""
    hall = _tumbles_at_the_end(seed)
    assert another_unit(read(hall, seed), _every(read(hall, seed))) is None
    later = (hall.run >= hall.run.max() - 1)[:, None]
    turned = hall.up + np.where(later, np.cross(np.radians([0.2, -0.3, 0.15]), hall.up), 0.0)
    leaned = hall.up + np.where(later, np.radians(0.3) * hall.north, 0.0)
    for up in (turned, leaned):
        table = read(hall, seed, felt=replace(hall, up=up))
        assert table.acc is not None
        assert np.ptp(table.acc) > G
        assert another_unit(table, _every(table)) is None


def _ramp_at_the_end(seed: int) -> Hall:
    """Rests and turns at three temperatures, and four faces behind them on a ramp of 3 K/min."""
    hall = _tumbles_at_the_end(seed, 1, 4)
    last = hall.run == hall.run.max()
    heated = hall.temperature + np.where(last, 3.0 / 60.0 * (hall.time_on - hall.time_on[last].min()), 0.0)
    kept = ~last | (np.cumsum(last) <= 4)
    hall = replace(hall, temperature=heated, ramp=np.where(last, 3.0, 0.0))
    return Hall(**{name: value[kept] for name, value in vars(hall).items()})


@pytest.mark.parametrize("seed", [61, 63, 68, 69, 79, 80])
def test_a_bias_that_moves_on_a_last_ramp_is_no_lean(seed: int) -> None:
    """Another unit was said to begin with the ramp, and every record behind it was left out."""
    table = read(_ramp_at_the_end(seed), seed, acc=Noise(2e-5, 6e-4, 0.0))
    assert another_unit(table, _every(table)) is None
