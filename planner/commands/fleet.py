"""The commands for units after the campaign, no arithmetic: accept, forecast, recalibrate."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planner.commands.options import AsJson, SpecFile, SpecOption
from planner.commands.output import deliver, page_of, progress_line

if TYPE_CHECKING:
    from planner.fleet.basis import Recalibrated
    from planner.fleet.judge import ErrorRates
    from planner.pipelines.fleet import Forecasted
    from planner.report.blocks import Report
    from planner.spec.load import LoadedSpec

PlanOption = Annotated[
    Path | None,
    typer.Option("--plan", metavar="PLAN", help="plan.json or its folder [planned now from the spec]."),
]
Folder = Annotated[
    Path | None, typer.Option("-o", "--out", metavar="DIR", help="Folder for the files [none are written].")
]
Checks = Annotated[
    list[Path] | None,
    typer.Argument(
        metavar="DATA|CALIBRATION…",
        help="Dwell tables of checks after calibration, calibration.json files or folders.",
        show_default=False,
    ),
]
GoodRejected = Annotated[
    float, typer.Option(metavar="PERCENT", help="Of good units, at most so many may be rejected.")
]
BadAccepted = Annotated[
    float, typer.Option(metavar="PERCENT", help="Of bad units, at most so many may be accepted.")
]
PlanCheck = Annotated[
    bool,
    typer.Option("--plan-check", help="Plan the check instead: also a bare `--plan`, or no DATA."),
]
AtLoad = Annotated[
    float, typer.Option("--load", metavar="PERCENT", help="Of the limit: the unit that a check must decide.")
]
Decided = Annotated[
    float, typer.Option("--decided", metavar="PERCENT", help="Of such units, so many must be decided.")
]
Looks = Annotated[
    int | None,
    typer.Option(
        "--looks",
        metavar="N",
        min=1,
        max=200,
        help="Look after every power-on and stop at the first decision; N: power-ons that were planned.",
    ),
]
AsResidual = Annotated[
    bool,
    typer.Option("--residual", help="Coefficients of calibrations are residuals: of corrected readings."),
]
Histories = Annotated[
    list[str],
    typer.Argument(
        metavar="HISTORY…",
        help="CSV of a history, dwell tables with day, or calibration.json@DATE.",
        show_default=False,
    ),
]
HistoryOption = Annotated[
    list[str] | None,
    typer.Option(metavar="FILE", help="History as for `planner forecast`; may be given several times."),
]
Earlier = Annotated[
    list[str] | None,
    typer.Option(metavar="FILE@DATE", help="Earlier calibration.json; may be given several times."),
]
Today = Annotated[str | None, typer.Option(metavar="DATE", help="What counts as today, e.g. 2026-03-01.")]
Start = Annotated[
    str | None, typer.Option(metavar="DATE", help="Date of day 0, for histories that count days.")
]
Until = Annotated[
    str | None, typer.Option(metavar="DATE|DAYS", help="How far to look, from today [365 days].")
]
Carried = Annotated[
    str | None,
    typer.Option(metavar="DATE|DAYS", help="How long the store must carry [recalibration.period]."),
]
OfIntervals = Annotated[float, typer.Option(metavar="PERCENT", help="Of the intervals and of the date.")]
OfRenewed = Annotated[float, typer.Option(metavar="PERCENT", help="Of what is renewed.")]
MethodName = Annotated[
    str,
    typer.Option(
        metavar="NAME",
        help="auto (hierarchical: one model of the type), naive, local_trend, structural, gaussian_process "
        "or neural.",
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
    spec: SpecOption,
    data: Checks = None,
    plan: PlanOption = None,
    plan_check: PlanCheck = False,
    load: AtLoad = 90.0,
    decided: Decided = 90.0,
    looks: Looks = None,
    out: Folder = None,
    good_rejected: GoodRejected = 5.0,
    bad_accepted: BadAccepted = 5.0,
    as_residual: AsResidual = False,
    as_json: AsJson = False,
) -> None:
    """Accept units: is the measured residual inside the plan's allowed region, all errors together?

    A unit is accepted, rejected, or undecided with the further power-ons that would decide it; the stated
    error rates hold for one decision. A check has corrected readings (`planner apply`) of records that
    the calibration has not seen. Of several calibrations of a unit the first corrects, and the last minus
    the first is the residual; one alone is judged by what its intervals leave. Exit 1 if any unit is
    rejected.

    `accept --plan` without a plan, or without DATA, plans the check: the cheapest temperatures, faces and
    power-ons that decide a unit at a given load, and when it may stop (`--looks`).

    Example: planner accept --spec spec.yaml --plan --load 95

    Example: planner accept check.csv --spec spec.yaml --plan plans/spec -o accepted
    """
    from planner.export.fleet import accept_document
    from planner.export.json_figures import json_text
    from planner.fleet.judge import ErrorRates
    from planner.pipelines import fleet as pipeline
    from planner.report.subjects.accept import accept_report

    rates = ErrorRates(good_rejected / 100, bad_accepted / 100)
    loaded, planned = _read(spec, plan)
    if plan_check or not data:
        _plan_check(loaded, planned, (load / 100, decided / 100), rates, out, as_json)
        return
    with progress_line() as say:
        found = pipeline.accept(data, loaded, planned, rates, say, as_residual=as_residual, looks=looks)
    units, region = found.units, found.basis.region
    report = accept_report(units, region, rates, loaded.spec.name, found.notes)
    document = accept_document(units, region, rates, _source(loaded), found.notes)
    files: dict[Path, str | bytes] = {}
    if out is not None:
        files[out / "accept.json"] = json_text(document)
        files[out / "report.html"] = page_of(report)
    deliver(files, found.notes, document, report, as_json)
    if any(u.verdict == "rejected" for u in units):
        raise typer.Exit(1)


def _plan_check(
    loaded: LoadedSpec,
    planned: dict[str, Any] | None,
    asked: tuple[float, float],
    rates: ErrorRates,
    out: Path | None,
    as_json: bool,
) -> None:
    from planner.export.fleet import checks_document
    from planner.export.json_figures import json_text
    from planner.pipelines import fleet as pipeline
    from planner.report.subjects.check_plan import checks_report

    with progress_line() as say:
        found = pipeline.plan_check(loaded, planned, *asked, rates, say)
    report = checks_report(found.checks, rates, loaded.spec.name, found.basis.notes)
    document = checks_document(found.checks, rates, _source(loaded), found.basis.notes)
    files: dict[Path, str | bytes] = {}
    if out is not None:
        files[out / "check_plan.json"] = json_text(document)
        files[out / "report.html"] = page_of(report)
    deliver(files, found.basis.notes, document, report, as_json)


def forecast(
    history: Histories,
    spec: SpecOption,
    plan: PlanOption = None,
    until: Until = None,
    method: MethodName = "auto",
    confidence: OfIntervals = 95.0,
    corrected_by: CorrectedBy = "auto",
    start: Start = None,
    today: Today = None,
    out: Folder = None,
    as_json: AsJson = False,
) -> None:
    """Forecast drift in store: bias, drift, scale factor per channel, and the date of the next calibration.

    HISTORY is a CSV with one value a line: `unit, date (or day), error, term, value, uncertainty, event`,
    e.g. `u1,2026-03-01,gyro.bias,x,0.0021 deg/s,0.0004 deg/s,`; uncertainty (one sigma), event
    (`repair`, `replacement`, `recalibration`: the history starts anew there; other words are remarks) may be
    absent. Or one column a coefficient:
    `unit,date,gyro.bias x [deg/s]`. Or calibrations, `calibration.json@2026-03-01`, or dwell tables with a
    column day.

    Example: planner forecast history.csv --spec spec.yaml --until 365 -o forecasts/fleet
    """
    from planner.export.fleet import forecast_document
    from planner.pipelines import fleet as pipeline
    from planner.report.subjects.forecast import forecast_report

    options = pipeline.options_of(until, method, confidence, corrected_by, today, start)
    loaded, planned = _read(spec, plan)
    with progress_line() as say:
        found = pipeline.forecast(history, loaded, planned, options, say)
        fleet, region = found.fleet, found.basis.region
        document = forecast_document(fleet, region, _source(loaded))
        report = forecast_report(fleet, region, loaded.spec.name)
        files: dict[Path, str | bytes] = {}
        if out is not None:
            say("drawing the report")
            files = _forecast_files(found, document, report, out)
    deliver(files, fleet.notes, document, report, as_json)


def _forecast_files(
    found: Forecasted, document: dict[str, Any], report: Report, folder: Path
) -> dict[Path, str | bytes]:
    from planner.export.fleet_calendar import calendar_bytes
    from planner.export.json_figures import json_text
    from planner.report.subjects.forecast import appointments

    fleet, region = found.fleet, found.basis.region
    files: dict[Path, str | bytes] = {
        folder / "forecast.json": json_text(document),
        folder / "report.html": page_of(report),
    }
    days = appointments(fleet, region)
    if days:
        files[folder / "calibrations.ics"] = calendar_bytes(f"{report.title}: calibrations", days)
    return files


def recalibrate(
    spec: SpecFile,
    history: HistoryOption = None,
    calibration: Earlier = None,
    plan: PlanOption = None,
    until: Carried = None,
    method: MethodName = "auto",
    confidence: OfRenewed = 95.0,
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
    from planner.export.recalibration_json import recalibration_document
    from planner.pipelines import fleet as pipeline
    from planner.report.subjects.recalibration import recalibration_report, why_not

    options = pipeline.options_of(until, method, confidence, corrected_by, today, start)
    loaded, planned = _read(spec, plan)
    inputs = [*(history or ()), *(calibration or ())]
    with progress_line() as say:
        found = pipeline.recalibrate(loaded, planned, inputs, options, say)
    document = recalibration_document(
        found.plans, found.shortest, found.start, _source(loaded), found.notes, found.sessions
    )
    report = recalibration_report(found, loaded.spec.name)
    files = {} if out is None else _recalibration_files(found, document, report, out)
    deliver(files, found.notes, document, report, as_json)
    lacking = why_not(found)
    if lacking:
        typer.echo(f"error: {lacking}", err=True)
        raise typer.Exit(3)


def _recalibration_files(
    found: Recalibrated, document: dict[str, Any], report: Report, folder: Path
) -> dict[Path, str | bytes]:
    from planner.export.fleet_calendar import calendar_bytes
    from planner.export.json_figures import json_text
    from planner.report.subjects.recalibration import store_appointments

    files: dict[Path, str | bytes] = {
        folder / "recalibration.json": json_text(document),
        folder / "report.html": page_of(report),
    }
    days = store_appointments(found)
    if days:
        files[folder / "recalibrations.ics"] = calendar_bytes(f"{report.title}: recalibrations", days)
    return files


def _read(spec: Path, plan: Path | None) -> tuple[LoadedSpec, dict[str, Any] | None]:
    """The spec, and the plan if one is given."""
    from planner.export.documents import read_plan
    from planner.spec.load import load_spec

    return load_spec(spec), None if plan is None else read_plan(plan)


def _source(loaded: LoadedSpec) -> dict[str, str]:
    """Which spec a document is of."""
    return {"name": loaded.spec.name, "sha256": loaded.sha256}
