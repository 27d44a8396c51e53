"""What the rules of the schedule save, and campaign time against the life of the unit."""

from __future__ import annotations

from datetime import timedelta

from planner.nouns.plan import Plan, TradeOffPoint
from planner.quantities import DAY_S, WEEKDAYS
from planner.report.blocks import Section, Table, Text, section, table
from planner.report.charts.plan import trade_off_picture
from planner.report.numbers import counted, digits, hours, percent
from planner.report.time_spent import PEOPLE, action_of

# rule -> (in words, what the plan is compared with)
RULES = {
    "overlap": ("cool-down during ramp and soak", "every cool-down waited for at its temperature"),
    "order": ("order of the temperatures fitted to the shifts", "the better one of up and down"),
    "shared_records": ("one record for several errors", "the same records made for each error by itself"),
    "copies": ("several benches of a kind", "one of each kind"),
    "parallel_benches": ("benches at work on different batches", "one batch in the laboratory at a time"),
    "capacity": ("several units on a bench", "one unit at a time on every bench"),
}


def schedule(plan: Plan) -> Section | None:
    """Savings of the rules that are on, and the trade-off curve where it was asked for."""
    curve = distinct(plan.trade_off)
    return section(
        "schedule",
        "The schedule and what its rules save",
        Text(people_hours(plan)) if plan.shifts else None,
        Text(
            "Each rule alone is taken away and the same temperatures and repeats are timed again; the hours "
            "do not add up, and without the rule other repeats might be chosen."
        )
        if plan.savings
        else None,
        savings_table(plan),
        Text(
            "Campaign time against power-on time of each unit: the best plan for several weights of the two."
        )
        if plan.trade_off
        else None,
        trade_off_picture(curve),
        trade_off_table(curve),
        only="page",
    )


def people_hours(plan: Plan) -> str:
    """When people are there, when the campaign begins, and how long it waits for them."""
    days: dict[str, dict[str, None]] = {}
    for opens, closes in plan.shifts:
        times = f"{_clock(opens)} to {_clock(closes)}"
        days.setdefault(times, {})[WEEKDAYS[int(opens // DAY_S) % 7]] = None
    shifts = "; ".join(f"{', '.join(names)} {times}" for times, names in days.items())
    waits = [step.end_s - step.start_s for step in plan.steps if action_of(step) == PEOPLE]
    pauses = counted(len(waits), "pause")
    attended = sum(bool(step.attended) for step in plan.steps)
    return (
        f"People are there {shifts}; the campaign begins {begins(plan)}.{_off(plan)} {attended} of "
        f"{len(plan.steps)} steps need them; waiting for them takes {hours(sum(waits))} h of the benches, in "
        f"{pauses}."
    )


def begins(plan: Plan) -> str:
    """`mon 08:00`, with the date where the plan knows it."""
    return str(plan.start) if plan.first_day is None else f"{plan.start}, {plan.first_day.isoformat()}"


def _off(plan: Plan) -> str:
    """The days off that the campaign meets."""
    if plan.first_day is None:
        return ""
    last = plan.first_day + timedelta(days=plan.time_s // DAY_S + 1)
    met = [
        f"{day.isoformat()}{f' ({name})' if name else ''}"
        for day, name in plan.days_off
        if plan.first_day <= day <= last
    ]
    return f" Nobody works on {', '.join(met)}." if met else ""


def _clock(moment: float) -> str:
    """A moment of the week as a time of day."""
    minutes = round(moment / 60) % 1440
    return f"{minutes // 60:02d}:{minutes % 60:02d}"


def savings_table(plan: Plan) -> Table | None:
    """Hours saved by every rule, and their share of the campaign without it."""
    rows = []
    for saving in plan.savings:
        words, against = RULES.get(saving.rule, (saving.rule.replace("_", " "), ""))
        whole = plan.time_s + 3600 * saving.hours
        share = 3600 * saving.hours / whole if whole > 0 else 0.0
        rows.append((words, against, hours(3600 * saving.hours), percent(share)))
    columns = "rule | compared with | saves, h | of the longer campaign"
    return table("Hours that the rules save", columns, rows)


def distinct(points: tuple[TradeOffPoint, ...]) -> tuple[TradeOffPoint, ...]:
    """The points without repetitions: several weights often ask for the same plan; the least weight stays."""
    found: dict[tuple[float, float], TradeOffPoint] = {}
    for point in sorted(points, key=lambda p: p.power_on_weight):
        found.setdefault((point.time_s, point.power_on_s), point)
    return tuple(found.values())


def trade_off_table(points: tuple[TradeOffPoint, ...]) -> Table | None:
    """The plans on the curve: from which weight on each is the best, and its hours."""
    return table(
        "Plans for other weights, each from the weight on that is given",
        "an hour of power-on is worth, h of campaign | campaign, h | power-on, h | proved",
        (
            (_weight(p.power_on_weight), hours(p.time_s), hours(p.power_on_s), "yes" if p.proved else "no")
            for p in points
        ),
    )


def _weight(weight: float) -> str:
    return "0" if weight < 1e-3 else "∞" if weight > 1e3 else digits(weight)
