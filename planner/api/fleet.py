"""Units after the campaign: accept, plan_check, forecast, recalibrate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.api.answer import Answer, PlanLike, Row, document_and_page, plan_tree_if_any
from planner.api.given import SpecLike, read, whole
from planner.nouns.progress import Progress, silent

if TYPE_CHECKING:
    from planner.fleet.appointment import Appointment
    from planner.fleet.basis import Recalibrated
    from planner.fleet.judge import ErrorRates
    from planner.pipelines.acceptance import Accepted, PlannedChecks
    from planner.pipelines.fleet import Forecasted
    from planner.report.blocks import Report
    from planner.spec.load import LoadedSpec


def _source(loaded: LoadedSpec) -> dict[str, str]:
    """Which spec a document is of."""
    return {"name": loaded.spec.name, "sha256": loaded.sha256}


def _calendar(out: Path, title: str, what: str, days: Sequence[Appointment]) -> dict[Path, str | bytes]:
    """A calendar of what is to be done on days, in the folder `out`; none where there are none."""
    from planner.export.fleet_calendar import calendar_bytes

    return {out / f"{what}.ics": calendar_bytes(f"{title}: {what}", days)} if days else {}


# ---------------------------------------------------------------- accept


@dataclass(frozen=True)
class AcceptAnswer(Answer):
    """Units accepted, rejected or undecided. Rows: the units."""

    record: Accepted

    @property
    def verdicts(self) -> dict[str, str]:
        """Unit -> `accepted`, `rejected` or `undecided`."""
        return {one.unit: one.verdict for one in self.record.units}

    def to_dict(self) -> dict[str, Any]:
        """accept.json."""
        from planner.export.fleet import accept_document

        found = self.record
        basis = found.basis
        return accept_document(found.units, basis.region, found.rates, _source(basis.loaded), found.notes)

    def rows(self) -> Sequence[Row]:
        """One row a unit."""
        return [{k: v for k, v in unit.items() if k != "channels"} for unit in self.to_dict()["units"]]

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """report.html."""
        from planner.report.subjects.accept import accept_report

        found = self.record
        basis = found.basis
        return (accept_report(found.units, basis.region, found.rates, basis.loaded.spec.name, found.notes),)

    @property
    def notes(self) -> tuple[str, ...]:
        """Of the region and of the data."""
        return self.record.notes

    @property
    def exit_code(self) -> int:
        """1 if any unit is rejected."""
        return 1 if "rejected" in self.verdicts.values() else 0

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """accept.json and report.html in the folder `out`."""
        return document_and_page(self, out, "accept.json", command)


def accept(
    *data: str | Path,
    spec: SpecLike,
    plan: PlanLike | None = None,
    good_rejected: float = 0.05,
    bad_accepted: float = 0.05,
    as_residual: bool = False,
    looks: int | None = None,
    progress: Progress = silent,
) -> AcceptAnswer:
    """Dwell tables of checks, or calibrations → units accepted, rejected or undecided.

    plan: left out, planned now; good_rejected, bad_accepted: shares, for one decision; looks: power-ons that
    were planned, to stop after each. Raises InputError for data that cannot be judged.
    """
    from planner.fleet.judge import ErrorRates
    from planner.pipelines import acceptance as pipeline
    from planner.spec.sensor_alone import needs

    rates = ErrorRates(good_rejected, bad_accepted)
    loaded, tree = read(spec), plan_tree_if_any(plan)
    planned = () if plan is not None else ("benches", "tests")  # a plan says what is left of its campaign
    needs(loaded, "what a unit is held against", "requirement", "trajectory", *planned)
    inputs = [Path(one) for one in data]
    return AcceptAnswer(
        pipeline.accept(inputs, loaded, tree, rates, progress, as_residual=as_residual, looks=looks)
    )


@dataclass(frozen=True)
class PlanCheckAnswer(Answer):
    """Checks that decide a unit, the cheapest first. Rows: the checks."""

    record: PlannedChecks
    rates: ErrorRates

    def to_dict(self) -> dict[str, Any]:
        """check_plan.json."""
        from planner.export.fleet import checks_document

        basis = self.record.basis
        return checks_document(self.record.checks, self.rates, _source(basis.loaded), basis.notes)

    def rows(self) -> Sequence[Row]:
        """One row a check."""
        return list(self.to_dict()["checks"])

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """report.html."""
        from planner.report.subjects.check_plan import checks_report

        basis = self.record.basis
        return (checks_report(self.record.checks, self.rates, basis.loaded.spec.name, basis.notes),)

    @property
    def notes(self) -> tuple[str, ...]:
        """Of the region."""
        return self.record.basis.notes

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """check_plan.json and report.html in the folder `out`."""
        return document_and_page(self, out, "check_plan.json", command)


def plan_check(
    spec: SpecLike,
    *,
    plan: PlanLike | None = None,
    load: float = 0.9,
    decided: float = 0.9,
    good_rejected: float = 0.05,
    bad_accepted: float = 0.05,
    progress: Progress = silent,
) -> PlanCheckAnswer:
    """The cheapest temperatures, faces and power-ons that decide such a share of units at a load.

    load: of the limit; decided: share of such units. Raises InputError for a spec that feels no error.
    """
    from planner.fleet.judge import ErrorRates
    from planner.pipelines import acceptance as pipeline

    rates = ErrorRates(good_rejected, bad_accepted)
    found = pipeline.plan_check(whole(spec), plan_tree_if_any(plan), load, decided, rates, progress)
    return PlanCheckAnswer(found, rates)


# ---------------------------------------------------------------- forecast


@dataclass(frozen=True)
class ForecastAnswer(Answer):
    """Drift in store, and the date of the next calibration. Rows: the units, most urgent first."""

    record: Forecasted

    def to_dict(self) -> dict[str, Any]:
        """forecast.json."""
        from planner.export.fleet import forecast_document

        basis = self.record.basis
        return forecast_document(self.record.fleet, basis.region, _source(basis.loaded))

    def rows(self) -> Sequence[Row]:
        """One row a unit."""
        return [{k: v for k, v in unit.items() if k != "load"} for unit in self.to_dict()["units"]]

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """report.html."""
        from planner.report.subjects.forecast import forecast_report

        basis = self.record.basis
        return (forecast_report(self.record.fleet, basis.region, basis.loaded.spec.name),)

    @property
    def notes(self) -> tuple[str, ...]:
        """Of the history and of the region."""
        return tuple(self.record.fleet.notes)

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """forecast.json, report.html and, where there are dates, calibrations.ics in the folder `out`."""
        from planner.report.subjects.forecast import appointments

        days = appointments(self.record.fleet, self.record.basis.region)
        files = document_and_page(self, out, "forecast.json", command)
        return files | _calendar(out, self.reports[0].title, "calibrations", days)


def forecast(
    *history: str | Path,
    spec: SpecLike,
    plan: PlanLike | None = None,
    until: str | None = None,
    method: str = "auto",
    confidence: float = 0.95,
    corrected_by: str = "auto",
    start: str | None = None,
    today: str | None = None,
    progress: Progress = silent,
) -> ForecastAnswer:
    """Histories → drift per channel with intervals, and until when each unit keeps its requirements.

    history: CSV, `calibration.json@DATE`, dwell tables with a day; until: days or a date; start, today:
    dates. Raises InputError for a history, a date or a method that is none.
    """
    from planner.pipelines import fleet as pipeline

    options = pipeline.options_of(until, method, 100 * confidence, corrected_by, today, start)
    loaded, tree = whole(spec), plan_tree_if_any(plan)
    return ForecastAnswer(pipeline.forecast(list(map(str, history)), loaded, tree, options, progress))


# ---------------------------------------------------------------- recalibrate


@dataclass(frozen=True)
class RecalibrateAnswer(Answer):
    """The visits in store that cost least hours. Rows: the visits."""

    record: Recalibrated

    def to_dict(self) -> dict[str, Any]:
        """recalibration.json."""
        from planner.export.recalibration_json import recalibration_document

        found = self.record
        source = _source(found.basis.loaded)
        return recalibration_document(
            found.plans, found.shortest, found.start, source, found.notes, found.sessions
        )

    def rows(self) -> Sequence[Row]:
        """One row a visit."""
        units = self.to_dict()["units"]
        return [{"unit": unit["unit"], **visit} for unit in units for visit in unit["visits"]]

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """report.html."""
        from planner.report.subjects.recalibration import recalibration_report

        return (recalibration_report(self.record, self.record.basis.loaded.spec.name),)

    @property
    def notes(self) -> tuple[str, ...]:
        """Of the history and of the region."""
        return tuple(self.record.notes)

    @property
    def exit_code(self) -> int:
        """3 when the store cannot carry a unit so far."""
        return 3 if self.remark else 0

    @property
    def remark(self) -> str:
        """Why it cannot."""
        from planner.report.subjects.recalibration import why_not

        lacking = why_not(self.record)
        return f"error: {lacking}" if lacking else ""

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """recalibration.json, report.html and, where there are visits, recalibrations.ics in `out`."""
        from planner.report.subjects.recalibration import store_appointments

        days = store_appointments(self.record)
        files = document_and_page(self, out, "recalibration.json", command)
        return files | _calendar(out, self.reports[0].title, "recalibrations", days)


def recalibrate(
    spec: SpecLike,
    *,
    history: Sequence[str | Path] = (),
    plan: PlanLike | None = None,
    until: str | None = None,
    method: str = "auto",
    confidence: float = 0.95,
    corrected_by: str = "auto",
    start: str | None = None,
    today: str | None = None,
    progress: Progress = silent,
) -> RecalibrateAnswer:
    """Which visits in store keep the requirement at least cost, and what they renew.

    history: as of `forecast`, and earlier calibrations `calibration.json@DATE`; left out, the spec's storage
    says how the unit drifts. Raises InputError for a spec that says nothing of recalibration.
    """
    from planner.pipelines import fleet as pipeline

    options = pipeline.options_of(until, method, 100 * confidence, corrected_by, today, start)
    loaded, tree = whole(spec), plan_tree_if_any(plan)
    return RecalibrateAnswer(pipeline.recalibrate(loaded, tree, list(map(str, history)), options, progress))
