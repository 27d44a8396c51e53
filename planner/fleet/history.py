"""The nouns of a history in store: series of measured errors over days, and what is wrong with them.

A series is one coefficient of one channel of one unit, SI. What is cleaned is always said: doubled days are
averaged, a lone outlier is set aside, and what lies before a jump (a repair, another calibration) does not
tell the drift after it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import date, timedelta

import numpy as np

from planner.nouns.array import Array

_FEW = 12
_JUMP = 8.0  # robust sigmas of the increments; 12 from few points, whose sigma is itself poorly known
_JUMP_OF_FEW = 12.0
_ENOUGH_FOR_JUMPS = 6
_FLOOR = 1e-3  # of the largest value: increments below that are rounding of the file
_LONG_GAP = 3.0  # times the usual step


@dataclass(frozen=True)
class Series:
    """One coefficient over days: error `gyro.bias`, term `x`; day, value, sigma: (n,), sigma NaN if unknown.

    unit: of the fleet; display: unit to show it in; events: days from which it starts anew
    """

    unit: str
    error: str
    term: str
    display: str
    day: Array
    value: Array
    sigma: Array
    events: tuple[float, ...] = ()

    def __len__(self) -> int:
        return len(self.day)

    @property
    def name(self) -> str:
        """`u1 gyro.bias x`."""
        return f"{self.unit} {self.error} {self.term}"

    def until(self, count: int) -> Series:
        """Its first points."""
        return replace(self, day=self.day[:count], value=self.value[:count], sigma=self.sigma[:count])


@dataclass(frozen=True)
class History:
    """All series of a fleet. start: the calendar date of day 0, None when the file counts days only."""

    series: tuple[Series, ...]
    source: str
    start: date | None = None
    notes: tuple[str, ...] = ()

    @property
    def units(self) -> tuple[str, ...]:
        """Names in order."""
        return tuple(sorted({s.unit for s in self.series}))

    @property
    def last_day(self) -> float:
        """The latest day of all series."""
        return max(float(s.day[-1]) for s in self.series)

    def label(self, day: float) -> str:
        """A day for people: a date if there is one, else `day 45`."""
        return day_label(self.start, day)


def day_label(start: date | None, day: float) -> str:
    """A day for people: a date if day 0 has one, else `day 45`."""
    if start is None:
        return f"day {day:.0f}"
    return (start + timedelta(days=int(np.floor(day)))).isoformat()


def cleaned(history: History) -> History:
    """The history in order of days, without doubled days, outliers and what lies before a jump."""
    series, notes = [], list(history.notes)
    for one in history.series:
        kept, said = _clean(one, history)
        series.append(kept)
        notes += said
    return replace(history, series=tuple(series), notes=tuple(gathered(notes)))


def gathered(notes: Sequence[str]) -> list[str]:
    """Notes of the same kind on many channels as one: `u1 gyro.bias x: said` by what was said."""
    by_text: dict[str, list[str]] = {}
    for note in notes:
        who, sign, text = note.partition(": ")
        by_text.setdefault(text if sign else note, []).append(who if sign else "")
    found = []
    for text, named in by_text.items():
        names = list(dict.fromkeys(filter(None, named)))
        more = f" and {len(names) - 3} more" if len(names) > 4 else ""
        shown = names if len(names) <= 4 else names[:3]
        found.append(f"{', '.join(shown)}{more}: {text}" if names else text)
    return found


def _clean(one: Series, history: History) -> tuple[Series, list[str]]:
    notes: list[str] = []
    order = np.argsort(one.day, kind="stable")
    one = replace(one, day=one.day[order], value=one.value[order], sigma=one.sigma[order])
    one = _without_doubles(one, history, notes)
    for event in one.events:
        if one.day[0] < event <= one.day[-1]:
            notes.append(f"{one.name}: starts anew on {history.label(event)}, as the file says")
            one = _since(one, event)
    one = _without_jumps(one, history, notes)
    _look_at_gaps(one, history, notes)
    return one, notes


def _without_doubles(one: Series, history: History, notes: list[str]) -> Series:
    days, first, place, count = np.unique(one.day, return_index=True, return_inverse=True, return_counts=True)
    if np.all(count == 1):
        return one
    mean = np.bincount(place, one.value) / count
    spread = np.sqrt(np.bincount(place, np.where(np.isnan(one.sigma), 0.0, one.sigma) ** 2)) / count
    told = ", ".join(history.label(d) for d in days[count > 1][:3])
    notes.append(f"{one.name}: more than one value on {told}; their mean was taken")
    return replace(one, day=days, value=mean, sigma=np.where(np.isnan(one.sigma[first]), np.nan, spread))


def _without_jumps(one: Series, history: History, notes: list[str]) -> Series:
    while len(one) >= _ENOUGH_FOR_JUMPS:
        apart = np.diff(one.day)
        step = np.diff(one.value) - float(np.median(np.diff(one.value) / apart)) * apart  # without the drift
        spread = 1.4826 * float(np.median(np.abs(step - np.median(step))))
        spread = max(spread, _FLOOR * float(np.abs(one.value).max()), 1e-300)
        far = step / (spread * np.sqrt(np.maximum(apart / np.median(apart), 1.0)))
        limit = _JUMP if len(one) >= _FEW else _JUMP_OF_FEW
        k = int(np.argmax(np.abs(far)))
        if abs(far[k]) <= limit:
            return one
        lone = k + 1 < len(far) and far[k] * far[k + 1] < 0 and abs(far[k] + far[k + 1]) < limit
        if lone:
            notes.append(f"{one.name}: the value on {history.label(one.day[k + 1])} lies alone; set aside")
            keep = np.arange(len(one)) != k + 1
            one = replace(one, day=one.day[keep], value=one.value[keep], sigma=one.sigma[keep])
            continue
        notes.append(
            f"{one.name}: jumps on {history.label(one.day[k + 1])} by {abs(far[k]):.0f} times "
            "its usual step, as "
            "after a repair; only what follows was used"
        )
        one = _since(one, float(one.day[k + 1]))
    return one


def _since(one: Series, day: float) -> Series:
    keep = one.day >= day
    return replace(one, day=one.day[keep], value=one.value[keep], sigma=one.sigma[keep])


def _look_at_gaps(one: Series, history: History, notes: list[str]) -> None:
    if len(one) < 3:
        said = "one point tells no drift" if len(one) == 1 else "two points tell no drift and its uncertainty"
        notes.append(f"{one.name}: {said}; the spec's storage stands for it")
        return
    step = np.diff(one.day)
    usual = float(np.median(step))
    k = int(np.argmax(step))
    if step[k] > _LONG_GAP * usual:
        notes.append(
            f"{one.name}: nothing between {history.label(one.day[k])} and {history.label(one.day[k + 1])}; "
            "the gap counts as it is, nothing was filled in"
        )
    elif np.ptp(step) > 0.5 * usual:
        notes.append(f"{one.name}: the days are irregular; they were taken as they are")
