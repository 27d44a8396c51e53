"""The commands from a spec to a plan, no arithmetic."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from planner.commands.options import AsJson, SpecFile
from planner.commands.output import (
    STANDARD,
    Said,
    answer,
    progress_line,
    refuse_others,
    say,
    say_text,
    until_ctrl_c,
)


def check(spec: SpecFile, as_json: AsJson = False) -> None:
    """Validate a spec: every fault at once, each with file:line:column.

    Then whether a campaign of the tests can tell every error that they calibrate, as `planner plan` asks.

    Example: planner check spec.yaml
    """
    from planner.api import planning

    odd = planning.check(spec)
    for warning in odd:
        typer.echo(f"warning: {warning.shown}", err=True)
    answer({"warnings": [one.document() for one in odd]}, f"{spec}: no faults", as_json)


def schema(
    of: Annotated[str, typer.Option("--of", metavar="FILE", help="spec, plan, diagnosis, …")] = "spec",
    as_json: AsJson = False,
) -> None:
    """Print the JSON Schema of a file: spec, column-map, plan, diagnosis, calibration, verify, ….

    Example: planner schema --of column-map > column_map.schema.json
    """
    from planner.export.schemas import schema_of

    found = schema_of(of)
    answer(found, json.dumps(found, indent=2, ensure_ascii=False), as_json)


def plan(
    spec: SpecFile,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="DIR", help="Folder [plans/<spec name>/]; -: stdout."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Plan the shortest campaign that suffices; writes plan.json, steps.csv and report.html.

    Example: planner plan requirements_specs/small_uav.yaml -o plans/small_uav
    """
    from planner.api import planning

    folder = out or Path("plans") / (spec.stem if str(spec) != STANDARD else "stdin")
    refuse_others(spec, folder, "plan.json", "steps.csv", "report.html")
    first = Said(silently=as_json or str(folder) == STANDARD)
    with progress_line() as progress, until_ctrl_c() as stop:
        made = planning.plan(spec, progress=progress, stop=stop, answered=first.say)
        if str(folder) == STANDARD:
            say_text(made.placed(Path())[Path("plan.json")], made)
    written = f"wrote {folder / 'plan.json'}, steps.csv, report.html"
    say(made, as_json, folder, spec, written=written, first=first)


def sensitivity(
    spec: SpecFile,
    trajectory: Annotated[
        Path | None, typer.Option(metavar="CSV", help="A flight from a file instead of the spec's.")
    ] = None,
    at: Annotated[
        str, typer.Option(metavar="TIME", help="end, a time such as '30 s', or any: the worst moment.")
    ] = "end",
    beside: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME|CSV", help="Another flight beside it, a built-in or a file; repeatable."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="DIR", help="Folder for curves over the flight [none written]."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Print the linear-combination coefficients: navigation error per unit of every sensor error.

    -o: report.html draws the error over the flight, by sensor error and by axis; sensitivities.csv has it.

    Example: planner sensitivity spec.yaml --beside helicopter --beside flight.csv -o sensitivities
    """
    from planner.api import planning

    refuse_others(spec, out, "report.html", "sensitivities.csv")
    with progress_line() as progress:
        found = planning.sensitivity(
            spec, trajectory=trajectory, at=at, beside=beside or (), progress=progress
        )
    say(found, as_json, out, spec)


def allow(spec: SpecFile, as_json: AsJson = False) -> None:
    """Print the allowed sensor errors: Pareto set of the genetic algorithm, its corners, the exact optimum.

    Example: planner allow spec.yaml
    """
    from planner.api import planning

    with progress_line() as progress, until_ctrl_c() as stop:
        found = planning.allow(spec, progress=progress, stop=stop)
    say(found, as_json)


def compare(
    plans: Annotated[list[Path], typer.Argument(metavar="PLAN PLAN…", help="plan.json files or folders.")],
    exit_code: Annotated[bool, typer.Option("--exit-code", help="Exit 1 when the plans differ.")] = False,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="DIR", help="Folder for comparison.json, report.html."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Compare plans: hours by bench, test and action, what differs and why.

    Example: planner compare plans/published_one_bench plans/published_optimum
    """
    from planner.api import comparing

    say(comparing.compare(*plans, strict=exit_code), as_json, out, "a comparison")


def why(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="plan.json, or the folder that holds it.")],
    as_json: AsJson = False,
) -> None:
    """Say why a plan is as it is: what binds, what every visit buys, what changes are worth.

    Example: planner why plans/helicopter
    """
    from planner.api import comparing

    say(comparing.why(plan), as_json)


def afford(
    spec: SpecFile,
    hours: Annotated[float, typer.Option("--hours", min=0.01, help="Hours that the campaign may take.")],
    as_json: AsJson = False,
) -> None:
    """Say what so many hours can keep: the least limits, and the grade of sensor that the limits need.

    Example: planner afford requirements_specs/helicopter.yaml --hours 8
    """
    from planner.api import comparing

    with progress_line() as progress:
        found = comparing.afford(spec, hours=hours, progress=progress)
    say(found, as_json)
