"""When people are there: the shifts of a plan against the time by which a run goes.

The rule. Nobody is asked for anything outside the shifts.

- A step that needs people begins when they are there for all of its planned time. A repeat of a test is one
  power-on, so what may have to wait is its power-on: until people are there for every attended step up to its
  power-off. Only when delays push an attended step of a running repeat out of the shift does the repeat wait
  in its middle, powered.
- A `pause` that belongs to no test is the plan's waiting for a shift. It lasts until what follows it may
  begin, not for its planned time: whoever is late waits less, whoever is early waits longer.
- People finish what they have begun: a step may end `overtime_s` after the shift.

The time of the week is this computer's local time on a real bench. With simulators (and on paper) it is the
plan's: the first step of the session is made at its planned moment, and the clock counts on from there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime

from planner.bench_run.clock import Clock
from planner.bench_run.job import Job
from planner.nouns.step import Step
from planner.quantities import DAY_S, FIRST_MONDAY, week_words
from planner.solvers.calendar import Calendar, Passage, Span, calendar

WEEK_S = 7 * DAY_S


def local_week_s() -> float:
    """Seconds from FIRST_MONDAY 00:00 by this computer's local time: in whole weeks, a Monday 00:00."""
    now = datetime.now()
    days = (now.date() - FIRST_MONDAY).days
    return DAY_S * days + 3600.0 * now.hour + 60.0 * now.minute + now.second + now.microsecond * 1e-6


class Hours:
    """How long a step has to wait for people.

    week: () -> seconds from a Monday 00:00, of a plan with a date from FIRST_MONDAY, now. The waiting is
    asked for again while it lasts, so that a clock that is put forward or back in between does no harm.
    """

    def __init__(self, job: Job, week: Callable[[], float], overtime_s: float) -> None:
        self._steps, self._week = job.steps, week
        windows = [(opens, closes + overtime_s) for opens, closes in job.shifts]
        always = Calendar(WEEK_S, (), always=True)
        self._calendar = calendar(job.period_s, windows) if windows else always
        self._monday_s = job.monday_s
        self._known: dict[tuple[Span, ...], Passage] = {}

    def left(self, index: int) -> float:
        """Seconds until step `index` may begin; 0 when it may begin now, or needs nobody."""
        spans = attended_spans(self._steps, index)
        if self._calendar.always or not spans:
            return 0.0
        now = self._week() - self._monday_s
        return max(0.0, float(self._passage(spans)(now)) - spans[-1][1] - now)

    def opens(self, index: int) -> str:
        """When step `index` may begin, as `mon 08:00`."""
        return week_words((self._week() + self.left(index) + 30.0) % WEEK_S)

    def _passage(self, spans: tuple[Span, ...]) -> Passage:
        """Work that ends with its last attended step; what fits into no week needs people only to begin."""
        if spans not in self._known:
            try:
                found = self._calendar.passage(spans, spans[-1][1])
            except ValueError:
                found = self._calendar.passage([(spans[0][0], spans[0][0])], spans[-1][1])
            self._known[spans] = found
        return self._known[spans]


def attended_spans(steps: Sequence[Step], index: int) -> tuple[Span, ...]:
    """(start, end) of the attended steps of what begins with step `index`, in planned seconds from its start.

    That is the step alone, or all of its repeat up to power-off.
    """
    first = steps[index]
    found = []
    for i in range(index, len(steps)):
        step = steps[i]
        if step is not first and not same_repeat(first, step):
            break
        if step.attended:
            found.append((step.start_s - first.start_s, step.end_s - first.start_s))
        if first.test is None or step.action == "power_off":
            break
    return tuple(found)


def begins(steps: Sequence[Step], index: int) -> bool:
    """Whether step `index` has to look whether people are there: it needs them, or begins a repeat."""
    return steps[index].attended or steps[index].action == "power_on"


def same_place(one: Step, other: Step) -> bool:
    """Whether two steps are made on one bench at one temperature."""
    return one.bench == other.bench and one.temperature_degc == other.temperature_degc


def same_repeat(one: Step, other: Step) -> bool:
    """Whether two steps belong to one repeat of a test."""
    if one.test is None or other.test is None:
        return same_place(one, other) and (one.test, one.repeat) == (other.test, other.repeat)
    return (one.visit, one.test, one.repeat) == (other.visit, other.test, other.repeat)


def planned_week(clock: Clock, moment_s: float) -> Callable[[], float]:
    """The seconds of the week, where it is `moment_s` now and the clock counts on from there."""
    start = clock.now()
    return lambda: moment_s + clock.now() - start
