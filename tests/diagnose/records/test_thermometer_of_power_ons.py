"""A thermometer that reads otherwise from a power-on on, or on one bench, is said; no sensor is blamed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.findings.lagging_thermometer import curves, shifted
from planner.nouns.diagnosis import ReferenceSuspect, UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import Hall, axes_apart, chamber, days, hidden, read
from tests.diagnose.labs.unit import campaign
from tests.diagnose.worlds import whole

LAYOUTS: dict[str, Callable[[int], Hall]] = {
    "days": lambda seed: days(seed, 24),
    "apart": lambda seed: axes_apart(seed, 4),
}


def _off(table: DwellTable, here: np.ndarray, by: float) -> DwellTable:
    return replace(table, temperature_degc=table.temperature_degc + np.where(here, by, 0.0))


def _thermometer(found: UnitDiagnosis, by: float) -> ReferenceSuspect:
    """The only suspect; its interval has the truth, but for one in twenty times."""
    assert not found.effects
    assert not found.unknown
    (suspect,) = found.reference_suspects
    assert (suspect.hypothesis, suspect.unit) == ("thermometer_offset", "K")
    assert abs(suspect.value - by) < suspect.high - suspect.low  # twice the half-width
    assert suspect.high - suspect.low < 0.4 * abs(by)
    assert "thermometer_offset" not in {u.effect for u in found.untestable}
    return suspect


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize(("seed", "by"), [(2, -11.0)])
@pytest.mark.further(("seed", "by"), [(1, 6.0), (3, 9.0), (4, -5.0)])
def test_from_a_power_on_on(seed: int, by: float, layout: str) -> None:
    """It was a step of a bias, a curve over days, or nothing at all, by nodes that the tables got for it."""
    hall = LAYOUTS[layout](seed)
    first = int(np.random.default_rng([seed, 77]).integers(hall.run.max() // 3, 2 * hall.run.max() // 3))
    suspect = _thermometer(whole(_off(read(hall, seed), hall.run >= first, by)), by)
    said = int(suspect.check.split("from run ")[1].split(" ")[0])
    assert abs(said - first) <= (1 if layout == "apart" else 0)  # there a power-on turns about one axis alone


@pytest.mark.parametrize(("seed", "by"), [(11, 4.0), (12, -8.0)])
@pytest.mark.further(("seed", "by"), [(13, 3.0), (14, 12.0)])
def test_on_one_bench_of_two(seed: int, by: float) -> None:
    """What varied with the bench had no name. That the other one's reads so much less is the same to them."""
    hall = axes_apart(seed, 4)
    second = np.asarray((hall.run - 1) // 4 % 2 == 1)
    table = replace(read(hall, seed), bench=np.where(second, "two", "one"))
    found = whole(_off(table, second, by))
    (one,) = found.reference_suspects
    other = "on one " in one.check
    suspect = _thermometer(found, -by if other else by)
    assert ("on one (run 1, 2, 3, 4, 9, …)" if other else "on two (run 5, 6, 7, 8, 13, …)") in suspect.check


@pytest.mark.parametrize("layout", [*LAYOUTS.values(), chamber])
@pytest.mark.parametrize("seed", [21])
@pytest.mark.further("seed", [22, 23])
def test_no_thermometer_is_doubted_where_all_is_right(seed: int, layout: Callable[[int], Hall]) -> None:
    assert not whole(read(layout(seed), seed)).reference_suspects


@pytest.mark.parametrize("seed", [31])
@pytest.mark.further("seed", [32, 33])
def test_a_campaign_of_ramps_and_loads_has_one_thermometer(seed: int) -> None:
    table, _ = campaign(seed)
    assert not whole(table).reference_suspects


@pytest.mark.parametrize("seed", [41])
@pytest.mark.further("seed", [42, 43, 44])
def test_a_step_of_one_channel_is_no_thermometer(seed: int) -> None:
    """Another temperature would move all that have curves."""
    hall = days(seed, 24)
    table = hidden(read(hall, seed), "acc", 1, np.where(hall.run >= 12, 8e-3, 0.0))
    found = whole(table)
    assert "thermometer_offset" not in {s.hypothesis for s in found.reference_suspects}
    assert {c for e in found.effects for c in e.channels} <= {"accelerometer_y"}


@pytest.mark.parametrize("seed", [52])
@pytest.mark.further("seed", [51, 53, 54])
def test_a_unit_that_stood_crooked_for_a_day_has_no_other_temperature(seed: int) -> None:
    """Two channels of it went with one temperature, by slopes as far apart as theirs."""
    hall = axes_apart(seed, 4)
    mine = np.isin(hall.run, [5, 6, 7])[:, None]
    theta = np.radians(0.2) * np.random.default_rng([seed, 78]).normal(size=3)

    def turned(v: np.ndarray) -> np.ndarray:
        return np.asarray(v + np.where(mine, np.cross(theta, v), 0.0))

    felt = replace(hall, up=turned(hall.up), turn=turned(hall.turn))
    found = whole(read(hall, seed, felt=felt))
    assert "thermometer_offset" not in {s.hypothesis for s in found.reference_suspects}


@pytest.mark.parametrize("degree", [1, 3, 7])
@pytest.mark.parametrize("ends", [(-40.0, 80.0), (24.0, 25.0)])
def test_polynomials_at_another_temperature_are_those_as_read_combined(
    degree: int, ends: tuple[float, float]
) -> None:
    degc = np.random.default_rng(degree).uniform(*ends, 50)
    offsets = np.array([-40.0, -3.3, 0.0, 12.0, 40.0])
    v, other = np.random.default_rng(7).normal(size=(2, len(degc), 1))

    def columns(at: np.ndarray) -> np.ndarray:
        return np.hstack([curves(degc, at, degree), v * curves(degc, at, degree), other])

    combined = columns(degc) @ shifted(degc, offsets, degree, 2 * (degree + 1) + 1)
    moved = np.array([columns(degc - d) for d in offsets])
    assert np.abs(combined - moved).max() <= 1e-9 * np.abs(moved).max()
