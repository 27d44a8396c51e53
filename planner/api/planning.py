"""From a spec to a plan: check, plan, sensitivity, allow; an answer as a page, and schemas of files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.api.answer import Answer, Row, page
from planner.api.given import SpecLike, whole
from planner.errors import InputError
from planner.nouns.progress import Progress, silent

if TYPE_CHECKING:
    from planner.errors import Fault
    from planner.nouns.allowances import AllowedErrors
    from planner.nouns.plan import Achieved, Plan, PlannedTest
    from planner.nouns.sensitivities import Sensitivities
    from planner.nouns.step import Step
    from planner.pipelines.planned import Planned
    from planner.plan.flights_side_by_side import FlownErrors
    from planner.plan.spec_to_sensitivity import SensitivityRow
    from planner.report.blocks import Report
    from planner.spec.load import LoadedSpec


def check(spec: SpecLike) -> tuple[Fault, ...]:
    """What is odd about a spec that can be planned: its warnings.

    Raises InputError with every fault, and for an error that no campaign of the tests observes.
    """
    from planner.plan.observable_campaign import refuse_what_no_campaign_observes

    loaded = whole(spec)
    refuse_what_no_campaign_observes(loaded.spec)  # not by the pipeline, whose imports take a second
    return loaded.warnings


# ---------------------------------------------------------------- plan


@dataclass(frozen=True)
class PlanAnswer(Answer):
    """A plan. record: all of it, SI; times in seconds from the start. Rows: its steps."""

    made: Planned
    spec: LoadedSpec

    @property
    def record(self) -> Plan:
        """The plan as a record, SI."""
        return self.made.plan

    @property
    def time_s(self) -> float:
        """How long the campaign takes."""
        return self.record.time_s

    @property
    def bound_s(self) -> float:
        """What no campaign can be shorter than; of which ones says `record.proved_of`."""
        return self.record.bound_s

    @property
    def requirements(self) -> tuple[Achieved, ...]:
        """What is asked and what is promised, SI."""
        return self.record.requirements

    @property
    def tests(self) -> tuple[PlannedTest, ...]:
        """Temperatures and repeats of every test."""
        return self.record.tests

    @property
    def steps(self) -> tuple[Step, ...]:
        """What is done, in the order of time."""
        return self.record.steps

    def to_dict(self) -> dict[str, Any]:
        """plan.json."""
        from planner.export.json import plan_document

        return plan_document(self.record)

    def rows(self) -> Sequence[Row]:
        """One row a step."""
        return list(self.to_dict()["steps"])

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """report.html."""
        from planner.report.subjects.plan import plan_report

        navigation = self.made.navigation
        return (
            plan_report(
                self.record,
                allowed=self.made.allowed,
                sensitivities=navigation.sensitivities,
                constraints=navigation.constraints,
                spec_text=self.spec.text,
                trajectory_name=navigation.trajectory,
                service_life_s=self.spec.spec.unit.service_life,
            ),
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """The plan's notes."""
        return self.record.notes

    @property
    def exit_code(self) -> int:
        """4 when it was stopped before the search was complete; 1 when a plan made by hand misses a limit."""
        if not self.record.complete:
            return 4
        return 0 if all(one.met for one in self.requirements) else 1

    @property
    def remark(self) -> str:
        """What stopped it, or which limits it misses."""
        if not self.record.complete:
            return "stopped before the proof was complete: see bound_s and gap, and what was cut short"
        missed = [one.error for one in self.requirements if not one.met]
        return f"the plan misses its requirement: {', '.join(missed)}" if missed else ""

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """plan.json, steps.csv, report.html in the folder `out`."""
        from planner.export.formats.csv import steps_text
        from planner.export.json import document_text

        document = self.to_dict()
        return {
            out / "plan.json": document_text(document),
            out / "steps.csv": steps_text(document),
            out / "report.html": page(self.reports[0], command),
        }


def plan(
    spec: SpecLike,
    *,
    progress: Progress = silent,
    stop: Callable[[], bool] | None = None,
    answered: Callable[[PlanAnswer], None] | None = None,
) -> PlanAnswer:
    """The shortest campaign found that keeps the spec's promise, with its bound and its reasons.

    stop: asked again and again; once it says yes, the best so far is the answer, with `exit_code` 4.
    answered: told the plan as soon as it is there; genetic campaigns, which stand beside it, are missing yet.
    Raises InputError for a spec that cannot be planned, InfeasibleError when no campaign meets the
    requirement (with `binds` and `nearest_limit`), StoppedEarly when plan.time_limit left no answer.
    """
    from planner.nouns.deadline import never
    from planner.pipelines import planning as pipeline

    loaded = whole(spec)

    def tell(made: Planned) -> None:
        if answered is not None:
            answered(PlanAnswer(made, loaded))

    return PlanAnswer(pipeline.plan(loaded, progress, stop or never, tell), loaded)


# ---------------------------------------------------------------- sensitivity, allow


@dataclass(frozen=True)
class SensitivityAnswer(Answer):
    """Signed navigation errors per unit of every sensor error. Rows: one a term.

    units: error -> the unit in which the spec speaks of it, and the report shows it
    """

    columns: tuple[SensitivityRow, ...]
    flown: FlownErrors
    name: str = ""
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def history(self) -> Sensitivities:
        """The same over the time of flight, per SI unit."""
        return self.flown.found

    def to_dict(self) -> dict[str, Any]:
        """`columns`, one a term: north_m, …, for one `per` of it; `flights` beside the spec's."""
        from planner.export.sensitivities import sensitivity_document

        return sensitivity_document(self.columns, self.flown.flights)

    def rows(self) -> Sequence[Row]:
        """One row a term."""
        return list(self.to_dict()["columns"])

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """The table, curves over the flight, flights side by side."""
        from planner.report.subjects.sensitivity import sensitivity_report

        return (sensitivity_report(list(self.columns), self.flown, self.name, self.units),)

    def placed(self, out: Path, command: str = "") -> dict[Path, str | bytes]:
        """report.html and sensitivities.csv, the columns over the time of flight."""
        from planner.export.sensitivities import over_flight_text
        from planner.report.readable import sensitivities_in

        return {
            out / "sensitivities.csv": over_flight_text(sensitivities_in(self.history, self.units)),
            out / "report.html": page(self.reports[0], command),
        }


def sensitivity(
    spec: SpecLike,
    *,
    trajectory: str | Path | None = None,
    at: str | float = "end",
    beside: Sequence[str | Path] = (),
    progress: Progress = silent,
) -> SensitivityAnswer:
    """Navigation error per unit of every sensor error: the coefficients of the linear combination (K 3.3).

    trajectory: a CSV flight instead of the spec's; at: `end`, `any` (the worst moment of each column), a
    time such as `30 s`, or seconds; beside: other flights, built-in ones by name or CSV files.
    Raises InputError for a time outside the flight, or none at all, and for a flight that is not there.
    """
    from planner.pipelines.flights import flown_errors
    from planner.plan.spec_to_sensitivity import sensitivity_rows
    from planner.spec.own_units import own_units

    when = _moment(at)
    seconds = None if isinstance(when, str) else when
    flight = None if trajectory is None else Path(trajectory)
    loaded = whole(spec)
    flown = flown_errors(loaded, flight, [str(b) for b in beside], progress, at=seconds)
    rows = tuple(sensitivity_rows(flown.found, when))  # type: ignore[arg-type]  # of the words, `end` and `any` alone pass
    return SensitivityAnswer(rows, flown, loaded.spec.name, own_units(loaded.spec))


def _moment(at: str | float) -> str | float:
    from planner.units import UnitError, to_si

    if not isinstance(at, str) or at in ("end", "any"):
        return at
    try:
        return to_si(at, "s")
    except UnitError as error:
        raise InputError(f"--at: {error}; or end, or any") from None


@dataclass(frozen=True)
class AllowAnswer(Answer):
    """The region of allowed sensor errors. Rows: the Pareto set, one point a row."""

    record: AllowedErrors

    def to_dict(self) -> dict[str, Any]:
        """Bounds, corners and the Pareto set, in the display units of `units`."""
        from planner.export.allowances import allowed_document

        return allowed_document(self.record)

    def rows(self) -> Sequence[Row]:
        """One row a point of the Pareto set."""
        return list(self.to_dict()["front"])

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """Corners, genetic beside exact."""
        from planner.report.subjects.sensitivity import allowed_report

        return (allowed_report(self.record),)

    @property
    def exit_code(self) -> int:
        """4 when it was stopped before the genetic algorithm was done."""
        return 4 if self.record.history.stopped == "time" else 0

    @property
    def remark(self) -> str:
        """How far it came; the corners are exact all the same."""
        generations = self.record.history.generations
        return f"stopped after {generations} generations: the best set so far" if self.exit_code else ""


def allow(
    spec: SpecLike, *, progress: Progress = silent, stop: Callable[[], bool] | None = None
) -> AllowAnswer:
    """The allowed sensor errors: Pareto set of the genetic algorithm, its corners, the exact optimum.

    stop: asked again and again; once it says yes, the Pareto set so far is the answer, with `exit_code` 4.
    Raises InputError for a spec that cannot be planned, InfeasibleError when no errors are allowed.
    """
    from planner.nouns.deadline import never
    from planner.pipelines import allowing

    return AllowAnswer(allowing.allow(whole(spec), progress, stop or never)[1])


# ---------------------------------------------------------------- pages, schemas


def report(answer: Answer, *, command: str = "") -> str:
    """An answer as one HTML page that opens offline; command: the line that its footer shows.

    Raises InputError for the answer of several units, which have a page each: see `answer.reports`.
    """
    if len(answer.reports) != 1:
        raise InputError(f"{len(answer.reports)} units have a page each; take one of answer.reports")
    return page(answer.reports[0], command)


def schema(of: str = "spec") -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a file: spec, plan, diagnosis, calibration, verify, column-map, ….

    Raises InputError for a file that has none.
    """
    from planner.export.schemas import schema_of

    return schema_of(of)
