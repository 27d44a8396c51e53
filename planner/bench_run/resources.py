"""From what the user names to what a run is made with: resources, dialects, clock, operator."""

from __future__ import annotations

import math
import shlex
import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from planner.bench_run.clock import Clock, SimulatorClock, WallClock
from planner.bench_run.equipment import BenchLines, Dialects, Equipment, Notify, Say
from planner.bench_run.interrupts import Stop
from planner.bench_run.job import Job
from planner.bench_run.line import Line
from planner.bench_run.people import Asking, CommandRecorder, NoRecorder, Operator, Waiting
from planner.bench_run.shifts import local_week_s
from planner.bench_run.tolerances import Tolerances
from planner.bench_run.visa import VisaLine, is_simulator
from planner.control.dialect_files import chamber_dialect, table_dialect
from planner.errors import InputError

PATIENCE_S = 3600.0  # with a simulator's clock an hour passes at once, and nobody is there to say enough


@dataclass(frozen=True)
class Request:
    """What the user asked for. tables, chambers: `RESOURCE` for all benches, or `BENCH=RESOURCE` for each.

    table_dialects, chamber_dialects: names or files, given in the same way
    page: where to write the page that shows how far the run is; notify: a command to call
    """

    tables: tuple[str, ...]
    chambers: tuple[str, ...]
    journal: Path
    resume: bool = False
    from_start: bool = False
    unattended: bool = False
    recorder: str | None = None
    speed: float | None = None
    clock_ports: tuple[int, ...] = ()
    baud: int = 19200
    table_dialects: tuple[str, ...] = ()
    chamber_dialects: tuple[str, ...] = ()
    reconnect_s: float = Tolerances.reconnect_s
    page: Path | None = None
    notify: str | None = None


def dialects_of(job: Job, request: Request) -> Dialects:
    """Bench -> the dialects of its table and chamber. Raises InputError for one that cannot be used."""
    names = job.used_benches
    tables = _by_bench(names, request.table_dialects, "--table-dialect")
    chambers = _by_bench(names, request.chamber_dialects, "--chamber-dialect")
    return {name: (table_dialect(tables.get(name)), chamber_dialect(chambers.get(name))) for name in names}


@dataclass(frozen=True)
class Resources:
    """Bench -> the resource of its table, of its chamber."""

    tables: Mapping[str, str]
    chambers: Mapping[str, str]

    @property
    def simulated(self) -> bool:
        """Whether nothing here can hurt anybody."""
        return all(map(is_simulator, [*self.tables.values(), *self.chambers.values()]))


def resources_of(job: Job, request: Request, say: Say, *, apart: bool) -> Resources:
    """Every device's resource. Raises InputError for what is missing, or one too many.

    apart: benches work side by side, so no two can have one device
    """
    driven = [name for name in job.used_benches if job.benches[name].driven]
    warmed = [name for name in job.used_benches if job.benches[name].chamber is not None]
    tables = _by_bench(driven, request.tables, "--table")
    chambers = _by_bench(warmed, request.chambers, "--chamber")
    for option, needing, found in (("--table", driven, tables), ("--chamber", warmed, chambers)):
        missing = [name for name in needing if name not in found]
        if missing:
            one = f"{option} {missing[0]}=RESOURCE" if len(needing) > 1 else f"{option} RESOURCE"
            raise InputError(f"no {option.removeprefix('--')} for {', '.join(missing)}; give {one}")
        shared = [name for name in needing if list(found.values()).count(found[name]) > 1]
        if shared and apart:
            raise InputError(
                f"{' and '.join(shared)} work at the same time and cannot have one {option[2:]}; "
                f"give {option} BENCH=RESOURCE for each"
            )
        if shared:
            say(
                f"note: {found[shared[0]]} is the {option[2:]} of {' and '.join(shared)}; "
                f"{option} BENCH=RESOURCE tells them apart"
            )
    return Resources(tables, chambers)


def _by_bench(names: Sequence[str], given: Sequence[str], option: str) -> dict[str, str]:
    """Bench -> what was given for it, or for all. Raises InputError for a bench that has no such thing."""
    named = dict(text.split("=", 1) for text in given if "=" in text)
    bare = [text for text in given if "=" not in text]
    if len(bare) > 1 or set(named) - set(names):
        raise InputError(
            f"{option} takes one for all, or BENCH=… for each of {', '.join(names) or 'no bench'}"
        )
    return {name: named.get(name, *bare) for name in names if name in named or bare}


def equipment_of(
    request: Request, found: Resources, dialects: Dialects, stack: ExitStack, stop: Stop, notify: Notify
) -> Equipment:
    """Everything opened; closed with the stack. Raises InputError for what cannot be reached."""
    clock = _clock(request, found.simulated, stack)
    operator = _operator(request, clock, found.simulated)
    lines: dict[tuple[str, str], Line] = {}

    def line(resource: str | None, line_end: str) -> Line | None:
        if resource is None:
            return None
        if (resource, line_end) not in lines:
            made = VisaLine(resource, line_end, request.baud)
            stack.callback(made.close)
            lines[resource, line_end] = made
        return lines[resource, line_end]

    benches = {
        name: BenchLines(
            line(found.tables.get(name), table.connection.ends_with),
            line(found.chambers.get(name), chamber.connection.ends_with),
            table,
            chamber,
        )
        for name, (table, chamber) in dialects.items()
    }
    return Equipment(
        benches=benches,
        clock=clock,
        recorder=CommandRecorder(shlex.split(request.recorder)) if request.recorder else NoRecorder(),
        operator=operator,
        tolerances=Tolerances(reconnect_s=request.reconnect_s),
        week=None if found.simulated else local_week_s,
        stop=stop,
        patience_s=PATIENCE_S if request.clock_ports else math.inf,
        notify=notify,
    )


def _clock(request: Request, simulated: bool, stack: ExitStack) -> Clock:
    if request.speed is None and not request.clock_ports:
        return WallClock()
    if not simulated:
        raise InputError(
            "--speed and --clock-port are for simulators on this machine; real soaks take their time"
        )
    if request.clock_ports:
        clock = SimulatorClock(*request.clock_ports)
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
    return Asking(_answered)


def _answered(question: str) -> str:
    """What somebody says; while the question stands on an open line, no progress is drawn over it."""
    print(question, end=" ", file=sys.stderr, flush=True)
    said = input()
    print(end="\r", file=sys.stderr)
    return said
