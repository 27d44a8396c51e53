"""plan.json, typed: its JSON Schema (draft 2020-12), and the one reader of its tree.

The models say what every key is; units stand in the keys. What explains the plan stands here, what benches
act on in `planner.nouns.plan_benches`. Whoever needs a part of a plan asks for that part: `PlanSteps`,
`PlanOnBenches`, …
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from functools import cache
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from planner.errors import Fault, InputError
from planner.nouns.plan import SCHEMA_VERSION
from planner.nouns.plan_benches import Benches, Count, Moment, Number, Positive, Steps, Time
from planner.nouns.step import Step
from planner.quantities import MOMENT_PATTERN

SCHEMA_FILE = "plan.schema.json"
DRAFT = "https://json-schema.org/draft/2020-12/schema"
MOST_FAULTS = 20  # one mistake in a plan is one in thousands of steps
_SAME_S = 1e-6  # twelve digits of a year are 30 microseconds, of a month two

Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class Part(BaseModel):
    """Base of every mapping in plan.json that explains the plan; a later planner may explain more."""

    model_config = ConfigDict(frozen=True, extra="ignore", strict=True)


class SpecName(Part):
    """The spec that the plan was made from; sha256 of the file's bytes."""

    name: str
    sha256: Sha256


class ObjectiveFigures(Part):
    """What was minimised, its value and its proved lower bound in weighted seconds."""

    minimise: str
    value_s: Number
    bound_s: Number


class RequirementFigures(Part):
    """One requirement, and what the plan reaches, in `unit`; shares of every error.

    family: of temperature curves, under which that is largest; temperature: where flights start
    spread_factor: `achieved` times it holds with the spec's confidence over spreads that are estimates
    """

    error: str
    at: str
    rule: str
    limit: Positive
    achieved: Time
    unit: str
    met: bool
    shares: dict[str, Number]
    family: str | None = None
    temperature: str | None = None
    spread_factor: Positive = 1.0


class SensitivityFigures(Part):
    """One coefficient of the linear combination; `requirement` is an index."""

    error: str
    axis: str
    value: Number
    unit: str
    requirement: Annotated[int, Field(ge=0)]


class AllowanceParts(Part):
    """The five parts of an allowed error."""

    run_to_run: Time
    in_run: Time
    storage: Time
    temperature: Time
    estimate: Time


class AllowanceFigures(Part):
    """The allowed size of one error, in `unit`."""

    allowed: Time
    unit: str
    calibrated: bool
    parts: AllowanceParts


class TestFigures(Part):
    """What one test does: its temperatures and the repeats at each."""

    __test__ = False  # not a pytest class

    test: str
    bench: str
    calibrates: list[str]
    motions: Count
    attended: bool = False
    temperatures_degc: list[Number]
    repeats: list[Count]
    time_s: Time
    power_on_s: Time


class Reason(Part):
    """Why this number of repeats; spread and half-widths in `unit`."""

    error: str
    test: str
    temperature_degc: Number
    repeats: Count
    spread: Time
    confidence: Number
    quantile: str
    quantile_value: Number
    half_width: Time
    needed_half_width: Time
    unit: str
    bound_by: Literal["accuracy", "least", "shared", "fixed", "promise"]


class VisitFigures(Part):
    """At which temperatures a test is made, and how often at each."""

    test: str
    temperatures_degc: list[Number]
    repeats: list[Count]


class GeneticFigures(Part):
    """The genetic algorithm's campaign beside the exact one; campaigns: of the front's points, in order."""

    time_s: Time
    gap: Number
    generations: Annotated[int, Field(ge=0)]
    evaluations: Annotated[int, Field(ge=0)]
    stopped: str
    front: list[dict[str, Number]]
    campaigns: list[list[VisitFigures]] = []


class WorthFigures(Part):
    """What one visit buys: seconds, and each requirement's figure without it, with one less, one more."""

    test: str
    temperature_degc: Number
    repeats: Count
    time_s: Number
    repeat_s: Number
    without: dict[str, Time | None]
    one_fewer: dict[str, Time | None]
    one_more: dict[str, Time | None]


class FlownTermFigures(Part):
    """One term of an error in flight; its covariances are in products of these units."""

    error: str
    axis: str
    unit: str


class CovarianceFigures(Part):
    """What is left of all terms together in flight, at the temperatures of a requirement."""

    requirement: Annotated[int, Field(ge=0)]
    terms: list[FlownTermFigures]
    matrix: list[list[Number]]


class PriceFigures(Part):
    """What a change is worth: seconds of the campaign that it adds; negative: that it saves."""

    change: str
    time_s: Number


class SavingFigures(Part):
    """Hours that one rule of the schedule saves: the same work timed with it and without it."""

    rule: str
    hours: Number


class ShiftHours(Part):
    """Hours in which people are there, seconds from Monday 00:00; a night may end in the next week.

    With days off the Monday is that of the first week, and every week has hours of its own.
    """

    opens_s: Time
    closes_s: Time


Day = Annotated[date, Field(strict=False)]  # text in JSON


class DayOff(Part):
    """A day on which no shift begins; name: of the holiday, empty for a day that the spec gives."""

    date: Day
    name: str = ""


class TradeOffFigures(Part):
    """The best campaign when a second of power-on is worth `power_on_weight` seconds of the campaign."""

    power_on_weight: Number
    time_s: Time
    power_on_s: Time
    proved: bool


class PluginFigures(Part):
    """A plug-in of another package that the spec names, and the version of that package."""

    kind: str
    name: str
    distribution: str
    version: str


class PlanSteps(Part):
    """What is done, in the order of time."""

    steps: Steps


class PlanOnBenches(PlanSteps):
    """What is done, and on which benches."""

    benches: Benches


class PlanAllowances(Part):
    """What every sensor error may be."""

    allowances: dict[str, AllowanceFigures]
    covariance: CovarianceFigures | None = None


class ComparedPlan(PlanSteps, PlanAllowances):
    """What two plans are compared by."""

    spec: SpecName
    time_s: Moment
    power_on_s: Moment
    gap: Number
    requirements: list[RequirementFigures]
    tests: list[TestFigures]


class PlanWhy(Part):
    """Why a plan is as it is: what binds, what every visit buys, what changes are worth."""

    spec: SpecName
    time_s: Moment
    bound_s: Time
    proved: bool
    requirements: list[RequirementFigures]
    families: dict[str, dict[str, Time]] = {}
    method: Literal["information", "published"] = "published"
    temperature_estimator: Literal["lines", "smooth"] = "lines"
    proved_of: str = ""
    spread_factor: Positive = 1.0
    tests: list[TestFigures] = []
    reasons: list[Reason] = []
    hours_per_limit: dict[str, Number] = {}
    worth: list[WorthFigures] = []
    prices: list[PriceFigures] = []


class PlanDocument(ComparedPlan, PlanOnBenches, PlanWhy):
    """plan.json of `planner plan`."""

    reference: str | None = Field(None, alias="$schema")
    planner: str
    schema_version: Literal[1]
    plan_sha256: Sha256
    seed: Annotated[int, Field(ge=0)]
    objective: ObjectiveFigures
    sensitivities: list[SensitivityFigures]
    reasons: list[Reason]
    genetic: GeneticFigures | None
    hours_per_limit: dict[str, Number]
    start: Annotated[str, Field(pattern=MOMENT_PATTERN)] | None = None
    shifts: list[ShiftHours] = []
    first_day: Day | None = None
    shifts_period_s: Positive = 604_800.0
    days_off: list[DayOff] = []
    savings: list[SavingFigures] = []
    trade_off: list[TradeOffFigures] = []
    plugins: list[PluginFigures] = []
    packages: dict[str, str] = {}
    notes: list[str]


Read = TypeVar("Read", bound=Part)


def plan_part(document: object, part: type[Read], called: str = "this") -> Read:
    """The part of a plan's tree that somebody works from; called: the plan's name in messages.

    Raises InputError with every place that is not as it should be: a key that is missing or unknown, a value
    of another type or beyond what can be, a step that ends before it starts or stands out of order.
    """
    try:
        found = part.model_validate(document)
    except ValidationError as error:
        faults = [_fault(document, e["loc"], e["msg"]) for e in error.errors(include_url=False)]
    else:
        faults = [*_time_faults(found.steps)] if isinstance(found, PlanSteps) else []
        if not faults:
            return found
    more = f" ({len(faults)} faults in all)" if len(faults) > MOST_FAULTS else ""
    raise InputError(f"{called} is not a plan that planner writes{more}", faults[:MOST_FAULTS])


def typed_plan(document: object, called: str = "this") -> PlanDocument:
    """All of a plan's tree. Raises InputError as `plan_part`."""
    return plan_part(document, PlanDocument, called)


def steps_of(document: object) -> tuple[Step, ...]:
    """The steps of a plan's tree. Raises InputError as `plan_part`."""
    return plan_part(document, PlanSteps).steps


def _time_faults(steps: Sequence[Step]) -> Iterator[Fault]:
    """Steps that end before they start, or start before the one that stands before them."""
    now = 0.0
    for step in steps:
        if step.end_s < step.start_s:
            message = f"{step.end_s:g} s, ends before it starts at {step.start_s:g} s"
            yield Fault("plan.json", 0, 0, f"steps.{step.id}.end_s", message, "P902")
        if step.start_s < now - _SAME_S:
            message = f"{step.start_s:g} s, before the step that stands before it, {now:g} s"
            yield Fault("plan.json", 0, 0, f"steps.{step.id}.start_s", message, "P902")
        now = max(now, step.start_s)


def _fault(document: object, place: Sequence[int | str], message: str) -> Fault:
    """A fault where it stands; a step goes by its id, if it has one."""
    names = list(map(str, place))
    if len(place) > 1 and place[0] == "steps" and isinstance(document, Mapping):
        step = document["steps"][place[1]]
        names[1] = str(step.get("id") or names[1]) if isinstance(step, Mapping) else names[1]
    return Fault("plan.json", 0, 0, ".".join(names), message, "P902")


@cache
def plan_schema() -> dict[str, Any]:
    """The JSON Schema of plan.json, made once: nobody changes it, and every recount reads it."""
    schema = PlanDocument.model_json_schema()
    return {"$schema": DRAFT, **schema, "title": f"planner plan, schema version {SCHEMA_VERSION}"}


def plan_schema_text() -> str:
    """The JSON Schema as it stands beside an exported plan."""
    return json.dumps(plan_schema(), indent=1, ensure_ascii=False) + "\n"
