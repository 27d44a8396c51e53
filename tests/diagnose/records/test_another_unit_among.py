"""Another unit in power-ons here and there, told by the leans of its accelerometers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.records.another_unit import another_unit
from planner.diagnose.records.another_unit_at_rest import another_at_rest
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import G, Hall, Noise, read
from tests.diagnose.records.test_another_unit_for_a_while import every, of, rests


def _pairs(hall: Hall) -> np.ndarray:
    """(n,) rows of every other pair of power-ons; the turns of run 0 are the first unit's."""
    return (hall.run // 2) % 2 == 1


def _mixed(hall: Hall, seed: int, there: np.ndarray) -> DwellTable:
    return of(hall, seed, np.unique(hall.run[there]).tolist())


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.further("seed", [4, 5, 6])
def test_two_units_in_turn(seed: int) -> None:
    """Mountings, hystereses and unknowns of every channel were said of them."""
    hall = rests(seed)
    there = _pairs(hall)
    table = _mixed(hall, seed, there)
    found = another_unit(table, every(table))
    assert found is not None
    assert found.suspect.hypothesis == "mixed_units"
    fewer = there if 2 * there.sum() <= len(there) else ~there
    np.testing.assert_array_equal(found.kept, ~fewer)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.further("seed", [4, 5, 6])
def test_what_is_no_other_unit(seed: int) -> None:
    """A fixture that is used now and then turns all channels alike; leans of every power-on are no groups."""
    hall, rng = rests(seed), np.random.default_rng([seed, 12])
    there = _pairs(hall)[:, None]
    turned = hall.up + np.where(there, np.cross(np.radians([0.2, -0.3, 0.15]), hall.up), 0.0)
    drawn = np.radians(0.1) * rng.normal(size=(hall.run.max() + 1, 3))[hall.run]
    plain = read(hall, seed)
    for table in (
        plain,
        read(hall, seed, felt=replace(hall, up=turned)),
        read(hall, seed, felt=replace(hall, up=hall.up + np.cross(drawn, hall.up))),
        read(hall, seed, acc=Noise(2e-5, 6e-4, 0.0)),
    ):
        assert another_unit(table, every(table)) is None


def _last(leans: bool, first: int) -> tuple[float, int] | None:
    """What rests at five temperatures from cold to hot say of another unit, or of leans over temperature."""
    rng = np.random.default_rng([3, first])
    run = np.repeat(np.arange(10), 6)
    u = np.tile(np.vstack([np.eye(3), -np.eye(3)]), (10, 1)) * G
    degc = np.linspace(-40.0, 50.0, 10)[run]
    one, two = (rng.normal(0.0, 3e-3, (3, 3)) * (1.0 - np.eye(3)) for _ in range(2))
    way = ((degc + 40.0) / 90.0) ** 2 if leans else (run >= first).astype(float)
    y = u @ (np.eye(3) + one).T + way[:, None] * (u @ two.T) + 1e-4 * rng.normal(size=u.shape)
    north = np.roll(u, 1, axis=1) / G
    return another_at_rest(y, u, run, north, degc)


@pytest.mark.parametrize("first", [4, 5, 6])
def test_leans_that_go_with_the_temperature_are_no_other_unit(first: int) -> None:
    """Of a campaign from cold to hot three dozen good rows were left out as another unit's."""
    assert _last(True, first) is None
    found = _last(False, first)
    assert found is not None
    assert found[1] == first - 1


@pytest.mark.parametrize("seed", range(4))
def test_few_power_ons_scatter_as_three_channels_say(seed: int) -> None:
    """Of five power-ons one channel by itself knows its scatter to a third; nothing was said of two units."""
    rng = np.random.default_rng([seed, 77])
    run = np.repeat(np.arange(5), 6)
    u = np.tile(np.vstack([np.eye(3), -np.eye(3)]), (5, 1)) * G
    one, two = (rng.normal(0.0, 3e-3, (3, 3)) * (1.0 - np.eye(3)) for _ in range(2))
    y = u @ (np.eye(3) + one).T + np.where(run >= 2, 1.0, 0.0)[:, None] * (u @ two.T)
    asked = u, run, np.roll(u, 1, axis=1) / G, np.full(len(run), 20.0)
    noise = 3e-4 * rng.normal(size=u.shape)
    found = another_at_rest(y + noise, *asked)
    assert found is not None
    assert found[1] == 1
    assert another_at_rest(u @ (np.eye(3) + one).T + noise, *asked) is None
