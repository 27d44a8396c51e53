"""What a plan says beside its figures: causes of what cannot be met, and what its time cut short."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from planner.errors import InfeasibleError
from planner.nouns.deadline import Deadline
from planner.nouns.plan import Plan
from planner.spec.model import Spec
from planner.spec.narrow_range import narrow_range


@contextmanager
def causes_said(spec: Spec, unaided: str | None) -> Iterator[None]:
    """What cannot be met because the height diverges, or the range is narrow, is refused with that said."""
    try:
        yield
    except InfeasibleError as error:
        narrow = narrow_range(spec)
        causes = [unaided, None if narrow is None else f"plan.temperatures.range {narrow}"]
        if not any(causes):
            raise
        raise InfeasibleError(
            "; ".join([str(error), *(c for c in causes if c)]),
            requirement=error.requirement,
            binds=error.binds,
            nearest_limit=error.nearest_limit,
        ) from None


def cut_short(made: Plan, deadline: Deadline) -> Plan:
    """The plan with what its time limit cut short, if it did; the search itself makes it incomplete."""
    if not deadline.cut:
        return made
    why = "stopped" if deadline.stop() else f"plan.time_limit: {deadline.seconds:g} s were over"
    said = f"{why}; cut short: {', '.join(deadline.cut)}"
    complete = made.complete and "the search" not in deadline.cut
    return replace(made, notes=(*made.notes, said), complete=complete)
