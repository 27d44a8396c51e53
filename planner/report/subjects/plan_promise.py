"""What is particular to a plan by information: the promise under each family of curves, what binds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from planner.nouns.choices import RepeatReason
from planner.nouns.plan import Achieved, Plan, Worth
from planner.nouns.sensitivities import Constraint
from planner.report.blocks import Cell, Items, Section, Table, Text, section, table
from planner.report.charts import campaigns, gantt
from planner.report.contributions import PART_NAMES, PARTS, Contribution, contributions
from planner.report.numbers import (
    degrees,
    digits,
    display_unit,
    hours,
    in_unit,
    level,
    percent,
    quantity,
)
from planner.report.subjects import plan_tables

FAMILIES = {  # what a family's name stands for
    "cosines": "a sum of cosines",
    "kink": "a quadratic with a kink",
    "cubic": "a cubic",
    "matern": "Matérn 3/2",
}


BUDGET = (
    "Each bar is a share of the mean square of the navigation error. Run to run, in run and storage are the "
    "flight's own, whatever the campaign does; temperatures buy what tables miss of the curves, and "
    "records the estimate. In the table: sigmas in flight of the largest term, times the requirement's "
    "quantile (1.96 for 95 %, 1 for rss)."
)


def campaign(plan: Plan) -> Section | None:
    """Tests, temperatures and repeats; when what is done."""
    picture = gantt.campaign_picture(plan) if plan.steps else None
    return section("campaign", "The campaign", plan_tables.tests_table(plan), picture)


def binding(plan: Plan, constraints: Sequence[Constraint]) -> Section | None:
    """What uses the limits up, and the promise under each family of temperature curves."""
    said = tuple(_binds(plan, i, constraints) for i in range(len(plan.requirements)))
    return section(
        "binds",
        "What binds",
        Items(said, "What uses the limits:"),
        Text(
            "What a table leaves between its temperatures is known in size but not in shape: the promise "
            "holds for every family of curves that leaves the residuals of the spec.",
            only="page",
        )
        if len(plan.families) > 1
        else None,
        families_table(plan),
    )


def _binds(plan: Plan, index: int, constraints: Sequence[Constraint]) -> str:
    achieved = plan.requirements[index]
    text = f"{achieved.error}: {percent(achieved.achieved / achieved.limit)} of the limit is used"
    if len(plan.families) > 1:
        text += f", under curves of the family {achieved.family}"
    budget = contributions(plan, index, constraints)
    if budget and budget[0].share > 0:
        text += f"; the largest part is {budget[0].error} ({percent(budget[0].share)}), {_largest(budget[0])}"
    return text + "."


def _largest(contribution: Contribution) -> str:
    """Its own largest part, in words."""
    share, part = max(zip(contribution.parts, PARTS, strict=True))
    return f"of it {percent(share / contribution.share)} {PART_NAMES[part]}"


def families_table(plan: Plan) -> Table | None:
    """A row a family: every requirement's figure under it, its share of the limit; which binds is marked."""
    several = len(plan.requirements) > 1
    columns = ["curves"]
    for i, r in enumerate(plan.requirements):
        title = f"{i + 1}: {r.error}" if several else r.error
        columns += [f"{title}, {display_unit(r.unit)}", f"of {quantity(r.limit, r.unit)}"]
    rows = [
        (
            f"{name}: {FAMILIES[name]}" if name in FAMILIES else name,
            *_figures(plan, figures),
            _where_it_binds(plan, name),
        )
        for name, figures in plan.families.items()
    ]
    return table(
        "What is promised under each family of temperature curves", " | ".join([*columns, "binds"]), rows
    )


def _figures(plan: Plan, figures: Mapping[int, float]) -> list[Cell]:
    """Of every requirement: the figure and its share of the limit."""
    each = zip(plan.requirements, (figures[i] for i in range(len(plan.requirements))), strict=True)
    return [cell for r, x in each for cell in (digits(in_unit(x, r.unit)), percent(x / r.limit))]


def _where_it_binds(plan: Plan, family: str) -> str:
    bound = [r.error for r in plan.requirements if r.family == family]
    return ", ".join(bound) if len(plan.requirements) > 1 else "yes" if bound else ""


def worth(plan: Plan) -> Section | None:
    """What every visit buys, and what changes would cost or save."""
    return section(
        "worth",
        "What it is worth",
        worth_table(plan),
        prices_table(plan),
        only="page",
    )


def worth_table(plan: Plan) -> Table | None:
    """A row a visit: its hours, and every requirement without it, with one repeat less and one more."""
    several = len(plan.requirements) > 1
    columns = ["test", "at, °C", "n", "h"]
    for i, r in enumerate(plan.requirements):
        name = f"{i + 1}: {r.error}" if several else r.error
        columns += [f"{name} without, {display_unit(r.unit)}", "n − 1", "n + 1"]
    rows = [
        (w.test, degrees([w.temperature_degc]), str(w.repeats), hours(w.time_s), *_bought(plan, w))
        for w in plan.worth
    ]
    return table("What every visit buys: the promise without it", " | ".join(columns), rows)


def _bought(plan: Plan, one: Worth) -> list[Cell]:
    each = zip(plan.requirements, one.without, one.one_fewer, one.one_more, strict=True)
    return [_promised(x, r) for r, *figures in each for x in figures]


def _promised(value: float, achieved: Achieved) -> str:
    return digits(in_unit(value, achieved.unit)) if math.isfinite(value) else "unobservable"


def prices_table(plan: Plan) -> Table | None:
    """Hours that changes add or, with a minus, save."""
    rows = [(p.change, _added(p.time_s)) for p in plan.prices]
    return table("Prices: what a change adds to the campaign", "change | h", rows)


def _added(seconds: float) -> str:
    """Hours with their sign; what is shown as nothing has none."""
    shown = hours(abs(seconds))
    return shown if shown == hours(0.0) else f"{'+' if seconds > 0 else '−'}{shown}"


def repeats(plan: Plan) -> Section | None:
    """What sets the repeats, and the half-widths of the published method beside them."""
    return section(
        "repeats",
        "Why this number of repeats",
        Text(
            "Temperatures and repeats are chosen together, the fewest hours found that keep the promise; a "
            "record counts with all that it tells at once. Beside it stands the published way: the mean of "
            "n power-ons at one temperature is known to d = t·s/√n, s the spread of what one power-on "
            "measures, t the quantile; it decides nothing here. Ours is what noise and draws of the whole "
            "campaign leave of the error in flight, times the requirement's quantile.",
        ),
        _beside(plan),
        only="page",
    )


def _beside(plan: Plan) -> Table | None:
    ours = {a.error: a for a in plan.allowances}
    groups: dict[tuple[object, ...], list[RepeatReason]] = {}
    for r in plan.reasons:
        groups.setdefault((r.error, r.test, r.repeats, f"{r.half_width:.6g}"), []).append(r)
    rows = []
    for (error, test, *_), same in groups.items():
        one, unit = same[0], ours[str(error)].unit
        at = degrees(sorted(r.temperature_degc for r in same))
        numbers = (digits(x) for x in (in_unit(one.spread, unit), one.quantile))
        ends = (digits(in_unit(x, unit)) for x in (one.half_width, ours[str(error)].estimate))
        rows.append((str(error), str(test), at, display_unit(unit), *numbers, str(one.repeats), *ends))
    kinds = dict.fromkeys(f"{r.quantile_name} t at {level(r.confidence)}" for r in plan.reasons)
    return table(
        f"Half-widths d = t·s/√n ({', '.join(kinds)}) beside what the campaign leaves",
        "error | test | at, °C | unit | s | t | n | d beside | estimate in flight",
        rows,
    )


def other_campaigns(plan: Plan) -> Section | None:
    """The Pareto set of hours, promise and power-on, and the genetic campaign beside the plan."""
    return section(
        "pareto",
        "Other campaigns",
        campaigns.campaigns_picture(plan),
        plan_tables.genetic_table(plan),
        only="page",
    )
