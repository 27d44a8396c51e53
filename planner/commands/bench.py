"""The commands that take a plan to the bench, no arithmetic: export, run, bench-simulator."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planner.commands.options import AsJson, PlanFile
from planner.commands.output import answer, listed, notes, progress_line
from planner.errors import InputError

if TYPE_CHECKING:
    from planner.bench_run.job import Job
    from planner.bench_run.session import Request


Tables = Annotated[
    list[str] | None,
    typer.Option(metavar="RESOURCE", help="VISA resource of the table; BENCH=RESOURCE for several."),
]
Chamber = Annotated[str | None, typer.Option(metavar="RESOURCE", help="VISA resource of the chamber.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Check the limits and print what would be sent.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on where the journal ends.")]
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
ClockPort = Annotated[
    int | None, typer.Option(metavar="PORT", help="Simulators only: bench-simulator's clock.")
]

Faults = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME@N", help="At the N-th message: lost_reply@9, chamber.never_settles@3 …"),
]


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command()(export)
    app.command()(run)
    app.command("bench-simulator")(bench_simulator)


def export(
    plan: PlanFile,
    form: Annotated[
        str, typer.Option("--format", metavar="acutrol|csv|json|ics|chamber", help="In what form.")
    ],
    dialect: Annotated[
        str | None, typer.Option(metavar="host|macro", help="Of a table script [host].")
    ] = None,
    start: Annotated[
        str | None, typer.Option(metavar="TIME", help="Local start, for ics, e.g. 2026-12-01T08:00.")
    ] = None,
    timezone: Annotated[
        str | None, typer.Option(metavar="ZONE", help="Time zone, for ics [Europe/Berlin].")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="FILE_OR_DIR", help="Where to [a folder beside the plan]."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write the schedule for bench software: table and chamber scripts, calendars, lists.

    Example: planner export plans/small_uav --format acutrol --dialect host -o bench/
    """
    from planner.export.files import write_all_whole
    from planner.export.outputs import exported_file, places
    from planner.protocols import ExportOptions

    made = exported_file(plan, form, ExportOptions(dialect, start, timezone))
    placed = places(made.files, out or (plan if plan.is_dir() else plan.parent) / f"export_{form}")
    write_all_whole(placed)
    notes(made.notes)
    written = [str(path) for path in placed]
    answer({"format": form, "written": written, "notes": list(made.notes)}, listed(written), as_json)


def run(
    plan: PlanFile,
    table: Tables = None,
    chamber: Chamber = None,
    dry_run: DryRun = False,
    resume: Resume = False,
    journal: Journal = None,
    recorder: Recorder = None,
    unattended: Unattended = False,
    bench: OneBench = None,
    any_time: AnyTime = False,
    arm: Arm = None,
    travel: Travel = None,
    baud: Baud = 19200,
    speed: Speed = None,
    clock_port: ClockPort = None,
    as_json: AsJson = False,
) -> None:
    """Execute a plan on a bench over PyVISA; every finished step goes to a journal.

    Example: planner run plans/small_uav --table TCPIP::192.168.0.10::5025::SOCKET --chamber ASRL1::INSTR
    """
    from planner.bench_run import session

    job, name = _job(plan, bench, arm, travel or (), any_time)
    request = session.Request(
        tables=tuple(table or ()),
        chamber=chamber,
        journal=journal or (plan if plan.is_dir() else plan.parent) / name,
        resume=resume,
        unattended=unattended,
        recorder=recorder,
        speed=speed,
        clock_port=clock_port,
        baud=baud,
    )
    if dry_run:
        session.rehearse(job, request, typer.echo)
    else:
        _execute(job, request, as_json)


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


def _execute(job: Job, request: Request, as_json: bool) -> None:
    from planner.bench_run import session

    with progress_line() as progress:
        done = session.run(
            job, request, lambda text: typer.echo(text, err=True), lambda step: progress(f"making {step.id}")
        )
    answer(
        vars(done) | {"journal": str(request.journal)},
        f"made {done.steps} steps, {done.records} of them records, in {done.seconds / 3600:.2f} h; "
        f"journal: {request.journal}",
        as_json,
    )


def bench_simulator(
    table_port: Annotated[int, typer.Option(min=0, max=65535, help="0: any free port.")] = 0,
    chamber_port: Annotated[int, typer.Option(min=0, max=65535, help="0: any free port.")] = 0,
    clock_port: Annotated[int, typer.Option(min=0, max=65535, help="0: any free port.")] = 0,
    host: Annotated[str, typer.Option(help="An address of this machine, no other.")] = "127.0.0.1",
    axes: Annotated[int, typer.Option(min=1, max=6, help="How many axes the table has.")] = 3,
    speed: Annotated[
        float, typer.Option(metavar="FACTOR", help="Its seconds per second, while nobody moves its clock.")
    ] = 1.0,
    fault: Faults = None,
    log: Annotated[Path | None, typer.Option(metavar="FILE", help="Every message, as JSON lines.")] = None,
    as_json: AsJson = False,
) -> None:
    """Simulate a rate table and a chamber on TCP ports of this machine, until Ctrl-C.

    Example: planner bench-simulator --table-port 5025 --chamber-port 5026 --clock-port 5027
    """
    from planner.bench_run.simulator.faults import fault_from_text
    from planner.bench_run.simulator.serve import serve
    from planner.bench_run.simulator.server import Ports, SimulatedBench

    try:
        faults = [fault_from_text(text) for text in fault or ()]
    except ValueError as error:
        raise InputError(str(error)) from None
    if not 0 < speed < 1e9:
        raise InputError(f"--speed must be more than 0, not {speed:g}")
    serve(
        lambda note: SimulatedBench(
            ports=Ports(table_port, chamber_port, clock_port),
            host=host,
            speed=speed,
            axes=axes,
            faults=faults,
            log=note,
        ),
        log,
        lambda document, text: answer(document, text, as_json),
    )
