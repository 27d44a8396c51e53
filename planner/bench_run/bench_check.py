"""Tries a table and a chamber step by step, without a plan: what answers, how fast, and what it lacks.

Nothing moves and no setpoint changes unless `moving` says so; then an axis goes one degree and back, turns
slowly for a moment, and the chamber is told to hold the temperature that its air has.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

from planner.bench_run.chamber_driver import ChamberDriver
from planner.bench_run.clock import Clock
from planner.bench_run.line import Line
from planner.bench_run.safety import restless_in_time
from planner.bench_run.table import TableDriver
from planner.bench_run.tolerances import Tolerances
from planner.control.dialect import ChamberDialect, TableDialect
from planner.errors import PlannerError
from planner.nouns.bench import BenchFacts, ChamberFacts

LOOKS = 5  # at every reading: a number that never changes is no fault of a table at rest
RATE_DPS, STEP_DEG = 1.0, 1.0  # what is tried when moving is allowed
WIDEST_DEGC = (-100.0, 250.0)  # of any chamber: beyond that is no air temperature


@dataclass(frozen=True)
class Tried:
    """One step: the device, what was tried, whether it went well, and what was seen."""

    device: str
    what: str
    ok: bool
    seen: str


def check_table(
    line: Line, clock: Clock, dialect: TableDialect, axes: int, *, moving: bool
) -> Iterator[Tried]:
    """Questions, then (moving) interlock, a small move and back, a slow turn, and rest."""
    bench = BenchFacts("table", "rate_table", axes, 20.0, rate_dps=10.0, angular_acceleration_dps2=10.0)
    table = TableDriver(line, clock, bench, Tolerances(), dialect)
    yield _tried("table", "a connection", lambda: _opened(table.talk.connect))
    for axis in range(1, axes + 1):
        yield _tried("table", f"angle of axis {axis}", partial(_looks, partial(table.angle_deg, axis), "deg"))
        if dialect.questions.rate is not None:
            yield _tried(
                "table", f"rate of axis {axis}", partial(_looks, partial(table.rate_dps, axis), "deg/s")
            )
    if dialect.questions.errors is not None:
        yield _tried("table", "errors", lambda: ", ".join(table.errors()) or "none")
    if dialect.questions.interlock is not None:
        yield _tried("table", "interlock", lambda: table.interlock() or "closed")
    yield _tried("table", "rest", lambda: _nothing(table.restless()) or "angles stay, rates are zero")
    if moving:
        yield from _moves(table, clock)
    yield _doubts("table", table.talk.doubts)


def check_chamber(line: Line, clock: Clock, dialect: ChamberDialect, *, moving: bool) -> Iterator[Tried]:
    """Questions, then (moving) holding the temperature that the air has."""
    facts = ChamberFacts(*WIDEST_DEGC)
    chamber = ChamberDriver(line, clock, facts, Tolerances(), dialect=dialect)
    yield _tried("chamber", "a connection", lambda: _opened(chamber.talk.connect))
    yield _tried("chamber", "temperature", lambda: _looks(chamber.temperature_degc, "degC"))
    if dialect.tells_setpoint:
        yield _tried("chamber", "setpoint", lambda: _degc(chamber.setpoint_degc()))
    if dialect.questions.mode is not None:
        yield _tried("chamber", "mode", chamber.mode)
    if moving:
        here = round(chamber.last_degc if chamber.last_degc is not None else 20.0)
        yield _tried("chamber", f"holding {here} degC", lambda: _held(chamber, float(here)))
    yield _doubts("chamber", chamber.talk.doubts)


def _moves(table: TableDriver, clock: Clock) -> Iterator[Tried]:
    yield _tried("table", "interlock, limits, rest", lambda: _opened(lambda: table.open(RATE_DPS), "obeyed"))
    start = round(table.angles.get(1, 0.0), 3)
    for target in (start + STEP_DEG, start):
        yield _tried("table", f"axis 1 to {target:g} deg", partial(_moved, table, target))
    yield _tried("table", f"axis 1 at {RATE_DPS:g} deg/s", lambda: _turned(table))

    def off() -> str:
        table.order_off()
        return _nothing(restless_in_time(table, clock)) or "seen at zero rate"

    yield _tried("table", "off", off)


def _opened(action: Callable[[], None], said: str = "it is open") -> str:
    action()
    return said


def _moved(table: TableDriver, target: float) -> str:
    table.move({"position_1_deg": target}, 10.0)
    return f"it reads {table.angles[1]:g} deg"


def _turned(table: TableDriver) -> str:
    table.move({"rate_1_dps": RATE_DPS}, 10.0)
    return "its angle goes as its rate says"


def _held(chamber: ChamberDriver, degc: float) -> str:
    chamber.open(degc)
    return f"taken; {chamber.seen()}"


def _looks(look: Callable[[], float], unit: str) -> str:
    """Several looks: what they read, and how long an answer takes."""
    start = time.perf_counter()
    read = [look() for _ in range(LOOKS)]
    each = (time.perf_counter() - start) / LOOKS
    spread = max(read) - min(read)
    return f"{read[-1]:g} {unit}, answered in {1e3 * each:.0f} ms" + (
        f", spread {spread:.2g}" if spread else ""
    )


def _nothing(restless: list[str]) -> str:
    if restless:
        raise PlannerError(", ".join(restless))
    return ""


def _degc(value: float | None) -> str:
    return "not told" if value is None else f"{value:g} degC"


def _doubts(device: str, doubts: int) -> Tried:
    said = (
        "every answer fitted its question"
        if not doubts
        else f"{doubts} answers were lost, late, doubled or odd"
    )
    return Tried(device, "replies", not doubts, said)


def _tried(device: str, what: str, action: Callable[[], str]) -> Tried:
    try:
        return Tried(device, what, True, action())
    except (PlannerError, OSError) as error:
        return Tried(device, what, False, str(error))
