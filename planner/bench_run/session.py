"""One call of `planner run`: limits, journal, lines, the run itself, and what to say at its end."""

from __future__ import annotations

import math
import re
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from planner.bench_run import limits
from planner.bench_run.clock import Clock, SimulatorClock, WallClock
from planner.bench_run.dry import dry_run
from planner.bench_run.errors import BenchFault, Interrupted
from planner.bench_run.interrupts import stoppable
from planner.bench_run.job import Job
from planner.bench_run.journal import Journal, open_journal, read_past
from planner.bench_run.line import Line
from planner.bench_run.people import Asking, CommandRecorder, NoRecorder, Operator, Waiting
from planner.bench_run.runner import ATTENTION, Equipment, Finished, execute
from planner.bench_run.shifts import local_week_s
from planner.bench_run.visa import VisaLine, is_simulator
from planner.errors import InputError
from planner.nouns.plan import Step

Say = Callable[[str], None]


@dataclass(frozen=True)
class Request:
    """What the user asked for. tables: `RESOURCE` for all benches, or `BENCH=RESOURCE` for each."""

    tables: tuple[str, ...]
    chamber: str | None
    journal: Path
    resume: bool = False
    unattended: bool = False
    recorder: str | None = None
    speed: float | None = None
    clock_port: int | None = None
    baud: int = 19200


def rehearse(job: Job, request: Request, say: Say) -> None:
    """Check the limits and say what would be sent; nothing is opened or written."""
    for note in limits.check(job):
        say(f"note: {note}")
    dry_run(job, read_past(request.journal, job.plan_sha256, _ids(job)), say)


def run(job: Job, request: Request, say: Say, before: Callable[[Step], None]) -> Finished:
    """Run the campaign, or what is left of it.

    Raises InputError before anything moves for a plan that the bench cannot do, a journal that does not fit,
    a bench that cannot be reached; BenchFault and Interrupted later, when everything has been made safe.
    """
    for note in limits.check(job):
        say(f"note: {note}")
    tables = _resources(job, request, say)
    with ExitStack() as stack:
        journal = open_journal(request.journal, job.plan_sha256, _ids(job), resume=request.resume)
        stack.callback(journal.close)
        if len(journal.past.entries) == len(job.steps):
            say(f"{request.journal} tells of a finished campaign; nothing is left to do")
            return Finished(0, 0, 0.0)
        stack.enter_context(stoppable())
        equipment = _equipment(request, tables, stack)
        return _reported(job, equipment, journal, say, before)


def _reported(
    job: Job, equipment: Equipment, journal: Journal, say: Say, before: Callable[[Step], None]
) -> Finished:
    """The run; whatever stops it is reported with where it stopped and how to go on."""
    done, at = len(journal.past.entries), "the start"
    unsafe: list[str] = []

    def count(step: Step) -> None:
        nonlocal done, at
        done, at = done + (at != "the start"), step.id
        before(step)

    def listen(text: str) -> None:
        if text.startswith(ATTENTION):
            unsafe.append(text)
        say(text)

    try:
        return execute(job, equipment, journal, listen, count)
    except (BenchFault, KeyboardInterrupt) as error:
        state = "NOT everything was made safe, see above" if unsafe else "table at zero rate, chamber to room"
        kind = BenchFault if isinstance(error, BenchFault) else Interrupted
        raise kind(
            f"{str(error) or 'stopped'}. Stopped at {at}, {done} of {len(job.steps)} steps done; {state}. "
            f"Go on with --resume (journal: {journal.path})"
        ) from error


def _ids(job: Job) -> Sequence[str]:
    return [step.id for step in job.steps]


def _resources(job: Job, request: Request, say: Say) -> Mapping[str, str]:
    """The table's resource for every driven bench. Raises InputError for what is missing or one too many."""
    named = dict(text.split("=", 1) for text in request.tables if "=" in text)
    bare = [text for text in request.tables if "=" not in text]
    driven = [name for name in job.used_benches if job.benches[name].driven]
    if len(bare) > 1 or set(named) - set(driven):
        raise InputError(f"--table takes RESOURCE once, or BENCH=RESOURCE for each of {', '.join(driven)}")
    missing = [name for name in driven if name not in named and not bare]
    if missing:
        raise InputError(f"no table for {', '.join(missing)}; give --table {missing[0]}=RESOURCE")
    if any(job.benches[name].chamber for name in job.used_benches) and request.chamber is None:
        raise InputError("the plan needs a chamber; give --chamber RESOURCE")
    shared = [name for name in driven if name not in named]
    if len(shared) > 1:
        say(
            f"note: {bare[0]} is the table of {' and '.join(shared)}; --table BENCH=RESOURCE tells them apart"
        )
    return {name: named.get(name, bare[0] if bare else "") for name in driven}


def _equipment(request: Request, tables: Mapping[str, str], stack: ExitStack) -> Equipment:
    resources = [*tables.values(), *([request.chamber] if request.chamber else [])]
    clock = _clock(request, all(map(is_simulator, resources)), stack)
    operator = _operator(request, clock, all(map(is_simulator, resources)))
    lines: dict[str, Line] = {}
    for resource in dict.fromkeys(tables.values()):
        lines[resource] = _line(resource, "\n", request, stack)
    return Equipment(
        tables={name: lines[resource] for name, resource in tables.items()},
        chamber=_line(request.chamber, "\r\n", request, stack) if request.chamber else None,
        clock=clock,
        recorder=CommandRecorder(shlex.split(request.recorder)) if request.recorder else NoRecorder(),
        operator=operator,
        week=None if all(map(is_simulator, resources)) else local_week_s,
    )


def _line(resource: str, line_end: str, request: Request, stack: ExitStack) -> Line:
    line = VisaLine(resource, line_end, request.baud)
    stack.callback(line.close)
    return line


def _clock(request: Request, simulated: bool, stack: ExitStack) -> Clock:
    if request.speed is None and request.clock_port is None:
        return WallClock()
    if not simulated:
        raise InputError(
            "--speed and --clock-port are for simulators on this machine; real soaks take their time"
        )
    if request.clock_port is not None:
        clock = SimulatorClock(request.clock_port)
        stack.callback(clock.close)
        return clock
    speed = request.speed or 0.0
    if not (math.isfinite(speed) and speed > 0):
        raise InputError(f"--speed must be more than 0, not {speed:g}")
    return WallClock(speed)


def _operator(request: Request, clock: Clock, simulated: bool) -> Operator:
    """Somebody must say that hands are off the table, unless it is no real one or --unattended says so."""
    if request.unattended or simulated:
        return Waiting(clock)
    if not sys.stdin.isatty():
        raise InputError("nobody to ask when the unit is installed: use a terminal, or --unattended")
    return Asking(lambda text: input(f"{text} "))


def travel_from(texts: Sequence[str]) -> Mapping[int, tuple[float, float]]:
    """`2=-95..95` → {2: (-95, 95)}, the stops of an axis in deg. Raises InputError."""
    found = {}
    for text in texts:
        match = re.fullmatch(r"([1-6])=(-?[\d.]+)\.\.(-?[\d.]+)", text)
        try:
            stops = (float(match[2]), float(match[3])) if match else (0.0, 0.0)
        except ValueError:
            stops = (0.0, 0.0)
        if match is None or stops[0] >= stops[1]:
            raise InputError(f"no stops {text!r}; write AXIS=LEAST..MOST in deg, such as 2=-95..95")
        found[int(match[1])] = stops
    return found
