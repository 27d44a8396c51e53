"""What the schedule adds to a plan: its total with waiting and batches, an honest gap, savings, wear."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from planner.nouns.choices import Campaign
from planner.nouns.plan import Plan, TradeOffPoint
from planner.plan.costs import weights_of
from planner.plan.loads import load_sizes
from planner.plan.savings import savings, with_plan
from planner.plan.schedule_to_steps import bench_timings, makespan
from planner.spec.attendance import WEEK_S, calendar_of, first_day, start_words
from planner.spec.days_off import WEEKS, days_off
from planner.spec.model import Spec

# The total and its bound are sums in different orders; beyond that the campaign is longer than the bound.
ROUNDING = 1e-9


def with_schedule_figures(
    plan: Plan, spec: Spec, chosen: Campaign, curve: Sequence[TradeOffPoint] = ()
) -> Plan:
    """The plan with its makespan, a bound that holds for it, and what its rules save.

    The integer program prices working time. Waiting for shifts and the passage of several batches may make
    the total larger than its bound (planner.plan.campaign_by_total); then gap = (total − bound) / total, and
    the total is not called proved, although the order of the temperatures is the best for the chosen work.
    """
    hours = calendar_of(spec)
    time = round(max((step.end_s for step in plan.steps), default=0.0), 6)
    plan = replace(
        plan,
        time_s=time,
        savings=savings(spec, chosen, time),
        trade_off=tuple(curve),
        work_proved=chosen.proved and not chosen.added,
        by_total=chosen.by_total,
        start=start_words(spec),
        shifts=hours.windows,
        shifts_period_s=hours.period,
        first_day=first_day(spec),
        days_off=tuple(days_off(spec).items()),
        notes=(*plan.notes, *_notes(spec, chosen, plan, time)),
    )
    return _with_bound(plan, spec, chosen) if spec.plan.shifts or spec.plan.units is not None else plan


def _with_bound(plan: Plan, spec: Spec, chosen: Campaign) -> Plan:
    of_time, of_power = weights_of(spec)
    bound = plan.objective_bound if chosen.total_bound is None else chosen.total_bound
    value = of_time * plan.time_s + of_power * plan.power_on_s
    gap = max(0.0, value - bound) / value if value > 0 else 0.0
    return replace(
        plan,
        bound_s=round(bound, 6),
        gap=gap if gap > ROUNDING else 0.0,
        objective_value=round(value, 6),
        objective_bound=round(bound, 6),
        proved=plan.proved and gap <= ROUNDING,
    )


def _notes(spec: Spec, chosen: Campaign, plan: Plan, time: float) -> Iterator[str]:
    timings = bench_timings(spec, chosen.visits)
    if spec.plan.shifts:
        waiting = max(time - makespan(with_plan(spec, shifts=()), chosen.visits), 0.0) / 3600
        yield (
            f"plan.shifts: {waiting:.2f} h of the campaign are waiting for people, which bound_s leaves out; "
            "for this work the timeline is the shortest that plan.order allows"
        )
    if time > WEEKS * WEEK_S and days_off(spec):
        yield f"plan.shifts.holidays: days off are those of the first {WEEKS} weeks, then again and again"
    if chosen.by_total:
        yield (
            "temperatures and repeats: another choice takes less work, but longer with waiting and batches; "
            "of those that were timed this one is done first"
        )
    if not all(timing.is_exact for timing in timings):
        yield "plan.order: too many temperatures for the exact order under shifts; a monotone one was taken"
    sizes = load_sizes(spec, timings)
    if any(len(own) > 1 for own in sizes.values()):
        said = ", ".join(f"{name} {len(own)} loads of up to {own[0]} units" for name, own in sizes.items())
        yield f"plan.units: {said}; time_s is when the last unit is done, power_on_s is of each unit"
    life = spec.unit.service_life
    if life is not None and plan.power_on_s > life:
        yield (
            f"unit.service_life: {plan.power_on_s / 3600:.1f} h of power-on are more than the "
            f"{life / 3600:g} h that a unit lives; 'minimise: power_on' or a weight of it spares the unit"
        )
