"""A start by the laboratory's clock against the shifts that the plan was laid into."""

from __future__ import annotations

from datetime import datetime, timedelta

from planner.errors import InputError
from planner.export._clock import WallClock, time_text
from planner.nouns.plan_file import PlanDocument
from planner.nouns.step import Step
from planner.quantities import DAY_S, WEEKDAYS

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
    words, first = _words(plan, clock.start), outside[0]
    begins = plan.start if plan.first_day is None else f"{plan.first_day} {str(plan.start).split()[1]}"
    many = f"{len(outside)} of {len(attended)} steps that need people"
    if words == begins:
        return (
            f"the clocks change during the campaign: {many} fall outside the shifts, the first is "
            f"{first.id}, {time_text(clock.at(first.start_s))}",
        )
    raise InputError(
        f"--start {clock.start:%Y-%m-%dT%H:%M} is {words}, the shifts were laid from {begins}: {many} "
        f"would fall outside them, the first is {first.id}, {time_text(clock.at(first.start_s))}; "
        f"start {_next(plan, clock.start)}, or say 'start: {words}' under plan.shifts and plan again"
    )


def start_notes(plan: PlanDocument) -> tuple[str, ...]:
    """What whoever starts a script must know: a script cannot look at the clock, `planner run` does."""
    if not plan.shifts:
        return ()
    return (
        f"waits for people last as long as in the plan: start the scripts {plan.start}"
        f"{f', {plan.first_day}' if plan.first_day else ''}, or use planner run",
    )


def week_words(moment: datetime) -> str:
    """`mon 08:00`."""
    return f"{WEEKDAYS[moment.weekday()]} {moment:%H:%M}"


def _inside(plan: PlanDocument, clock: WallClock, step: Step) -> bool:
    begin = clock.at(step.start_s)
    opens = DAY_S * begin.weekday() + 3600 * begin.hour + 60 * begin.minute + begin.second
    if plan.first_day is not None:  # from Monday of the week in which the plan begins
        monday = plan.first_day - timedelta(days=plan.first_day.weekday())
        opens += DAY_S * ((begin.date() - monday).days - begin.weekday())
    opens %= plan.shifts_period_s
    return any(
        shift.opens_s - _ROUNDING_S <= at and at + step.seconds <= shift.closes_s + _ROUNDING_S
        for shift in plan.shifts
        for at in (opens, opens + plan.shifts_period_s)
    )


def _words(plan: PlanDocument, moment: datetime) -> str:
    """`mon 08:00`, or `2026-12-21 08:00` where the plan knows its date."""
    return week_words(moment) if plan.first_day is None else f"{moment:%Y-%m-%d %H:%M}"


def _next(plan: PlanDocument, moment: datetime) -> str:
    """The start of the plan, or the next time of its name, as --start takes it."""
    day, time = (plan.start or week_words(moment)).split()
    if plan.first_day is not None:
        return f"{plan.first_day.isoformat()}T{time}"
    date = (moment + timedelta(days=(WEEKDAYS.index(day) - moment.weekday()) % 7)).date()
    return f"{date.isoformat()}T{time}"
