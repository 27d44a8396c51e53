"""The commands for measured data, no arithmetic: simulate, calibrate, apply."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from planner.commands.output import AsJson, answer, console, listed, progress_line

Hidden = Annotated[
    list[str] | None,
    typer.Option(metavar="EFFECT=VALUE", help="An undeclared effect; may be given several times."),
]
Latitude = Annotated[float, typer.Option(min=-90.0, max=90.0, metavar="DEG", help="Of the bench.")]


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    for command in (simulate, calibrate, apply):
        app.command()(command)


def simulate(
    spec: Annotated[Path, typer.Argument(metavar="SPEC", help="YAML spec.", show_default=False)],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DATA", help="Dwell table to write.")],
    plan: Annotated[
        Path | None, typer.Option(metavar="PLAN", help="plan.json or its folder [the spec's tests].")
    ] = None,
    hidden: Hidden = None,
    seed: Annotated[int, typer.Option(min=0, help="Of every random number.")] = 1,
    case: Annotated[
        str, typer.Option(metavar="random|worst", help="Sizes within the budget, or all of it.")
    ] = "random",
    signs: Annotated[str, typer.Option(metavar="random|plus", help="Signs of the errors.")] = "random",
    temperature_error: Annotated[
        float, typer.Option(min=0.0, max=50.0, metavar="KELVIN", help="One sigma of the unit's thermometer.")
    ] = 0.0,
    spikes: Annotated[
        float, typer.Option(min=0.0, max=1.0, metavar="SHARE", help="Of readings that are 40 sigma off.")
    ] = 0.0,
    latitude: Latitude = 45.0,
    as_json: AsJson = False,
) -> None:
    """Simulate the bench campaign of a plan, with any undeclared effects; truth beside the data.

    Example: planner simulate spec.yaml --plan plans/spec --hidden g_sensitivity=0.01deg/s/g -o data.csv
    """
    from planner.export.documents import read_plan
    from planner.export.files import write_whole
    from planner.export.truth import truth_text
    from planner.learn.dwell_files import write_dwells
    from planner.pipelines import data as data_pipeline
    from planner.simulate.campaign import settings_of
    from planner.spec.load import load_spec

    settings = settings_of(case, signs, temperature_error, spikes)
    document = None if plan is None else read_plan(plan)
    table, truth = data_pipeline.simulate(load_spec(spec), document, hidden or (), seed, settings, latitude)
    write_dwells(table, out)
    beside = out.parent / "truth.json"
    write_whole(beside, truth_text(truth))
    runs = len(set(table.run.tolist()))
    answer(
        {"written": [str(out), str(beside)], "rows": len(table), "runs": runs},
        f"wrote {out}, {len(table)} records of {runs} power-ons, and {beside}",
        as_json,
    )


def calibrate(
    data: Annotated[Path, typer.Argument(metavar="DATA", help="Dwell table.", show_default=False)],
    spec: Annotated[Path, typer.Option("--spec", metavar="SPEC", help="YAML spec.", show_default=False)],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="DIR", help="Folder [calibrations/<data name>/].")
    ] = None,
    method: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="declared_effects, free_orientations, cube, triad_least_squares, six_position_gyro, "
            "six_position_accelerometer or scale_factor_rotations.",
        ),
    ] = "declared_effects",
    robust: Annotated[str, typer.Option(metavar="no|huber|bisquare", help="Resist outliers.")] = "no",
    latitude: Annotated[
        float | None, typer.Option(min=-90.0, max=90.0, metavar="DEG", help="Of the bench.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Fit the declared error model: coefficients with uncertainties, before and after, files for firmware.

    Example: planner calibrate data.csv --spec spec.yaml -o calibrations/data
    """
    from planner.export.calibration import calibration_document
    from planner.export.calibration_files import calibration_files
    from planner.export.files import write_all_whole
    from planner.learn.methods import fit_options
    from planner.pipelines import data as data_pipeline
    from planner.report.calibration import print_calibration
    from planner.spec.load import load_spec

    options = fit_options(method, robust, latitude)
    with progress_line() as say:
        found = data_pipeline.calibrate(data, load_spec(spec), options, say)
    files = calibration_files(found, out or Path("calibrations") / data.stem)
    write_all_whole(files)
    for note in (note for calibration in found for note in calibration.notes):
        typer.echo(f"note: {note}", err=True)
    if as_json:
        documents = [calibration_document(calibration) for calibration in found]
        typer.echo(json.dumps(documents[0] if len(found) == 1 else {"units": documents}, ensure_ascii=False))
    else:
        print_calibration(found, console())
        typer.echo("\n" + listed([str(path) for path in files]))


def apply(
    calibration: Annotated[
        Path,
        typer.Argument(metavar="CALIBRATION", help="calibration.json or its folder.", show_default=False),
    ],
    raw: Annotated[Path, typer.Argument(metavar="RAW", help="Recording or dwell table.", show_default=False)],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="OUT", help="Corrected CSV to write.")],
    columns: Annotated[
        Path | None, typer.Option(metavar="MAP.yaml", help="Which column of a recording is what.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Correct a recording, or a dwell table, with a calibration.

    Example: planner apply calibrations/data recording.csv -o corrected.csv
    """
    from planner.pipelines import data as data_pipeline

    rows, notes = data_pipeline.apply(calibration, raw, out, columns)
    for note in notes:
        typer.echo(f"note: {note}", err=True)
    answer({"written": str(out), "rows": rows, "notes": notes}, f"wrote {out}, {rows} rows", as_json)
