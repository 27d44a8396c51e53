"""The commands for units after the campaign, no arithmetic: accept, forecast, recalibrate."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from planner.commands.output import AsJson, SpecFile, console, listed, progress_line

SpecOption = Annotated[Path, typer.Option("--spec", metavar="SPEC", help="YAML spec.", show_default=False)]
PlanOption = Annotated[
    Path | None,
    typer.Option("--plan", metavar="PLAN", help="plan.json or its folder [planned now from the spec]."),
]
Folder = Annotated[
    Path | None, typer.Option("-o", "--out", metavar="DIR", help="Folder for the files [none are written].")
]
Today = Annotated[str | None, typer.Option(metavar="DATE", help="What counts as today, e.g. 2026-03-01.")]
Start = Annotated[
    str | None, typer.Option(metavar="DATE", help="Date of day 0, for histories that count days.")
]
Until = Annotated[str | None, typer.Option(metavar="DATE|DAYS", help="How far to look [365 days].")]
MethodName = Annotated[
    str,
    typer.Option(
        metavar="NAME",
        help="auto (best on rolling origins), naive, local_trend, structural, gaussian_process or neural.",
    ),
]
CorrectedBy = Annotated[
    str,
    typer.Option(
        metavar="WHAT",
        help="What the unit corrects: none (values are residuals), first or last value [auto: last for "
        "calibrations, else none].",
    ),
]


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    for command in (accept, forecast, recalibrate):
        app.command()(command)


def accept(
    data: Annotated[
        list[Path],
        typer.Argument(
            metavar="DATA|CALIBRATION…",
            help="Dwell tables of checks after calibration, calibration.json files or folders.",
            show_default=False,
        ),
    ],
    spec: SpecOption,
    plan: PlanOption = None,
    out: Folder = None,
    good_rejected: Annotated[
        float, typer.Option(metavar="PERCENT", help="Of good units, at most so many may be rejected.")
    ] = 5.0,
    bad_accepted: Annotated[
        float, typer.Option(metavar="PERCENT", help="Of bad units, at most so many may be accepted.")
    ] = 5.0,
    as_residual: Annotated[
        bool,
        typer.Option("--residual", help="Coefficients of calibrations are residuals: of corrected readings."),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Accept units: is the measured residual inside the plan's allowed region, all errors together?

    A unit is accepted, rejected, or undecided with the further power-ons that would decide it; the stated
    error rates hold for one decision. A check has corrected readings (`planner apply`) of records that
    the calibration has not seen. Of several calibrations of a unit the first corrects, and the last minus
    the first is the residual; one alone is judged by what its intervals leave. Exit 1 if any unit is
    rejected.

    Example: planner accept check.csv --spec spec.yaml --plan plans/spec -o accepted
    """
    from planner.export.documents import read_plan
    from planner.export.files import write_all_whole
    from planner.export.fleet import accept_document, fleet_text
    from planner.fleet.judge import ErrorRates
    from planner.pipelines import fleet as fleet_pipeline
    from planner.report.accept import accept_html, print_accepted
    from planner.spec.load import load_spec

    rates = ErrorRates(good_rejected / 100, bad_accepted / 100)
    loaded = load_spec(spec)
    document = None if plan is None else read_plan(plan)
    with progress_line() as say:
        found = fleet_pipeline.accept(data, loaded, document, rates, say, as_residual=as_residual)
    source = {"name": loaded.spec.name, "sha256": loaded.sha256}
    answer = accept_document(found.units, found.basis.region, rates, source, found.notes)
    if out is not None:
        page = accept_html(found.units, found.basis.region, rates, loaded.spec.name, found.notes)
        write_all_whole({out / "accept.json": fleet_text(answer), out / "report.html": page})
    for note in found.notes:
        typer.echo(f"note: {note}", err=True)
    if as_json:
        typer.echo(json.dumps(answer, ensure_ascii=False))
    else:
        print_accepted(found.units, found.basis.region, rates, console())
        if out is not None:
            typer.echo("\n" + listed([str(out / "accept.json"), str(out / "report.html")]))
    if any(u.verdict == "rejected" for u in found.units):
        raise typer.Exit(1)


def forecast(
    history: Annotated[
        list[str],
        typer.Argument(
            metavar="HISTORY…",
            help="CSV of a history, dwell tables with day, or calibration.json@DATE.",
            show_default=False,
        ),
    ],
    spec: SpecOption,
    plan: PlanOption = None,
    until: Until = None,
    method: MethodName = "auto",
    confidence: Annotated[
        float, typer.Option(metavar="PERCENT", help="Of the intervals and of the date.")
    ] = 95.0,
    corrected_by: CorrectedBy = "auto",
    start: Start = None,
    today: Today = None,
    out: Folder = None,
    as_json: AsJson = False,
) -> None:
    """Forecast drift in store: bias, drift, scale factor per channel, and the date of the next calibration.

    HISTORY is a CSV with one value a line: `unit, date (or day), error, term, value, uncertainty, event`,
    e.g. `u1,2026-03-01,gyro.bias,x,0.0021 deg/s,0.0004 deg/s,`; uncertainty (one sigma) and event
    (`repair`: the history starts anew there) may be absent. Or one column a coefficient:
    `unit,date,gyro.bias x [deg/s]`. Or calibrations, `calibration.json@2026-03-01`, or dwell tables with a
    column day.

    Example: planner forecast history.csv --spec spec.yaml --until 365 -o forecasts/fleet
    """
    from planner.export.documents import read_plan
    from planner.export.files import write_all_whole
    from planner.export.fleet import fleet_text, forecast_document
    from planner.export.fleet_calendar import calendar_bytes
    from planner.pipelines import fleet as fleet_pipeline
    from planner.report.forecast import appointments, forecast_html, print_forecast
    from planner.spec.load import load_spec

    options = fleet_pipeline.options_of(until, method, confidence, corrected_by, today, start)
    loaded = load_spec(spec)
    document = None if plan is None else read_plan(plan)
    with progress_line() as say:
        found = fleet_pipeline.forecast(history, loaded, document, options, say)
        fleet, region = found.fleet, found.basis.region
        answer = forecast_document(fleet, region, {"name": loaded.spec.name, "sha256": loaded.sha256})
        files: dict[Path, str | bytes] = {}
        if out is not None:
            say("drawing the report")
            files[out / "forecast.json"] = fleet_text(answer)
            files[out / "report.html"] = forecast_html(fleet, region, loaded.spec.name)
            days = appointments(fleet, region)
            if days:
                files[out / "calibrations.ics"] = calendar_bytes(f"{loaded.spec.name}: calibrations", days)
    write_all_whole(files)
    for note in fleet.notes:
        typer.echo(f"note: {note}", err=True)
    if as_json:
        typer.echo(json.dumps(answer, ensure_ascii=False))
    else:
        print_forecast(fleet, region, console())
        if files:
            typer.echo("\n" + listed([str(path) for path in files]))


def recalibrate(
    spec: SpecFile,
    history: Annotated[
        list[str] | None,
        typer.Option(metavar="FILE", help="History as for `planner forecast`; may be given several times."),
    ] = None,
    calibration: Annotated[
        list[str] | None,
        typer.Option(metavar="FILE@DATE", help="Earlier calibration.json; may be given several times."),
    ] = None,
    plan: PlanOption = None,
    until: Annotated[
        str | None,
        typer.Option(metavar="DATE|DAYS", help="How long the store must carry [recalibration.period]."),
    ] = None,
    method: MethodName = "auto",
    confidence: Annotated[float, typer.Option(metavar="PERCENT", help="Of what is renewed.")] = 95.0,
    corrected_by: CorrectedBy = "auto",
    start: Start = None,
    today: Today = None,
    out: Folder = None,
    as_json: AsJson = False,
) -> None:
    """Plan recalibrations in store: which coefficients they renew, and the schedule that costs least hours.

    The spec says under `recalibration` what may be done there: rests on the faces of the unit, turns by
    hand. Without a history the spec's storage says how the unit drifts. Exit 3 if the store cannot carry a
    unit so far.

    Example: planner recalibrate requirements_specs/recalibration.yaml --start 2026-12-01 -o store
    """
    from planner.export.documents import read_plan
    from planner.export.files import write_all_whole
    from planner.export.fleet import fleet_text
    from planner.export.fleet_calendar import calendar_bytes
    from planner.export.recalibration import recalibration_document
    from planner.pipelines import fleet as fleet_pipeline
    from planner.report.recalibration import (
        print_recalibration,
        recalibration_html,
        store_appointments,
        why_not,
    )
    from planner.spec.load import load_spec

    options = fleet_pipeline.options_of(until, method, confidence, corrected_by, today, start)
    loaded = load_spec(spec)
    document = None if plan is None else read_plan(plan)
    with progress_line() as say:
        found = fleet_pipeline.recalibrate(
            loaded, document, [*(history or ()), *(calibration or ())], options, say
        )
    source = {"name": loaded.spec.name, "sha256": loaded.sha256}
    answer = recalibration_document(found.plans, found.shortest, found.start, source, found.notes)
    files: dict[Path, str | bytes] = {}
    if out is not None:
        files[out / "recalibration.json"] = fleet_text(answer)
        files[out / "report.html"] = recalibration_html(found, loaded.spec.name)
        days = store_appointments(found)
        if days:
            files[out / "recalibrations.ics"] = calendar_bytes(f"{loaded.spec.name}: recalibrations", days)
    write_all_whole(files)
    for note in found.notes:
        typer.echo(f"note: {note}", err=True)
    if as_json:
        typer.echo(json.dumps(answer, ensure_ascii=False))
    else:
        print_recalibration(found, console())
        if files:
            typer.echo("\n" + listed([str(path) for path in files]))
    lacking = why_not(found)
    if lacking:
        typer.echo(f"error: {lacking}", err=True)
        raise typer.Exit(3)
