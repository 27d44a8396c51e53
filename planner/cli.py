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

INTERRUPTED = 130  # what typer returns for Ctrl-C


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
    if not (planned.plan.proved or planned.plan.work_proved):
        typer.echo("stopped at plan.time_limit before the proof was complete: see bound_s and gap", err=True)
        raise typer.Exit(4)


@app.command()
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
    from planner import pipeline
    from planner.export.sensitivities import sensitivity_document
    from planner.plan.spec_to_sensitivity import sensitivity_rows
    from planner.report.summary import print_sensitivities
    from planner.spec.load import load_spec
    from planner.units import UnitError, to_si

    try:
        time = None if at in ("end", "any") else to_si(at, "s")
    except UnitError as error:
        raise InputError(f"--at: {error}; or end, or any") from None
    with _progress() as progress:
        found = pipeline.sensitivity(load_spec(spec), trajectory, progress, at=time)
    rows = sensitivity_rows(found, at if time is None else time)  # type: ignore[arg-type]
    if as_json:
        typer.echo(json.dumps(sensitivity_document(rows)))
    else:
        print_sensitivities(rows, _console())


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


@app.command()
def export(
    plan: Annotated[
        Path, typer.Argument(metavar="PLAN", help="plan.json or its folder.", show_default=False)
    ],
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
    for note in made.notes:
        typer.echo(f"note: {note}", err=True)
    written = [str(path) for path in placed]
    _answer({"format": form, "written": written, "notes": list(made.notes)}, _listed(written), as_json)


def _listed(paths: list[str]) -> str:
    more = f"\nand {len(paths) - 10} more" if len(paths) > 10 else ""
    return "\n".join(f"wrote {path}" for path in paths[:10]) + more


@app.command()
def run(
    plan: Annotated[
        Path, typer.Argument(metavar="PLAN", help="plan.json or its folder.", show_default=False)
    ],
    table: Annotated[
        list[str] | None,
        typer.Option(metavar="RESOURCE", help="VISA resource of the table; BENCH=RESOURCE for several."),
    ] = None,
    chamber: Annotated[
        str | None, typer.Option(metavar="RESOURCE", help="VISA resource of the chamber.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check the limits and print what would be sent.")
    ] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Go on where the journal ends.")] = False,
    journal: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Journal [run.jsonl beside the plan].")
    ] = None,
    recorder: Annotated[
        str | None,
        typer.Option(metavar="COMMAND", help="Program called with power_on, start, stop, void, power_off."),
    ] = None,
    unattended: Annotated[
        bool, typer.Option("--unattended", help="Wait the planned time instead of asking somebody.")
    ] = False,
    arm: Annotated[
        float | None, typer.Option(metavar="METRES", help="Arm of a centrifuge that the plan does not know.")
    ] = None,
    travel: Annotated[
        list[str] | None, typer.Option(metavar="AXIS=LEAST..MOST", help="Stops of an axis in deg.")
    ] = None,
    baud: Annotated[int, typer.Option(metavar="BAUD", help="Of serial resources.")] = 19200,
    speed: Annotated[
        float | None, typer.Option(metavar="FACTOR", help="Simulators only: waits are shorter by this.")
    ] = None,
    clock_port: Annotated[
        int | None, typer.Option(metavar="PORT", help="Simulators only: bench-simulator's clock.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Execute a plan on a bench over PyVISA; every finished step goes to a journal.

    Example: planner run plans/small_uav --table TCPIP::192.168.0.10::5025::SOCKET --chamber ASRL1::INSTR
    """
    from planner.export.documents import read_sealed_plan
    from planner.export.plan_schema import typed_plan
    from planner.run import session
    from planner.run.job import job_from

    document = read_sealed_plan(plan)
    typed_plan(document)
    if arm is not None and not 0 < arm < 1000:
        raise InputError(f"--arm must be a length in metres, not {arm:g}")
    job = job_from(document, arm_m=arm, travel=session.travel_from(travel or ()))
    request = session.Request(
        tables=tuple(table or ()),
        chamber=chamber,
        journal=journal or (plan if plan.is_dir() else plan.parent) / "run.jsonl",
        resume=resume,
        unattended=unattended,
        recorder=recorder,
        speed=speed,
        clock_port=clock_port,
        baud=baud,
    )
    if dry_run:
        session.rehearse(job, request, typer.echo)
        return
    with _progress() as progress:
        done = session.run(
            job, request, lambda text: typer.echo(text, err=True), lambda step: progress(f"making {step.id}")
        )
    _answer(
        vars(done) | {"journal": str(request.journal)},
        f"made {done.steps} steps, {done.records} of them records, in {done.seconds / 3600:.2f} h; "
        f"journal: {request.journal}",
        as_json,
    )


@app.command("bench-simulator")
def bench_simulator(
    table_port: Annotated[int, typer.Option(min=0, max=65535, help="0: any free port.")] = 0,
    chamber_port: Annotated[int, typer.Option(min=0, max=65535, help="0: any free port.")] = 0,
    clock_port: Annotated[int, typer.Option(min=0, max=65535, help="0: any free port.")] = 0,
    host: Annotated[str, typer.Option(help="An address of this machine, no other.")] = "127.0.0.1",
    axes: Annotated[int, typer.Option(min=1, max=6, help="How many axes the table has.")] = 3,
    speed: Annotated[
        float, typer.Option(metavar="FACTOR", help="Its seconds per second, while nobody moves its clock.")
    ] = 1.0,
    fault: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME@N", help="At the N-th message: lost_reply@9, chamber.never_settles@3 …"),
    ] = None,
    log: Annotated[Path | None, typer.Option(metavar="FILE", help="Every message, as JSON lines.")] = None,
    as_json: AsJson = False,
) -> None:
    """Simulate a rate table and a chamber on TCP ports of this machine, until Ctrl-C.

    Example: planner bench-simulator --table-port 5025 --chamber-port 5026 --clock-port 5027
    """
    from planner.simulator.faults import fault_from_text
    from planner.simulator.serve import serve
    from planner.simulator.server import Ports, SimulatedBench

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
        lambda document, text: _answer(document, text, as_json),
    )


def main() -> None:
    """Run the program; every error ends it with its own exit code and no traceback."""
    try:
        code = app(standalone_mode=False) or 0
        if code == INTERRUPTED:
            raise KeyboardInterrupt
    except SystemExit:
        sys.exit(0)  # typer and rich end like this when the reader of our output has gone
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
    sys.exit(code)


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
