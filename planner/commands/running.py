"""The commands that drive a bench, no arithmetic: run, bench-check."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planner.commands.options import AsJson, Axes, PlanFile
from planner.commands.output import answer, progress_line
from planner.errors import InputError

if TYPE_CHECKING:
    from planner.bench_run.bench_check import Tried
    from planner.bench_run.job import Job
    from planner.bench_run.session import Request


Tables = Annotated[
    list[str] | None,
    typer.Option(metavar="RESOURCE", help="VISA resource of the table; BENCH=RESOURCE for several."),
]
Chambers = Annotated[
    list[str] | None,
    typer.Option(
        "--chamber", metavar="RESOURCE", help="VISA resource of the chamber; BENCH=RESOURCE for several."
    ),
]
TableDialects = Annotated[
    list[str] | None,
    typer.Option(
        "--table-dialect", metavar="NAME_OR_FILE", help="What the table speaks [acutrol]; or BENCH=…"
    ),
]
ChamberDialects = Annotated[
    list[str] | None,
    typer.Option(
        "--chamber-dialect", metavar="NAME_OR_FILE", help="What the chamber speaks [espec_p300]; or BENCH=…"
    ),
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Check the limits and print what would be sent.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on where the journal ends.")]
FromStart = Annotated[
    bool, typer.Option("--from-start", help="With --resume: begin where the journal tells nothing.")
]
Reconnect = Annotated[
    str, typer.Option(metavar="TIME", help="How long a connection that dropped is looked for.")
]
Page = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write a page that shows how far the run is.")
]
Notify = Annotated[
    str | None,
    typer.Option(
        metavar="COMMAND", help="Called with EVENT and words when a person is needed or the run stops."
    ),
]
Journal = Annotated[Path | None, typer.Option(metavar="FILE", help="Journal [run.jsonl beside the plan].")]
Recorder = Annotated[
    str | None,
    typer.Option(metavar="COMMAND", help="Program called with power_on, start, stop, void, power_off."),
]
Unattended = Annotated[
    bool, typer.Option("--unattended", help="Wait the planned time instead of asking somebody.")
]
OneBench = Annotated[
    str | None,
    typer.Option(metavar="BENCH", help="Run the part on this bench alone, with its own journal."),
]
AnyTime = Annotated[
    bool, typer.Option("--any-time", help="People are there at any time, whatever the plan's shifts.")
]
Arm = Annotated[
    float | None, typer.Option(metavar="METRES", help="Arm of a centrifuge that the plan does not know.")
]
Travel = Annotated[
    list[str] | None, typer.Option(metavar="AXIS=LEAST..MOST", help="Stops of an axis in deg.")
]
Baud = Annotated[int, typer.Option(metavar="BAUD", help="Of serial resources.")]
Speed = Annotated[
    float | None, typer.Option(metavar="FACTOR", help="Simulators only: waits are shorter by this.")
]
ClockPorts = Annotated[
    list[int] | None,
    typer.Option(metavar="PORT", help="Simulators only: bench-simulator's clock; of several, each."),
]


def run(
    plan: PlanFile,
    table: Tables = None,
    chamber: Chambers = None,
    table_dialect: TableDialects = None,
    chamber_dialect: ChamberDialects = None,
    dry_run: DryRun = False,
    resume: Resume = False,
    from_start: FromStart = False,
    journal: Journal = None,
    recorder: Recorder = None,
    unattended: Unattended = False,
    bench: OneBench = None,
    any_time: AnyTime = False,
    arm: Arm = None,
    travel: Travel = None,
    baud: Baud = 19200,
    speed: Speed = None,
    clock_port: ClockPorts = None,
    reconnect: Reconnect = "10 min",
    page: Page = None,
    notify: Notify = None,
    as_json: AsJson = False,
) -> None:
    """Execute a plan on a bench over PyVISA; every finished step goes to a journal.

    Example: planner run plans/small_uav --table TCPIP::192.168.0.10::5025::SOCKET --chamber ASRL1::INSTR
    """
    from planner.bench_run import session

    job, name = _job(plan, bench, arm, travel or (), any_time)
    request = session.Request(
        tables=tuple(table or ()),
        chambers=tuple(chamber or ()),
        journal=journal or (plan if plan.is_dir() else plan.parent) / name,
        resume=resume,
        from_start=from_start,
        unattended=unattended,
        recorder=recorder,
        speed=speed,
        clock_ports=tuple(clock_port or ()),
        baud=baud,
        table_dialects=tuple(table_dialect or ()),
        chamber_dialects=tuple(chamber_dialect or ()),
        reconnect_s=_seconds("--reconnect", reconnect),
        page=page,
        notify=notify,
    )
    _run(job, request, dry_run, as_json)


def _seconds(option: str, text: str) -> float:
    from planner.units import UnitError, to_si

    try:
        seconds = to_si(text, "s")
    except UnitError as error:
        raise InputError(f"{option} {text!r}: {error}; write '10 min'") from error
    if not 0 <= seconds <= 1e7:
        raise InputError(f"{option} must be a time, not {text}")
    return seconds


def _job(
    plan: Path, bench: str | None, arm: float | None, travel: Sequence[str], any_time: bool
) -> tuple[Job, str]:
    """What is to be done, of the plan or of its part on one bench; and its journal's usual name."""
    from planner.bench_run import session
    from planner.bench_run.job import job_from
    from planner.export._scripts import file_name
    from planner.export.documents import read_sealed_plan

    document = read_sealed_plan(plan)
    if arm is not None and not 0 < arm < 1000:
        raise InputError(f"--arm must be a length in metres, not {arm:g}")
    job = job_from(document, arm_m=arm, travel=session.travel_from(travel), any_time=any_time)
    return (job, "run.jsonl") if bench is None else (job.on(bench), f"run.{file_name(bench)}.jsonl")


def _run(job: Job, request: Request, dry_run: bool, as_json: bool) -> None:
    """Rehearse, or execute and say what was made."""
    from planner.bench_run import session

    if request.from_start and not request.resume:
        raise InputError("--from-start goes with --resume; without it a run begins at the start anyway")
    if dry_run:
        session.rehearse(job, request, typer.echo)
        return
    with progress_line() as progress:
        done = session.run(job, request, lambda text: typer.echo(text, err=True), line=progress)
    answer(
        vars(done) | {"journal": str(request.journal)},
        f"made {done.steps} steps, {done.records} of them records ({done.void} void and made again), "
        f"in {done.seconds / 3600:.2f} h; journal: {request.journal}",
        as_json,
    )


def bench_check(
    table: Annotated[str | None, typer.Option(metavar="RESOURCE", help="VISA resource of a table.")] = None,
    chamber: Annotated[
        str | None, typer.Option(metavar="RESOURCE", help="VISA resource of a chamber.")
    ] = None,
    table_dialect: Annotated[
        str | None, typer.Option(metavar="NAME_OR_FILE", help="What the table speaks [acutrol].")
    ] = None,
    chamber_dialect: Annotated[
        str | None, typer.Option(metavar="NAME_OR_FILE", help="What the chamber speaks [espec_p300].")
    ] = None,
    axes: Axes = 1,
    move: Annotated[
        bool, typer.Option("--move", help="Also turn axis 1 by a degree and slowly; hands off the table.")
    ] = False,
    baud: Baud = 19200,
    as_json: AsJson = False,
) -> None:
    """Try a table or a chamber step by step; nothing moves unless --move says so. Exit 1: something fails.

    Example: planner bench-check --table TCPIP::192.168.0.10::5025::SOCKET --axes 2
    """
    from planner.bench_run.bench_check import check_chamber, check_table
    from planner.bench_run.clock import WallClock
    from planner.bench_run.visa import VisaLine
    from planner.control.dialect_files import chamber_dialect as chamber_speaks
    from planner.control.dialect_files import known_dialects
    from planner.control.dialect_files import table_dialect as table_speaks

    if table is None and chamber is None:
        known = ", ".join(known_dialects())
        raise InputError(f"nothing to try: give --table or --chamber (dialects: {known})")
    clock, tried, lacks = WallClock(), [], []
    if table is not None:
        words = table_speaks(table_dialect)
        tried += list(
            check_table(VisaLine(table, words.connection.ends_with, baud), clock, words, axes, moving=move)
        )
        lacks += [f"table ({words.name}): {text}" for text in words.lacks()]
    if chamber is not None:
        air = chamber_speaks(chamber_dialect)
        tried += list(
            check_chamber(VisaLine(chamber, air.connection.ends_with, baud), clock, air, moving=move)
        )
        lacks += [f"chamber ({air.name}): {text}" for text in air.lacks()]
    _tell(tried, lacks, as_json)


def _tell(tried: Sequence[Tried], lacks: Sequence[str], as_json: bool) -> None:
    """What was tried, and what the device lacks. Exit 1: something fails."""
    lines = [f"{'ok  ' if one.ok else 'FAIL'} {one.device:8} {one.what:24} {one.seen}" for one in tried]
    lines += [f"lacks {text}" for text in lacks]
    ok = all(one.ok for one in tried)
    tree = {"ok": ok, "tried": [vars(one) for one in tried], "lacks": list(lacks)}
    answer(tree, "\n".join(lines), as_json, 0 if ok else 1)
    if not ok:
        raise typer.Exit(1)
