"""The commands that take a plan to the bench, no arithmetic: export, bench-simulator."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planner.commands.options import AsJson, Axes, PlanFile
from planner.commands.output import STANDARD, answer, say, say_text
from planner.errors import InputError

Port = Annotated[int, typer.Option(min=0, max=65535, help="0: any free port.")]
Faults = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME@N",
        help="At the N-th message, N+ from then on, N..M: lost_reply@9, late_reply:2.4@9, "
        "chamber.nan_reading@3+ …; an unknown name lists them all.",
    ),
]


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
        typer.Option(
            "-o", "--out", metavar="FILE_OR_DIR", help="Where to [a folder beside the plan]; -: stdout."
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write the schedule for bench software: table and chamber scripts, calendars, lists.

    Example: planner export plans/small_uav --format acutrol --dialect host -o bench/
    """
    from planner.api import bench

    made = bench.export(plan, form, dialect=dialect, start=start, timezone=timezone)
    target = out or (plan if plan.is_dir() else plan.parent) / f"export_{form}"
    if str(target) == STANDARD:
        if len(made.record.files) > 1:
            raise InputError(f"{form} is {len(made.record.files)} files; give a folder with -o")
        say_text(next(iter(made.record.files.values())), made)
    say(made, as_json, target, plan, extra={"written": [str(path) for path in made.placed(target)]})


def bench_simulator(
    table_port: Port = 0,
    chamber_port: Port = 0,
    clock_port: Port = 0,
    host: Annotated[str, typer.Option(help="An address of this machine, no other.")] = "127.0.0.1",
    axes: Axes = 3,
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
