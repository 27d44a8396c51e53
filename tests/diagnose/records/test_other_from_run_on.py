"""A reference that becomes another one in mid-campaign: one finding about the bench, with run and sizes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import Hall, axes_apart, chamber, days, hidden, read
from tests.diagnose.worlds import whole

LAYOUTS: dict[str, tuple[Callable[[int], Hall], float]] = {  # with angles of which each is sure, deg
    "days": (lambda seed: days(seed, 24), 0.0008),
    "chamber": (lambda seed: chamber(seed, 8), 0.006),
    "few": (lambda seed: chamber(seed, 5), 0.01),
}


def _turned(hall: Hall, theta: Array, mine: Array) -> Hall:
    """What a unit turned by θ (3,), rad, is exposed to in some rows."""

    def of(v: Array) -> Array:
        return v + np.where(mine[:, None], np.cross(theta, v), 0.0)

    return replace(hall, up=of(hall.up), north=of(hall.north), turn=of(hall.turn))


def _anew(seed: int, layout: str) -> tuple[DwellTable, int, float]:
    """A table, the run from which on the unit sits otherwise, and by how much, deg."""
    build, size = LAYOUTS[layout]
    hall, rng = build(seed), np.random.default_rng([seed, 8])
    runs = np.unique(hall.run)
    first = int(rng.choice(runs[len(runs) // 3 : -2 if len(runs) > 6 else -1]))
    way = rng.normal(size=3)
    theta = np.radians(size) * way / np.linalg.norm(way)
    return read(hall, seed, felt=_turned(hall, theta, hall.run >= first)), first, size


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3])
def test_a_unit_mounted_anew_is_one_finding_with_run_and_angle(seed: int, layout: str) -> None:
    """It was something over days without a name on several channels, and nothing with few power-ons."""
    table, first, size = _anew(seed, layout)
    found = whole(table)
    assert not found.effects
    assert not found.unknown
    (suspect,) = found.reference_suspects
    assert (suspect.hypothesis, suspect.unit) == ("mounting", "deg")
    assert f"before run {first}:" in suspect.check
    assert abs(suspect.value - size) < suspect.high - suspect.low  # twice the 95 %
    assert suspect.high - suspect.low < size


@pytest.mark.parametrize("build", [LAYOUTS["days"][0], LAYOUTS["few"][0], axes_apart])
@pytest.mark.parametrize("seed", [11])
@pytest.mark.further("seed", [12])
def test_a_unit_that_stays_is_not_mounted_anew(seed: int, build: Callable[[int], Hall]) -> None:
    assert not whole(read(build(seed), seed)).reference_suspects


@pytest.mark.parametrize("seed", [21])
@pytest.mark.further("seed", [22, 23])
def test_gyros_that_turn_by_themselves_are_no_mounting(seed: int) -> None:
    """Gravity tells that the case stays where it was."""
    hall = days(seed, 24)
    late = hall.run >= 11
    turned = read(hall, seed, felt=_turned(hall, np.radians([0.01, -0.008, 0.006]), late))
    found = whole(replace(turned, acc=read(hall, seed).acc))
    assert all(s.hypothesis != "mounting" for s in found.reference_suspects)


@pytest.mark.parametrize("seed", [31])
@pytest.mark.further("seed", [32, 33])
def test_one_axis_that_leans_otherwise_is_no_mounting(seed: int) -> None:
    hall = days(seed, 24)
    late = hall.run >= 11
    found = whole(hidden(read(hall, seed), "gyro", 1, 2e-4 * late * hall.rate[:, 2]))
    assert all(s.hypothesis != "mounting" for s in found.reference_suspects)


# ---------------------------------------------------------------- a base that leans, a fixture that is turned


def _east(hall: Hall) -> Array:
    return np.cross(hall.north, hall.up)


def _tilted(seed: int, layout: str, only: bool) -> tuple[DwellTable, int, float]:
    """A table, the run from which on (or in which alone) the base leans, and by how much, deg."""
    build, size = LAYOUTS[layout][0], 0.02
    hall, rng = build(seed), np.random.default_rng([seed, 9])
    runs = np.unique(hall.run)
    first = int(rng.choice(runs[len(runs) // 3 : -2 if len(runs) > 6 else -1]))
    mine = ((hall.run == first) if only else (hall.run >= first)) & ~hall.turns
    way = rng.uniform(0.0, 2.0 * np.pi)
    level = np.cos(way) * hall.north + np.sin(way) * _east(hall)
    felt = replace(hall, up=hall.up + np.radians(size) * mine[:, None] * level)
    return read(hall, seed, felt=felt), first, size


@pytest.mark.parametrize(("layout", "only"), [("days", True), ("chamber", False)])
@pytest.mark.further(("layout", "only"), [("days", False)])
@pytest.mark.parametrize("seed", [41])
@pytest.mark.further("seed", [43, 44])
def test_a_base_that_leans_from_a_run_on_is_said_with_the_run(seed: int, layout: str, only: bool) -> None:
    """It was a mounting with a cross-coupling beside it, a tilt of half the size, or nothing."""
    table, first, size = _tilted(seed, layout, only)
    found = whole(table)
    assert not found.effects
    assert not found.unknown
    (suspect,) = found.reference_suspects
    assert (suspect.hypothesis, suspect.unit) == ("base_tilt", "deg")
    assert (f"in run {first} alone" if only else f"from run {first} on") in suspect.check
    assert abs(suspect.value - size) < suspect.high - suspect.low  # twice the 95 %
    assert suspect.high - suspect.low < size


@pytest.mark.parametrize("seed", [51])
@pytest.mark.further("seed", [52, 53])
def test_a_base_that_leans_throughout_has_no_run_at_which_it_began(seed: int) -> None:
    hall = days(seed, 24)
    felt = replace(hall, up=hall.up + np.radians(0.02) * ~hall.turns[:, None] * hall.north)
    (suspect,) = whole(read(hall, seed, felt=felt)).reference_suspects
    assert suspect.hypothesis == "base_tilt"
    assert "run" not in suspect.check


@pytest.mark.parametrize("only", [True])
@pytest.mark.further("only", [False])
@pytest.mark.parametrize("seed", [61])
@pytest.mark.further("seed", [62, 63])
def test_a_fixture_that_is_turned_is_an_azimuth_with_the_run(seed: int, only: bool) -> None:
    """Nothing was missing, though north was east in all rests of a power-on."""
    hall = days(seed, 24)
    mine = (hall.run == 15) if only else (hall.run >= 15)
    felt = replace(hall, north=np.where(mine[:, None], _east(hall), hall.north))
    found = whole(read(hall, seed, felt=felt))
    assert not found.effects
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == "azimuth"
    assert ("in run 15 alone" if only else "from run 15 on") in suspect.check
    assert abs(suspect.value - np.sqrt(2.0)) < suspect.high - suspect.low


@pytest.mark.parametrize("seed", [3])
@pytest.mark.further("seed", [4, 1, 2, 5])
def test_a_tilt_is_sized_by_the_noise_of_rows(seed: int) -> None:
    """In noise that the tilt had made it was known to a twentieth; the rest was products of loads."""
    hall, rng = axes_apart(seed), np.random.default_rng([seed, 71])
    about = rng.uniform(0.0, 2.0 * np.pi, len(hall.run))[:, None]
    north = np.cos(about) * hall.north + np.sin(about) * np.cross(hall.up, hall.north)
    hall = replace(hall, north=north)
    east, later = np.cross(north, hall.up), ((hall.run >= 13) & ~hall.turns)[:, None]
    size, way = np.radians(0.2), rng.uniform(0.0, 2.0 * np.pi)
    up = hall.up + later * size * (np.cos(way) * north + np.sin(way) * east)
    found = whole(read(hall, seed, felt=replace(hall, up=up)))
    assert not found.effects
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == "base_tilt"
    assert suspect.value == pytest.approx(0.2, rel=0.005)


@pytest.mark.parametrize("layout", ["days", "few"])
@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3, 4])
def test_a_base_that_settles_from_day_to_day(seed: int, layout: str) -> None:
    """It leaned from mid-campaign on, by two thirds, with budgets exceeded or a sensor blamed."""
    hall, rng = LAYOUTS[layout][0](seed), np.random.default_rng([seed, 72])
    about = rng.uniform(0.0, 2.0 * np.pi, len(hall.run))[:, None]
    hall = replace(hall, north=np.cos(about) * hall.north + np.sin(about) * np.cross(hall.up, hall.north))
    since = hall.day - hall.day.min()
    share, way = ~hall.turns * since / since.max(), rng.uniform(0.0, 2.0 * np.pi)
    lean = np.cos(way) * hall.north + np.sin(way) * np.cross(hall.north, hall.up)
    up = hall.up + np.radians(0.15) * share[:, None] * lean
    found = whole(read(hall, seed, felt=replace(hall, up=up)))
    assert not found.effects
    assert not found.unknown
    assert not found.budget_exceeded
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == "base_tilt"
    assert suspect.value == pytest.approx(0.15, rel=0.03)
    assert "settles" in suspect.check
