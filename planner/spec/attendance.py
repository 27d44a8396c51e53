"""When people must be there: the shifts of a spec as a calendar, and what of a test's repeat is attended."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date, timedelta

from planner import catalog
from planner.quantities import DAY_S, WEEKDAYS, week_words
from planner.solvers.calendar import Calendar, Span, calendar
from planner.spec.days_off import WEEKS, days_off, first_monday
from planner.spec.model import Bench, Spec, Test
from planner.spec.motions import AxisMotion, may_be_turned_by_hand, motions_of, turned_by_hand
from planner.spec.plan_choice import Shift
from planner.spec.ramp import lead_of

WEEK_S = 7 * DAY_S


def calendar_of(spec: Spec) -> Calendar:
    """The working hours, in seconds from Monday 00:00 of the week in which the campaign starts.

    Without shifts people are always there. They come again every week; with days off, after all of the weeks
    that those are known of. A night belongs to the day on which it begins.
    """
    if not spec.plan.shifts:
        return Calendar(WEEK_S, (), always=True)
    weekly = [window for shift in spec.plan.shifts for window in windows_of(shift)]
    monday, off = first_monday(spec), days_off(spec)
    if monday is None or not off:
        return calendar(WEEK_S, weekly)
    closed = {(day - monday).days for day in off}
    every = [(a + week * WEEK_S, b + week * WEEK_S) for week in range(WEEKS) for a, b in weekly]
    return calendar(WEEKS * WEEK_S, [(a, b) for a, b in every if int(a // DAY_S) not in closed])


def windows_of(shift: Shift) -> list[Span]:
    """(opens, closes) of every day of a shift; one that closes before it opens ends on the next day."""
    length = (shift.closes - shift.opens) % DAY_S or DAY_S
    opens = [DAY_S * WEEKDAYS.index(day) + shift.opens for day in shift.days]
    return [(a, a + length) for a in opens]


def start_of(spec: Spec) -> float:
    """Second 0 of the campaign, in seconds from Monday 00:00: as said, else when the first shift begins."""
    said = [shift.start for shift in spec.plan.shifts if shift.start is not None]
    if said:
        return said[0] % WEEK_S
    return min((a for shift in spec.plan.shifts for a, _ in windows_of(shift)), default=0.0)


def start_words(spec: Spec) -> str | None:
    """`mon 08:00`, or None without shifts."""
    if not spec.plan.shifts:
        return None
    return week_words(start_of(spec))


def first_day(spec: Spec) -> date | None:
    """The date of second 0 of the campaign, where the spec says it."""
    monday = first_monday(spec)
    return None if monday is None else monday + timedelta(days=start_of(spec) // DAY_S)


def install_attended(spec: Spec, bench: str) -> bool:
    """Whether install and remove of a bench need people: unless the spec says that they do not."""
    return spec.benches[bench].attended is not False


def people_at(
    name: str, bench: Bench, test: Test, motions: Sequence[AxisMotion | None]
) -> tuple[bool, tuple[bool, ...]]:
    """Whether people make a test's power-ons, and each of its moves: as said, else where they turn it."""
    if test.attended is not None:
        return test.attended, (test.attended,) * len(motions)
    return False, turned_by_hand(name, bench, motions)


def is_attended(spec: Spec, name: str) -> bool:
    """Whether a test's power-ons or moves need people."""
    test = spec.tests[name]
    return bool(attended_spans(test.bench, spec.benches[test.bench], test))


def moves(name: str, bench: Bench, test: Test) -> bool:
    """Whether the bench moves before a record: not if motions are only counted and take no time."""
    known = (bench.kind or name) in catalog.benches()
    return bool(bench.move) or known or not isinstance(test.motions, int)


def attended_spans(name: str, bench: Bench, test: Test) -> tuple[Span, ...]:
    """(start, end) of what people do in one repeat, seconds from its power-on: power-on and moves."""
    if test.attended is False or not (test.attended or may_be_turned_by_hand(name, bench)):
        return ()
    switching, moving = people_at(name, bench, test, motions_of(name, bench, test))
    spans = [(0.0, test.power_on)] if switching else []
    if moves(name, bench, test):
        each = record_time(bench, test)
        begins = [test.power_on + m * each for m, people in enumerate(moving) if people]
        spans += [(begin, begin + bench.move) for begin in begins]
    return tuple(spans)


def powered_time(bench: Bench, test: Test) -> float:
    """Seconds of one repeat from power-on to power-off: all but the last gap and the cool-down."""
    return test.power_on + test.motion_count * record_time(bench, test) - test.gap


def record_time(bench: Bench, test: Test) -> float:
    """Seconds from one record to the next: the move, the record with what it has of a ramp, and the gap."""
    return bench.move + test.record + 2.0 * lead_of(test) + test.gap


def off_time(test: Test) -> float:
    """Seconds for which the unit stays switched off after a repeat, to cool down."""
    return test.gap + test.cool_down
