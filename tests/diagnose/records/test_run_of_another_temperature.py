"""A power-on at another temperature than is written: its rows are findings, with what it was."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import Hall, axes_apart, chamber, days, hidden, read
from tests.diagnose.worlds import whole

LAYOUTS: dict[str, Callable[[int], Hall]] = {
    "days": lambda seed: days(seed, 20),
    "chamber": chamber,
}


def _mistaken(seed: int, layout: str, by: float) -> tuple[DwellTable, int, float]:
    """A table in which one power-on's temperatures are off by so much; its number, its own temperature."""
    hall = LAYOUTS[layout](seed)
    table = read(hall, seed)
    runs = np.unique(hall.run)
    run = int(np.random.default_rng([seed, 9]).choice(runs[1:]))
    mine = hall.run == run
    median = float(np.median(hall.temperature[mine]))
    by = -by if median + by > 75.0 or median + by < -60.0 else by
    off = np.where(mine, by, 0.0)
    return replace(table, temperature_degc=table.temperature_degc + off), run, median


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize(("seed", "by"), [(1, 17.0)])
@pytest.mark.further(("seed", "by"), [(2, -25.0), (3, 33.0)])
def test_a_run_of_another_temperature_is_said_with_that_temperature(
    seed: int, by: float, layout: str
) -> None:
    """It was hysteresis, something over time, or nothing at all: the tables got a node of its own."""
    table, run, truth = _mistaken(seed, layout, by)
    found = whole(table)
    assert not found.effects
    assert not found.unknown
    (suspect,) = found.reference_suspects
    assert (suspect.hypothesis, suspect.unit) == ("wrong_record", "degC")
    assert abs(suspect.value - truth) < 2.0
    assert suspect.high - suspect.low < 8.0
    assert {row.run for row in found.rows_left_out} == {run}
    assert len(found.rows_left_out) == int(np.sum(table.run == run))
    assert found.rows_left_out[0].guess.startswith(f"temperature of run {run} looks like {suspect.value:.0f}")


@pytest.mark.parametrize("layout", [*LAYOUTS.values(), axes_apart])
@pytest.mark.parametrize("seed", [11])
@pytest.mark.further("seed", [12])
def test_no_temperature_is_doubted_where_all_are_right(seed: int, layout: Callable[[int], Hall]) -> None:
    found = whole(read(layout(seed), seed))
    assert not found.reference_suspects
    assert not found.rows_left_out


@pytest.mark.parametrize("seed", [21])
@pytest.mark.further("seed", [22, 23])
def test_what_one_run_reads_otherwise_is_no_temperature(seed: int) -> None:
    """A power-on whose accelerometers lean by what no other temperature gives them."""
    hall = days(seed, 20)
    table = read(hall, seed)
    off = 2e-3 * (hall.run == 7)
    for axis in range(3):
        table = hidden(table, "accelerometer", axis, off * hall.up[:, (axis + 1) % 3])
    found = whole(table)
    assert all("temperature of run" not in row.guess for row in found.rows_left_out)
    assert all(s.unit != "degC" for s in found.reference_suspects)
