"""The temperatures that a plan asks of a chamber: what the chamber's script and the table's people share.

A test that records on a ramp has a stair of setpoints, which the chamber's air smooths.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from planner.control.ramp import stair
from planner.control.words import figure
from planner.export.csv_text import csv_text
from planner.export.header import HEADER_COLUMNS, header_cells
from planner.nouns.bench import BenchFacts
from planner.nouns.step import Step

SETPOINT_COLUMNS = ("start_s", "end_s", "setpoint_degc", "soaked_s", "step")


@dataclass(frozen=True)
class Setpoint:
    """A temperature that the chamber is to hold from start to end; soaked: when the unit has it too."""

    degc: float
    start_s: float
    soaked_s: float
    end_s: float
    step: str


def setpoints(bench: BenchFacts, steps: Sequence[Step]) -> list[Setpoint]:
    """Every temperature that the bench's steps ask for, in order; room temperature at the start and end."""
    found: list[Setpoint] = []
    now, since, soaked, name = bench.room_degc, steps[0].start_s, steps[0].start_s, steps[0].id
    for step in steps:
        for wanted, start in _wanted(step):
            if wanted is not None and wanted != now:
                found.append(Setpoint(now, since, soaked, start, name))
                now, since, soaked, name = wanted, start, start, step.id
        if step.action in ("ramp", "soak") and step.swept_degc is None:
            soaked = step.end_s
    found.append(Setpoint(now, since, soaked, steps[-1].end_s, name))
    if now != bench.room_degc:
        end = steps[-1].end_s
        found.append(Setpoint(bench.room_degc, end, end, end, "end"))
    return found


def _wanted(step: Step) -> Iterator[tuple[float | None, float]]:
    """(degC, from when on) of a step: one, or the stairs of a chamber that moves evenly meanwhile."""
    if step.swept_degc is None:
        yield step.temperature_degc, step.start_s
        return
    degrees = stair(*step.swept_degc)
    for k, degc in enumerate(degrees):
        yield round(degc, 6), round(step.start_s + step.seconds * k / len(degrees), 6)


def setpoint_text(document: Mapping[str, Any], bench: BenchFacts, steps: Sequence[Step]) -> str:
    """The setpoints as CSV: seconds from the start of the campaign, degrees Celsius."""
    plan = header_cells(document)
    rows = (
        [*map(figure, (p.start_s, p.end_s, p.degc, p.soaked_s)), p.step, *plan]
        for p in setpoints(bench, steps)
    )
    return csv_text(SETPOINT_COLUMNS + HEADER_COLUMNS, rows)
