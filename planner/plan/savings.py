"""What each rule of the schedule saves: the same work timed again without the rule, nothing solved anew."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from planner.nouns.choices import Campaign, ErrorChoice, TestVisits
from planner.plan.loads import load_sizes
from planner.plan.schedule_to_steps import bench_timings, makespan
from planner.spec.model import Spec

if TYPE_CHECKING:  # as in planner.plan.schedule_to_steps
    from planner.nouns.plan import Saving


def savings(spec: Spec, campaign: Campaign, time_s: float) -> tuple[Saving, ...]:
    """Hours that each rule which is on saves of `time_s`, for the same temperatures and repeats.

    overlap: cool-down during ramp and soak; order: the free order against the better monotone one;
    shared_records: one record for several errors against one each; parallel_benches: several batches at
    once; capacity: several units on a bench at once. Each is measured alone, so they do not add up.
    """
    from planner.nouns.plan import Saving

    found = _without(spec, campaign)
    return tuple(Saving(rule, round((seconds - time_s) / 3600, 9) + 0.0) for rule, seconds in found)


def with_plan(spec: Spec, **changes: Any) -> Spec:
    """The spec with other planning choices."""
    return spec.model_copy(update={"plan": spec.plan.model_copy(update=changes)})


def _without(spec: Spec, campaign: Campaign) -> Iterator[tuple[str, float]]:
    """(rule, seconds of the campaign without it)."""
    visits = campaign.visits
    sizes = load_sizes(spec, bench_timings(spec, visits))
    several = any(len(own) > 1 for own in sizes.values())
    if spec.plan.overlap:
        yield "overlap", makespan(with_plan(spec, overlap=()), visits)
    if spec.plan.shifts and spec.plan.order in ("free", "up_and_down"):
        yield "order", min(makespan(with_plan(spec, order=order), visits) for order in ("up", "down"))
    if any(len(_served(campaign, visit.test)) > 1 for visit in visits):
        yield "shared_records", makespan(*one_record_per_error(spec, campaign))
    if several and len(sizes) > 1:
        yield "parallel_benches", makespan(spec, visits, in_parallel=False)
    if several and any(spec.benches[name].count > 1 for name in sizes):
        yield "copies", makespan(spec, visits, count=dict.fromkeys(sizes, 1))
    if spec.plan.units is not None and any(max(own) > 1 for own in sizes.values()):
        single = {name: bench.model_copy(update={"units": 1}) for name, bench in spec.benches.items()}
        yield "capacity", makespan(spec.model_copy(update={"benches": single}), visits)


def one_record_per_error(spec: Spec, campaign: Campaign) -> tuple[Spec, tuple[TestVisits, ...]]:
    """The spec and the visits in which every error has records of its own, as many as serve it now.

    Each error is then known as well as in the campaign. (What an error alone would need at least is not told
    by the choice: where records are shared, any number up to those of the others costs it nothing.)
    """
    tests, fixed = dict(spec.tests), dict(spec.plan.fixed)
    visits: list[TestVisits] = []
    for visit in campaign.visits:
        served = _served(campaign, visit.test)
        if len(served) < 2:
            visits.append(visit)
            continue
        made = dict(zip(visit.temperatures_degc, visit.repeats, strict=True))
        for choice in served:
            name = f"{visit.test} for {choice.error}"
            tests[name] = tests[visit.test]
            if visit.test in fixed:
                fixed[name] = fixed[visit.test]
            points = tuple(sorted(choice.points.temperatures_degc))
            visits.append(TestVisits(name, points, tuple(made[t] for t in points)))
    return with_plan(spec.model_copy(update={"tests": tests}), fixed=fixed), tuple(visits)


def _served(campaign: Campaign, test: str) -> Sequence[ErrorChoice]:
    return [choice for choice in campaign.choices if choice.test == test]
