"""A start by the laboratory's clock against the shifts that the plan was laid into."""

from __future__ import annotations

from datetime import datetime, timedelta

from planner.errors import InputError
from planner.export._clock import WallClock, time_text
from planner.nouns.plan import Step
from planner.nouns.plan_file import PlanDocument
from planner.quantities import DAY_S, WEEKDAYS

WEEK_S = 7 * DAY_S
_ROUNDING_S = 1.0  # the wall's clock is in whole seconds


def checked_hours(plan: PlanDocument, clock: WallClock) -> tuple[str, ...]:
    """Notes on attended steps outside the shifts because the clocks are changed meanwhile.

    Raises InputError when the start itself is not the one that the shifts were laid from and steps that need
    people would fall outside them. A plan without shifts may start whenever it likes.
    """
    attended = [step for step in plan.steps if step.attended]
    outside = [step for step in attended if not _inside(plan, clock, step)] if plan.shifts else []
    if not outside:
        return ()
    words, first = week_words(clock.start), outside[0]
    many = f"{len(outside)} of {len(attended)} steps that need people"
    if words == plan.start:
        return (
            f"the clocks change during the campaign: {many} fall outside the shifts, the first is "
            f"{first.id}, {time_text(clock.at(first.start_s))}",
        )
    raise InputError(
        f"--start {clock.start:%Y-%m-%dT%H:%M} is {words}, the shifts were laid from {plan.start}: {many} "
        f"would fall outside them, the first is {first.id}, {time_text(clock.at(first.start_s))}; "
        f"start {_next(clock.start, plan.start)}, or say 'start: {words}' under plan.shifts and plan again"
    )


def start_notes(plan: PlanDocument) -> tuple[str, ...]:
    """What whoever starts a script must know: a script cannot look at the clock, `planner run` does."""
    if not plan.shifts:
        return ()
    return (
        f"waits for people last as long as in the plan: start the scripts {plan.start}, or use planner run",
    )


def week_words(moment: datetime) -> str:
    """`mon 08:00`."""
    return f"{WEEKDAYS[moment.weekday()]} {moment:%H:%M}"


def _inside(plan: PlanDocument, clock: WallClock, step: Step) -> bool:
    begin = clock.at(step.start_s)
    opens = DAY_S * begin.weekday() + 3600 * begin.hour + 60 * begin.minute + begin.second
    return any(
        shift.opens_s - _ROUNDING_S <= at and at + step.seconds <= shift.closes_s + _ROUNDING_S
        for shift in plan.shifts
        for at in (opens, opens + WEEK_S)
    )


def _next(moment: datetime, words: str | None) -> str:
    """The next time that these words name, as --start takes it."""
    day, time = (words or week_words(moment)).split()
    date = (moment + timedelta(days=(WEEKDAYS.index(day) - moment.weekday()) % 7)).date()
    return f"{date.isoformat()}T{time}"
