"""The commands from a spec to a plan, no arithmetic."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planner.commands.options import AsJson, SpecFile
from planner.commands.output import answer, deliver, page_of, progress_line, result
from planner.errors import InputError

if TYPE_CHECKING:  # what computes is imported by the command that needs it
    from planner.nouns.plan import Plan
    from planner.pipelines.planning import Planned
    from planner.report.blocks import Report
    from planner.spec.load import LoadedSpec


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    for command in (check, schema, plan, sensitivity, allow, compare, why, afford):
        app.command()(command)


def check(spec: SpecFile, as_json: AsJson = False) -> None:
    """Validate a spec: every fault at once, each with file:line:column.

    Then whether a campaign of the tests can tell every error that they calibrate, as `planner plan` asks.

    Example: planner check spec.yaml
    """
    from planner.pipelines import planning as pipeline
    from planner.spec.load import load_spec

    loaded = load_spec(spec)
    pipeline.refuse_unplannable(loaded)
    for warning in loaded.warnings:
        typer.echo(f"warning: {warning.shown}", err=True)
    warnings = [str(w) for w in loaded.warnings]
    answer({"ok": True, "faults": [], "warnings": warnings}, f"{spec}: no faults", as_json)


def schema(
    of: Annotated[str, typer.Option("--of", metavar="spec|column-map", help="Of which file.")] = "spec",
    as_json: AsJson = False,
) -> None:
    """Print the JSON Schema of the spec, or of a column map, for editors.

    Example: planner schema --of column-map > column_map.schema.json
    """
    from planner.recordings.map_schema import column_map_schema
    from planner.spec.schema import json_schema

    del as_json  # the schema is JSON in any case
    made = {"spec": json_schema, "column-map": column_map_schema}
    if of not in made:
        raise InputError(f"--of {of}: there is no schema of that; there are {', '.join(made)}")
    typer.echo(json.dumps(made[of](), indent=2, ensure_ascii=False))


def plan(
    spec: SpecFile,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="DIR", help="Folder [plans/<spec name>/].")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Plan the shortest campaign that suffices; writes plan.json, steps.csv and report.html.

    Example: planner plan requirements_specs/small_uav.yaml -o plans/small_uav
    """
    from planner.pipelines import planning as pipeline
    from planner.spec.load import load_spec

    loaded = load_spec(spec)
    with progress_line() as progress:
        planned = pipeline.plan(loaded, progress)
        progress("drawing the report")
        report = _report(planned, loaded)
        page = page_of(report)
    _delivered(planned.plan, report, page, out or Path("plans") / spec.stem, as_json)
    if not planned.plan.complete:
        typer.echo("stopped at plan.time_limit before the proof was complete: see bound_s and gap", err=True)
        raise typer.Exit(4)


def _report(planned: Planned, loaded: LoadedSpec) -> Report:
    from planner.report.subjects.plan import plan_report

    return plan_report(
        planned.plan,
        allowed=planned.allowed,
        sensitivities=planned.navigation.sensitivities,
        constraints=planned.navigation.constraints,
        spec_text=loaded.path.read_text(encoding="utf-8"),
        trajectory_name=planned.navigation.trajectory,
        service_life_s=loaded.spec.unit.service_life,
    )


def _delivered(made: Plan, report: Report, page: str, folder: Path, as_json: bool) -> None:
    """plan.json, steps.csv, report.html; notes and the answer."""
    from planner.export.formats.csv import steps_text
    from planner.export.json import plan_document, plan_text

    deliver(
        {
            folder / "plan.json": plan_text(made),
            folder / "steps.csv": steps_text(made),
            folder / "report.html": page,
        },
        made.notes,
        plan_document(made),
        report,
        as_json,
        f"wrote {folder / 'plan.json'}, steps.csv, report.html",
    )


def sensitivity(
    spec: SpecFile,
    trajectory: Annotated[
        Path | None, typer.Option(metavar="CSV", help="A flight from a file instead of the spec's.")
    ] = None,
    at: Annotated[
        str, typer.Option(metavar="TIME", help="end, a time such as '30 s', or any: the worst moment.")
    ] = "end",
    as_json: AsJson = False,
) -> None:
    """Print the linear-combination coefficients: navigation error per unit of every sensor error.

    Example: planner sensitivity spec.yaml --trajectory flight.csv --at '30 s' --json
    """
    from planner.export.sensitivities import sensitivity_document
    from planner.pipelines import planning as pipeline
    from planner.plan.spec_to_sensitivity import sensitivity_rows
    from planner.report.subjects.sensitivity import sensitivity_report
    from planner.spec.load import load_spec
    from planner.spec.own_units import own_units
    from planner.units import UnitError, to_si

    try:
        time = None if at in ("end", "any") else to_si(at, "s")
    except UnitError as error:
        raise InputError(f"--at: {error}; or end, or any") from None
    loaded = load_spec(spec)
    with progress_line() as progress:
        found = pipeline.sensitivity(loaded, trajectory, progress, at=time)
    rows = sensitivity_rows(found, at if time is None else time)  # type: ignore[arg-type]  # without a time, at is `end` or `any`
    result(sensitivity_document(rows), sensitivity_report(rows, own_units(loaded.spec)), as_json)


def allow(spec: SpecFile, as_json: AsJson = False) -> None:
    """Print the allowed sensor errors: Pareto set of the genetic algorithm, its corners, the exact optimum.

    Example: planner allow spec.yaml
    """
    from planner.export.allowances import allowed_document
    from planner.pipelines import planning as pipeline
    from planner.report.subjects.sensitivity import allowed_report
    from planner.spec.load import load_spec

    with progress_line() as progress:
        _, allowed = pipeline.allow(load_spec(spec), progress)
    result(allowed_document(allowed), allowed_report(allowed), as_json)


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
    from planner.export.documents import read_plan
    from planner.export.json_figures import json_text
    from planner.report.comparison import compare as compare_plans
    from planner.report.comparison import comparison_document
    from planner.report.subjects.compare import comparison_report

    if len(plans) < 2:
        raise InputError("compare needs two plans or more")
    found = compare_plans([read_plan(path) for path in plans])
    document, report = comparison_document(found), comparison_report(found)
    files: dict[Path, str | bytes] = {}
    if out is not None:
        files = {out / "comparison.json": json_text(document), out / "report.html": page_of(report)}
    deliver(files, (), document, report, as_json)
    if exit_code and found.differ:
        raise typer.Exit(1)


def why(
    plan: Annotated[Path, typer.Argument(metavar="PLAN", help="plan.json, or the folder that holds it.")],
    as_json: AsJson = False,
) -> None:
    """Say why a plan is as it is: what binds, what every visit buys, what changes are worth.

    Example: planner why plans/helicopter
    """
    from planner.export.documents import read_plan
    from planner.nouns.plan_file import PlanWhy, plan_part
    from planner.report.subjects.why import why_report

    found = plan_part(read_plan(plan), PlanWhy, str(plan))
    if not found.worth:
        raise InputError(
            f"{plan} is planned by the published method, which prices no record; "
            "plan with requirements of probability and plan.method: information"
        )
    result(found.model_dump(mode="json"), why_report(found), as_json)


def afford(
    spec: SpecFile,
    hours: Annotated[float, typer.Option("--hours", min=0.01, help="Hours that the campaign may take.")],
    as_json: AsJson = False,
) -> None:
    """Say what so many hours can keep: the least limits, and the grade of sensor that the limits need.

    Example: planner afford requirements_specs/helicopter.yaml --hours 8
    """
    from planner.pipelines import planning as pipeline
    from planner.report.subjects.afford import afford_document, afford_report
    from planner.spec.load import load_spec

    loaded = load_spec(spec)
    with progress_line() as progress:
        found = pipeline.afford(loaded, 3600.0 * hours, progress)
    result(afford_document(found, loaded.spec), afford_report(found, loaded.spec, hours), as_json)
