"""A plan before it leaves: as planner writes it, within its limits, with time enough for every move."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from planner.control import limits
from planner.control.kinematics import change, move_s
from planner.control.orders import AxisOrder, MotionError, orders
from planner.errors import Fault, InputError
from planner.nouns.bench import BenchFacts
from planner.nouns.plan_file import MOST_FAULTS, PlanDocument, typed_plan
from planner.nouns.step import Step


def checked_plan(document: object) -> PlanDocument:
    """The typed plan, every step within the limits of its bench.

    Raises InputError for what is no plan, and naming the steps that are more than their benches can do
    (`planner.control.limits`) or that leave an axis too little time for a move.
    """
    plan = typed_plan(document)
    wrong = [*limits.faults(plan.benches, plan.steps), *_hasty(plan)]
    if wrong:
        more = f" ({len(wrong)} in all)" if len(wrong) > MOST_FAULTS else ""
        faults = [
            Fault("plan.json", 0, 0, f"steps.{step.id}", why, "P903") for step, why in wrong[:MOST_FAULTS]
        ]
        raise InputError(f"the plan is more than its benches can do{more}", faults)
    return plan


def _hasty(plan: PlanDocument) -> Iterator[limits.Wrong]:
    for name, steps in limits.by_bench(plan.steps).items():
        bench = plan.benches.get(name)
        if bench is not None and bench.rate_dps is not None and bench.angular_acceleration_dps2 is not None:
            yield from _moves(bench, steps, bench.angular_acceleration_dps2)


def _moves(bench: BenchFacts, steps: list[Step], acceleration: float) -> Iterator[limits.Wrong]:
    """Moves for which the plan leaves too little time at the bench's own limits.

    A turning axis stops in the wait before the move, as far as there is one. A move without time of its own
    is made in that wait altogether.
    """
    before: Mapping[int, AxisOrder] = {}
    since = steps[0].start_s
    for step in steps:
        if step.action == "record":
            before, since = _told(step, bench), step.end_s
        if step.action != "move" or not step.motion:
            continue
        wait, own = step.start_s - since, step.seconds
        turning = [o.value for o in before.values() if o.mode == "rate"]
        stop = max((change(rate, 0.0, acceleration)[0] for rate in turning), default=0.0)
        held = {axis: o for axis, o in before.items() if o.mode == "position"}
        told = _told(step, bench).values()
        go = max((move_s(held.get(o.axis), o, bench, acceleration) for o in told), default=0.0)
        need, left = (go + max(0.0, stop - wait), own) if own else (go + stop, wait)
        if need > left + 1e-3:
            yield step, f"needs {need:.2f} s to move, the plan leaves {left:.2f} s"


def _told(step: Step, bench: BenchFacts) -> Mapping[int, AxisOrder]:
    """What the axes are told; nothing where the bench cannot do it, which is a fault of its own."""
    try:
        return {order.axis: order for order in orders(step.motion, bench)}
    except MotionError:
        return {}
