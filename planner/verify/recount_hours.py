"""When people are there: the spec's shifts as windows of the week, and the first moment that suits them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Protocol

from planner.quantities import DAY_S, WEEKDAYS
from planner.spec.days_off import WEEKS, days_off, first_monday
from planner.spec.model import Spec

WEEK = 7 * DAY_S


class Attended(Protocol):
    """Something that takes time, with people or without."""

    @property
    def seconds(self) -> float:
        """How long."""
        ...

    @property
    def attended(self) -> bool:
        """Whether people must be there."""
        ...


def earliest(spec: Spec, block: Sequence[Attended], clock: float) -> float:
    """The first moment from `clock` on at which all that needs people falls into their hours."""
    spans, offset = [], 0.0
    for e in block:
        if e.attended:
            spans.append((offset, offset + e.seconds))
        offset += e.seconds
    windows, turn = windows_of(spec), period_of(spec)
    if not spans or not windows:
        return clock
    start = start_of(spec)
    first = int((clock + start) // turn) - 1
    openings = [a + k * turn for k in range(first, first + 4) for a, _ in windows]
    candidates = [clock + start, *(o - a for o in openings for a, _ in spans if o - a > clock + start)]
    for t in sorted(candidates):
        if all(is_open(windows, t + a, t + b, turn) for a, b in spans):
            return t - start
    return clock


def windows_of(spec: Spec) -> list[tuple[float, float]]:
    """(opens, closes) from Monday 00:00 of the first week, those that touch joined; none on a day off."""
    every, turn = [], period_of(spec)
    weeks = int(turn // WEEK)
    monday = first_monday(spec)
    off = {(day - monday).days for day in days_off(spec)} if monday else set()
    for shift in spec.plan.shifts:
        length = (shift.closes - shift.opens) % DAY_S or DAY_S
        for day, k in product(shift.days, range(weeks)):
            number = WEEKDAYS.index(day) + 7 * k
            opens = DAY_S * number + shift.opens
            if number not in off:
                every += [(opens + turns * turn, opens + length + turns * turn) for turns in (-1, 0, 1)]
    joined: list[tuple[float, float]] = []
    for a, b in sorted(every):
        if joined and a <= joined[-1][1] + 1e-9:
            joined[-1] = (joined[-1][0], max(b, joined[-1][1]))
        else:
            joined.append((a, b))
    return [(a, b) for a, b in joined if 0 <= a < turn or a < 0 < b]


def period_of(spec: Spec) -> float:
    """After which the hours come again: a week, or as many as days off are known of."""
    return WEEKS * WEEK if days_off(spec) else WEEK


def is_open(windows: Sequence[tuple[float, float]], a: float, b: float, turn: float = WEEK) -> bool:
    """Whether a … b, in seconds from a Monday 00:00, lies in one window; they come again every `turn`."""
    shift = (a // turn) * turn
    return any(
        o + k * turn - 1e-6 <= a - shift and b - shift <= c + k * turn + 1e-6
        for o, c in windows
        for k in (-1, 0, 1)
    )


def start_of(spec: Spec) -> float:
    """Second 0 of the campaign from Monday 00:00: as said, else when the first shift opens."""
    said = [shift.start for shift in spec.plan.shifts if shift.start is not None]
    if said:
        return float(said[0]) % WEEK
    firsts = [DAY_S * WEEKDAYS.index(day) + s.opens for s in spec.plan.shifts for day in s.days]
    return min(firsts, default=0.0)
