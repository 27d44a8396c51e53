"""The commands that close the loop, no arithmetic: diagnose, update."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planner.commands.output import AsJson, SpecFile, console, listed, progress_line
from planner.errors import InputError

if TYPE_CHECKING:
    from planner.pipelines.diagnosis import Diagnosed, Replanned


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    for command in (diagnose, update):
        app.command()(command)


def diagnose(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Dwell table.", show_default=False)],
    spec: Annotated[Path, typer.Option("--spec", metavar="SPEC", help="YAML spec.", show_default=False)],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="DIR", help="Folder [diagnoses/<data name>/].")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of every random number.")] = 1,
    as_json: AsJson = False,
) -> None:
    """Find what the declared error model lacks; writes diagnosis.json and report.html.

    Residual, missing effect, error before and after on runs that the fit has not seen, cost in flight, what
    to measure next. Exit 0 also when nothing is missing. Several units in one table have a folder each.

    Example: planner diagnose data.csv --spec spec.yaml -o diagnoses/data
    """
    from planner.export.diagnosis import diagnosis_document
    from planner.export.files import write_all_whole
    from planner.pipelines import diagnosis as pipeline
    from planner.report.diagnosis import print_diagnosis
    from planner.spec.load import load_spec

    loaded = load_spec(spec)
    with progress_line() as progress:
        found = pipeline.diagnose(data, loaded, seed, progress)
        progress("drawing the report")
        files = _files(found, out or Path("diagnoses") / data.stem)
    write_all_whole(files)
    for note in (note for each in found for note in (*each.diagnosis.notes, *each.diagnosis.found.notes)):
        typer.echo(f"note: {note}", err=True)
    documents = [diagnosis_document(each.diagnosis) for each in found]
    if as_json:
        typer.echo(json.dumps(documents[0] if len(found) == 1 else {"units": documents}, ensure_ascii=False))
    else:
        print_diagnosis([each.diagnosis for each in found], console())
        typer.echo("\n" + listed([str(path) for path in files]))


def _files(found: tuple[Diagnosed, ...], folder: Path) -> dict[Path, str | bytes]:
    """diagnosis.json and report.html; several units have a folder each, of their name."""
    from planner.export.calibration_files import folder_name
    from planner.export.diagnosis import diagnosis_text
    from planner.report.diagnosis import diagnosis_html

    files: dict[Path, str | bytes] = {}
    for each in found:
        place = folder if len(found) == 1 else folder / folder_name(each.diagnosis.found.unit)
        if place / "diagnosis.json" in files:
            raise InputError(f"two units would both write {place}; give them names that differ in letters")
        files[place / "diagnosis.json"] = diagnosis_text(each.diagnosis)
        files[place / "report.html"] = diagnosis_html(each.diagnosis, each.table)
    return files


def update(
    spec: SpecFile,
    diagnosis: Annotated[
        Path, typer.Option(metavar="FILE", help="diagnosis.json or its folder.", show_default=False)
    ],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="SPEC2", help="New spec to write.")],
    plan: Annotated[bool, typer.Option("--plan/--no-plan", help="Plan both specs and compare.")] = True,
    as_json: AsJson = False,
) -> None:
    """Declare in the spec what the diagnosis found: effects, budgets, the tests that calibrate them.

    Comments and layout of the spec stay; the old spec's digest stands in a comment. Prints the difference,
    then hours and metres of both plans.

    Example: planner update spec.yaml --diagnosis diagnoses/data/diagnosis.json -o spec2.yaml
    """
    from planner.export.diagnosis import read_diagnosis
    from planner.export.files import write_whole
    from planner.pipelines import diagnosis as pipeline
    from planner.report.update import print_update, update_document
    from planner.spec.load import load_spec

    if out.resolve() == spec.resolve():
        raise InputError(f"{out} is the old spec, which the diagnosis is of; give the new one another name")
    found = read_diagnosis(diagnosis)
    made, loaded = pipeline.update(spec, found, out)
    write_whole(out, made.text)
    for note in (*made.notes, *map(str, loaded.warnings)):
        typer.echo(f"note: {note}", err=True)
    plans: Replanned | None = None
    if plan:
        with progress_line() as progress:
            plans = pipeline.replanned(load_spec(spec), loaded, progress)
    if as_json:
        document: dict[str, Any] = update_document(made, plans, found)
        typer.echo(json.dumps({"written": str(out), **document}, ensure_ascii=False))
    else:
        print_update(made, plans, found, console())
        typer.echo(f"\nwrote {out}; next: planner plan {out}")
