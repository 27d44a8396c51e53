"""The commands, no arithmetic: each reads its arguments, calls the pipeline and writes what comes back."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planner.errors import InfeasibleError, InputError, PlannerError

if TYPE_CHECKING:
    from rich.console import Console

app = typer.Typer(
    name="planner",
    help="The shortest calibration campaign of an inertial unit that provably suffices for its navigation.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

SpecFile = Annotated[Path, typer.Argument(metavar="SPEC", help="YAML spec.", show_default=False)]
AsJson = Annotated[bool, typer.Option("--json", help="Machine-readable result on stdout.")]


@app.callback(invoke_without_command=True)
def root(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    """Plan calibration campaigns of inertial units.

    Example: planner init spec.yaml && planner plan spec.yaml
    """
    if version:
        from planner import __version__

        typer.echo(__version__)
        raise typer.Exit()


@app.command()
def init(
    file: Annotated[Path | None, typer.Argument(metavar="[FILE]", help="Where to write it.")] = None,
    as_json: AsJson = False,
) -> None:
    """Write a commented starter spec that plans as it stands.

    Example: planner init spec.yaml
    """
    from planner.export.files import write_whole
    from planner.spec.starter import starter_text

    target = file or Path("spec.yaml")
    if target.exists():
        raise InputError(f"{target} exists already; give another name")
    write_whole(target, starter_text())
    _answer({"written": str(target)}, f"wrote {target}; next: planner plan {target}", as_json)


@app.command()
def check(spec: SpecFile, as_json: AsJson = False) -> None:
    """Validate a spec: every fault at once, each with file:line:column.

    Example: planner check spec.yaml
    """
    from planner.spec.load import load_spec

    loaded = load_spec(spec)
    warnings = [str(w) for w in loaded.warnings]
    for warning in warnings:
        typer.echo(f"warning: {warning}", err=True)
    _answer({"ok": True, "faults": [], "warnings": warnings}, f"{spec}: no faults", as_json)


@app.command()
def schema(as_json: AsJson = False) -> None:
    """Print the JSON Schema of the spec, for editors.

    Example: planner schema > spec.schema.json
    """
    from planner.spec.schema import json_schema

    del as_json  # the schema is JSON in any case
    typer.echo(json.dumps(json_schema(), indent=2, ensure_ascii=False))


@app.command()
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
    from planner import pipeline
    from planner.export.csv import steps_text
    from planner.export.files import write_all_whole
    from planner.export.json import plan_document, plan_text
    from planner.report.html import report_html
    from planner.report.summary import print_summary
    from planner.spec.load import load_spec

    loaded = load_spec(spec)
    folder = out or Path("plans") / spec.stem
    with _progress() as progress:
        planned = pipeline.plan(loaded, progress)
        progress("drawing the report")
        report = report_html(
            planned.plan,
            allowed=planned.allowed,
            sensitivities=planned.navigation.sensitivities,
            constraints=planned.navigation.constraints,
            spec_text=spec.read_text(encoding="utf-8"),
            trajectory_name=planned.navigation.trajectory,
            service_life_s=loaded.spec.unit.service_life,
        )
    write_all_whole(
        {
            folder / "plan.json": plan_text(planned.plan),
            folder / "steps.csv": steps_text(planned.plan),
            folder / "report.html": report,
        }
    )
    for note in planned.plan.notes:
        typer.echo(f"note: {note}", err=True)
    if as_json:
        typer.echo(json.dumps(plan_document(planned.plan), ensure_ascii=False))
    else:
        print_summary(planned.plan, _console())
        typer.echo(f"\nwrote {folder / 'plan.json'}, steps.csv, report.html")
    if not planned.plan.proved:
        typer.echo("stopped at plan.time_limit before the proof was complete: see bound_s and gap", err=True)
        raise typer.Exit(4)


@app.command()
def sensitivity(
    spec: SpecFile,
    trajectory: Annotated[
        Path | None, typer.Option(metavar="CSV", help="A flight from a file instead of the spec's.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Print the linear-combination coefficients at the end of the flight.

    Example: planner sensitivity spec.yaml --trajectory flight.csv --json
    """
    from planner import pipeline
    from planner.export.sensitivities import sensitivity_document
    from planner.plan.spec_to_sensitivity import sensitivity_rows
    from planner.report.summary import print_sensitivities
    from planner.spec.load import load_spec

    with _progress() as progress:
        found = sensitivity_rows(pipeline.sensitivity(load_spec(spec), trajectory, progress))
    if as_json:
        typer.echo(json.dumps(sensitivity_document(found)))
    else:
        print_sensitivities(found, _console())


@app.command()
def allow(spec: SpecFile, as_json: AsJson = False) -> None:
    """Print the allowed sensor errors: Pareto set of the genetic algorithm, its corners, the exact optimum.

    Example: planner allow spec.yaml
    """
    from planner import pipeline
    from planner.export.allowances import allowed_document
    from planner.report.summary import print_allowed
    from planner.spec.load import load_spec

    with _progress() as progress:
        _, allowed = pipeline.allow(load_spec(spec), progress)
    if as_json:
        typer.echo(json.dumps(allowed_document(allowed)))
    else:
        print_allowed(allowed, _console())


@app.command()
def compare(
    plans: Annotated[list[Path], typer.Argument(metavar="PLAN PLAN…", help="plan.json files or folders.")],
    exit_code: Annotated[bool, typer.Option("--exit-code", help="Exit 1 when the plans differ.")] = False,
    as_json: AsJson = False,
) -> None:
    """Compare plans: hours by bench, test and action, what differs and why.

    Example: planner compare plans/published_one_bench plans/published_optimum
    """
    from planner.export.documents import read_plan
    from planner.report.compare import compare as compare_plans
    from planner.report.compare import comparison_document, print_comparison

    if len(plans) < 2:
        raise InputError("compare needs two plans or more")
    found = compare_plans([read_plan(path) for path in plans])
    if as_json:
        typer.echo(json.dumps(comparison_document(found), ensure_ascii=False))
    else:
        print_comparison(found, _console())
    if exit_code and found.differ:
        raise typer.Exit(1)


def main() -> None:
    """Run the program; every error ends it with its own exit code and no traceback."""
    try:
        sys.exit(app(standalone_mode=False) or 0)
    except PlannerError as error:
        _complain(error)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        typer.echo("stopped", err=True)
        sys.exit(4)
    except BrokenPipeError:
        sys.stderr.close()  # the reader of our output has gone; nothing is left to say
        sys.exit(0)
    except Exception as error:
        _usage_or_internal(error)


def _usage_or_internal(error: Exception) -> None:
    """Typer's own usage errors exit 2; anything else is a fault of ours: exit 70 and say how to report it."""
    show = getattr(error, "show", None)
    if callable(show):
        show()
        sys.exit(2)
    if type(error).__name__ == "Abort":
        sys.exit(4)
    typer.echo(f"internal error: {type(error).__name__}: {error}; set PLANNER_DEBUG=1 for details", err=True)
    if os.environ.get("PLANNER_DEBUG"):
        raise error
    sys.exit(70)


def _complain(error: PlannerError) -> None:
    """Say what is wrong on stderr, and as JSON on stdout when the caller asked for that."""
    typer.echo(f"error: {error}", err=True)
    if "--json" in sys.argv:
        typer.echo(json.dumps(_error_document(error), ensure_ascii=False))


def _error_document(error: PlannerError) -> dict[str, Any]:
    document: dict[str, Any] = {"error": str(error), "exit_code": error.exit_code}
    if isinstance(error, InputError):
        document["faults"] = [vars(fault) | {"text": str(fault)} for fault in error.faults]
    if isinstance(error, InfeasibleError):
        document["binds"] = [{"part": part, "share": share} for part, share in error.binds]
        document["nearest_limit"] = error.nearest_limit
    return document


def _answer(document: dict[str, Any], text: str, as_json: bool) -> None:
    typer.echo(json.dumps(document, ensure_ascii=False) if as_json else text)


def _console() -> Console:
    from rich.console import Console

    return Console(highlight=False, soft_wrap=not sys.stdout.isatty())


@contextmanager
def _progress() -> Iterator[Any]:
    """A line that says what is being done, on stderr, only on a terminal."""
    if not sys.stderr.isatty() or "NO_COLOR" in os.environ:
        yield lambda message: None
        return
    from rich.console import Console

    with Console(stderr=True).status("starting") as status:
        yield lambda message: status.update(message)
