"""The commands for units after the campaign, no arithmetic: accept, forecast, recalibrate."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planner.commands.options import AsJson, SpecFile, SpecOption
from planner.commands.output import progress_line, refuse_others, say

if TYPE_CHECKING:
    from planner.api.answer import Answer

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
        max=1000,
        help="Look at power-ons as they come and stop at the first decision; N: planned a temperature.",
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
    from planner.api import fleet

    refuse_others(spec, out, "report.html")
    asked: dict[str, Any] = {"spec": spec, "plan": plan}
    asked |= {"good_rejected": good_rejected / 100, "bad_accepted": bad_accepted / 100}
    found: Answer
    with progress_line() as progress:
        if plan_check or not data:
            found = fleet.plan_check(load=load / 100, decided=decided / 100, progress=progress, **asked)
        else:
            found = fleet.accept(*data, as_residual=as_residual, looks=looks, progress=progress, **asked)
    say(found, as_json, out, spec)


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
    from planner.api import fleet

    refuse_others(spec, out, "forecast.json", "report.html")
    with progress_line() as progress:
        found = fleet.forecast(
            *history,
            spec=spec,
            plan=plan,
            until=until,
            method=method,
            confidence=confidence / 100,
            corrected_by=corrected_by,
            start=start,
            today=today,
            progress=progress,
        )
    say(found, as_json, out, spec)


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
    from planner.api import fleet

    refuse_others(spec, out, "recalibration.json", "report.html")
    with progress_line() as progress:
        found = fleet.recalibrate(
            spec,
            history=[*(history or ()), *(calibration or ())],
            plan=plan,
            until=until,
            method=method,
            confidence=confidence / 100,
            corrected_by=corrected_by,
            start=start,
            today=today,
            progress=progress,
        )
    say(found, as_json, out, spec)
