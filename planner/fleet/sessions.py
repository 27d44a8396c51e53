"""Visits of a fleet on one calendar: who comes on which day, so that the surface is set up once for several
units.

Every unit's schedule has its visits as late as they can be, so each may be made earlier as long as the
unit's later visits, again as late as they can be, still carry it to the end: nothing is added, hours are
saved. The session of a day takes the unit that is due first, then the others in the order of their days,
until the working day is full. Days on which nobody works fall to the last working day before.

    hours of a session = set-up + Σ batches (longest power-ons and rests) + Σ units turns
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, timedelta

from planner.fleet.store import Visit, visit_time
from planner.fleet.visit_plans import StorePlan
from planner.fleet.visits import StorePlanner
from planner.spec.recalibration import Recalibration

_TIGHT = 1e-9
DAYS_BACK = 30  # a visit is made that much earlier at most for want of a free working day


@dataclass(frozen=True)
class Session:
    """One day of work in store. units: who comes; time_s: with one set-up; alone_s: the visits by themselves

    fits: whether it is no more than a working day on which people work; no other day carries these units if
    not
    """

    day: float
    units: tuple[str, ...]
    time_s: float
    alone_s: float
    fits: bool


@dataclass(frozen=True)
class WorkingDays:
    """When people work. days: of the week, 0 Monday; start: the calendar date of day 0; hours_s: of one
    day; off: dates on which nobody works"""

    start: date | None
    days: frozenset[int]
    hours_s: float
    off: frozenset[date] = frozenset()

    def works(self, day: float) -> bool:
        """Whether people work on a day of the count."""
        if self.start is None:
            return True
        date = self.start + timedelta(days=int(day))
        return date.weekday() in self.days and date not in self.off


@dataclass
class _Unit:
    """A unit on its way through the year. made: (day, visit) of what has a day; due: (day, visit) of what
    has none"""

    planner: StorePlanner
    plan: StorePlan
    made: list[tuple[float, Visit]]
    due: list[tuple[float, Visit]]

    def with_next_on(self, day: float) -> list[tuple[float, Visit]] | None:
        """What is due after the next visit was made on a day; None if that does not carry it to the end."""
        done = [*self.made, (day, self.due[0][1])]
        return self.planner.following(done, [v for _, v in self.due[1:]], self.plan.kept_until)


def on_one_calendar(
    planners: Sequence[StorePlanner], plans: Sequence[StorePlan], asked: Recalibration, working: WorkingDays
) -> tuple[tuple[StorePlan, ...], tuple[Session, ...]]:
    """The same visits on shared days; plans in the order given, sessions by day."""
    units = {
        p.unit: _Unit(planner, p, [], [(v.day, v.visit) for v in p.visits])
        for planner, p in zip(planners, plans, strict=True)
    }
    sessions: list[Session] = []
    waiting = {name for name, u in units.items() if u.due}
    while waiting:
        first = min(waiting, key=lambda name: (units[name].due[0][0], name))
        day = _day(units[first], working, {s.day for s in sessions})
        others = sorted(waiting - {first}, key=lambda n: (units[n].due[0][0], n))
        sessions.append(_session(day, [first, *others], units, asked, working))
        waiting = {name for name, u in units.items() if u.due}
    days = sorted({s.day for s in sessions})
    moved = tuple(units[p.unit].planner.replayed(p, units[p.unit].made) for p in plans)
    return moved, tuple(_merged([s for s in sessions if s.day == day], working) for day in days)


def _merged(sessions: Sequence[Session], working: WorkingDays) -> Session:
    """Sessions of one day as one."""
    day, time_s = sessions[0].day, sum(s.time_s for s in sessions)
    units = tuple(sorted(u for s in sessions for u in s.units))
    fits = working.works(day) and (time_s <= working.hours_s + _TIGHT or len(units) == 1)
    return Session(day, units, time_s, sum(s.alone_s for s in sessions), fits)


def _day(unit: _Unit, working: WorkingDays, taken: set[float]) -> float:
    """The last working day on which a unit's next visit still carries it, else the day it is due."""
    due, begins = unit.due[0][0], unit.made[-1][0] if unit.made else float(unit.plan.days[0])
    day = float(int(due))
    for _ in range(DAYS_BACK):
        if day < begins:
            break
        if working.works(day) and day not in taken and _after(unit, day) is not None:
            return day
        day -= 1.0
    return due


def _session(
    day: float,
    waiting: Sequence[str],
    units: dict[str, _Unit],
    asked: Recalibration,
    working: WorkingDays,
) -> Session:
    """One day: the unit that is waiting first, and whoever may come with it."""
    came: list[str] = []
    made: list[Visit] = []
    for name in waiting:
        unit = units[name]
        visit = unit.due[0][1]
        after = _after(unit, day)
        fits = session_time(asked, [*made, visit]) <= working.hours_s + _TIGHT
        if came and (after is None or not fits):
            continue
        unit.made.append((day, visit))
        unit.due = unit.due[1:] if after is None else after
        came.append(name)
        made.append(visit)
    alone = sum(v.time_s for v in made)
    return Session(day, tuple(came), session_time(asked, made), alone, fits=True)


def _after(unit: _Unit, day: float) -> list[tuple[float, Visit]] | None:
    """What is due after its next visit on a day, None if the unit cannot come then."""
    begins = unit.made[-1][0] if unit.made else float(unit.plan.days[0]) - 1.0
    return None if day <= begins else unit.with_next_on(day)


def session_time(asked: Recalibration, visits: Sequence[Visit]) -> float:
    """Seconds of one day: batches rest side by side, turns are one after another, one set-up for all."""
    rests = sorted((_resting(asked, v) for v in visits), reverse=True)
    batches = sum(rests[i] for i in range(0, len(rests), asked.units))
    turning = sum(v.time_s - asked.set_up - _resting(asked, v) for v in visits)
    return asked.set_up + batches + turning


def _resting(asked: Recalibration, v: Visit) -> float:
    """Seconds of a visit that units spend side by side: power-ons and rests."""
    spins = v.turns * 6 * (asked.turns * asked.turn + asked.move)
    return visit_time(asked, v.rests, v.turns) - asked.set_up - spins
