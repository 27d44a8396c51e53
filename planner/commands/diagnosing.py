"""The commands that close the loop, no arithmetic: diagnose, update."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planner.commands.options import AsJson, DataTable, Seed, SpecFile, SpecOption
from planner.commands.output import deliver, notes, of_units, page_of, progress_line, result
from planner.errors import InputError

if TYPE_CHECKING:
    from planner.pipelines.diagnosing import Diagnosed, Replanned
    from planner.report.blocks import Report


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    for command in (diagnose, update):
        app.command()(command)


def diagnose(
    data: DataTable,
    spec: SpecOption,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="DIR", help="Folder [diagnoses/<data name>/].")
    ] = None,
    plan: Annotated[
        Path | None,
        typer.Option(metavar="PLAN", help="plan.json or its folder: what a flight then comes to in all."),
    ] = None,
    seed: Seed = 1,
    as_json: AsJson = False,
) -> None:
    """Find what the declared error model lacks; writes diagnosis.json and report.html.

    Residual, missing effect, error before and after on runs that the fit has not seen, cost in flight, what
    to measure next. Exit 0 also when nothing is missing. Several units in one table have a folder each.

    Example: planner diagnose data.csv --spec spec.yaml -o diagnoses/data
    """
    from planner.export.diagnosis_json import diagnosis_document
    from planner.export.documents import read_plan
    from planner.pipelines import diagnosing as pipeline
    from planner.report.subjects.diagnosis import diagnosis_report
    from planner.spec.sensor_alone import load_sensor_spec

    loaded = load_sensor_spec(spec)
    with progress_line() as progress:
        found = pipeline.diagnose(data, loaded, seed, progress, None if plan is None else read_plan(plan))
        progress("drawing the report")
        reports = [diagnosis_report(each.diagnosis, each.table) for each in found]
        files = _files(found, reports, out or Path("diagnoses") / data.stem)
    diagnoses = [each.diagnosis for each in found]
    deliver(
        files,
        [note for each in diagnoses for note in (*each.notes, *each.found.notes)],
        of_units([diagnosis_document(each) for each in diagnoses]),
        reports,
        as_json,
    )


def _files(found: Sequence[Diagnosed], reports: Sequence[Report], folder: Path) -> dict[Path, str | bytes]:
    """diagnosis.json and report.html; several units have a folder each, of their name."""
    from planner.export.calibration_files import unit_folders
    from planner.export.diagnosis_json import diagnosis_text

    files: dict[Path, str | bytes] = {}
    places = unit_folders(folder, [each.diagnosis.found.unit for each in found])
    for each, report, place in zip(found, reports, places, strict=True):
        if place / "diagnosis.json" in files:
            raise InputError(f"two units would both write {place}; give them names that differ in letters")
        files[place / "diagnosis.json"] = diagnosis_text(each.diagnosis)
        files[place / "report.html"] = page_of(report)
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
    from planner.export.diagnosis_json import read_diagnosis
    from planner.pipelines import diagnosing as pipeline
    from planner.report.subjects.update import update_document, update_report
    from planner.spec.load import load_spec
    from planner.whole_files import write_whole

    if out.resolve() == spec.resolve():
        raise InputError(f"{out} is the old spec, which the diagnosis is of; give the new one another name")
    found = read_diagnosis(diagnosis)
    made, loaded = pipeline.update(spec, found, out)
    write_whole(out, made.text)
    notes([*made.notes, *map(str, loaded.warnings)])
    plans: Replanned | None = None
    if plan:
        with progress_line() as progress:
            plans = pipeline.replanned(load_spec(spec), loaded, progress)
    result(
        {"written": str(out), **update_document(made, plans, found)},
        update_report(made, plans, found),
        as_json,
        f"wrote {out}; next: planner plan {out}",
    )
