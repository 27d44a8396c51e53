"""The nouns of a history in store: series of measured errors over days, and what is wrong with them.

A series is one coefficient of one channel of one unit, SI. What is cleaned is always said: doubled days are
averaged, what lies before a declared repair or replacement does not tell what follows it, after a
recalibration the level starts anew. Steps and outliers that nobody declared are found with the model of
drift (`shocks`), values that cannot be right before it (`suspects`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import date, timedelta

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array

RESTARTS = ("repair", "replacement")
RENEWALS = ("recalibration",)
EVENTS = (*RESTARTS, *RENEWALS)
_LONG_GAP = 3.0  # times the usual step
_NAMED = 4  # units in one remark


@dataclass(frozen=True)
class Event:
    """What somebody wrote on a day."""

    day: float
    word: str

    @property
    def kind(self) -> str:
        """`repair`, `replacement`, `recalibration`, or nothing for a remark."""
        first = self.word.split()[0].strip(":,.;").lower() if self.word.split() else ""
        return first if first in EVENTS else ""


@dataclass(frozen=True)
class Series:
    """One coefficient over days: error `gyro.bias`, term `x`; day, value, sigma: (n,), sigma NaN if unknown.

    unit: of the fleet; display: unit to show it in; events: what was written of the unit
    fresh: days on which the level starts anew, what it does otherwise going on
    doubtful: the last value may be an outlier or a step; the next one will tell
    """

    unit: str
    error: str
    term: str
    display: str
    day: Array
    value: Array
    sigma: Array
    events: tuple[Event, ...] = ()
    fresh: tuple[float, ...] = ()
    doubtful: bool = False

    def __len__(self) -> int:
        return len(self.day)

    @property
    def name(self) -> str:
        """`u1 gyro.bias x`."""
        return f"{self.unit} {self.error} {self.term}"

    def only(self, keep: NDArray[np.bool_]) -> Series:
        """Some of its points, (n,) flags."""
        return replace(self, day=self.day[keep], value=self.value[keep], sigma=self.sigma[keep])


@dataclass(frozen=True)
class History:
    """All series of a fleet. start: the calendar date of day 0, None when the file counts days only.

    suspects: values that cannot be right, to be looked at before anything else is done
    """

    series: tuple[Series, ...]
    source: str
    start: date | None = None
    notes: tuple[str, ...] = ()
    suspects: tuple[str, ...] = ()

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


def ordered(history: History) -> History:
    """The history in order of days, without doubled days, begun anew where somebody declared it."""
    series, notes = [], list[str]()
    for one in history.series:
        order = np.argsort(one.day, kind="stable")
        one = replace(one, day=one.day[order], value=one.value[order], sigma=one.sigma[order])
        one = _without_doubles(one, history, notes)
        series.append(_begun_anew(one))
    kept = [s for s in series if len(s)]
    notes += [f"{s.unit}: {_gaps(s, history)}" for s in kept if _gaps(s, history)]
    said = [*_declared(history), *gathered(notes)]
    return replace(history, series=tuple(kept), notes=(*history.notes, *said))


def gathered(notes: Sequence[str]) -> list[str]:
    """Remarks of the same kind on many units or channels as one: `u1 gyro.bias x: said` by what was said."""
    by_text: dict[str, list[str]] = {}
    for note in notes:
        who, sign, text = note.partition(": ")
        by_text.setdefault(text if sign else note, []).append(who if sign else "")
    found = []
    for text, named in by_text.items():
        names = list(dict.fromkeys(filter(None, named)))
        more = f" and {len(names) - _NAMED + 1} more" if len(names) > _NAMED else ""
        shown = names if len(names) <= _NAMED else names[: _NAMED - 1]
        found.append(f"{', '.join(shown)}{more}: {text}" if names else text)
    return found


def _declared(history: History) -> list[str]:
    """One note for every unit with events: none may be hidden behind others."""
    by_unit: dict[str, dict[Event, None]] = {}
    last: dict[str, float] = {}
    for s in history.series:
        by_unit.setdefault(s.unit, {}).update(dict.fromkeys(s.events))
        last[s.unit] = max(last.get(s.unit, -np.inf), float(s.day.max()))
    found = []
    for unit in sorted(by_unit):
        events = sorted(by_unit[unit], key=lambda e: (e.day, e.word))
        anew = [f"{e.word} on {history.label(e.day)}" for e in events if e.kind]
        other = [f"{e.word!r} on {history.label(e.day)}" for e in events if not e.kind]
        if anew:
            found.append(f"{unit}: starts anew after {', '.join(anew)}, as the file says")
        if other:
            found.append(
                f"{unit}: {', '.join(other)} is a remark; only {', '.join(EVENTS)} start a history anew"
            )
    return found


def _without_doubles(one: Series, history: History, notes: list[str]) -> Series:
    days, first, place, count = np.unique(one.day, return_index=True, return_inverse=True, return_counts=True)
    if np.all(count == 1):
        return one
    mean = np.bincount(place, one.value) / count
    spread = np.sqrt(np.bincount(place, np.where(np.isnan(one.sigma), 0.0, one.sigma) ** 2)) / count
    told = ", ".join(history.label(d) for d in days[count > 1][:3])
    notes.append(f"{one.unit}: more than one value on {told}; their mean was taken")
    return replace(one, day=days, value=mean, sigma=np.where(np.isnan(one.sigma[first]), np.nan, spread))


def _begun_anew(one: Series) -> Series:
    """Without what lies before the last repair or replacement; days of recalibrations kept as fresh."""
    restarts = [e.day for e in one.events if e.kind in RESTARTS and e.day <= one.day[-1]]
    if restarts:
        one = one.only(one.day >= max(restarts))
    renewals = [e.day for e in one.events if e.kind in RENEWALS and one.day[0] < e.day <= one.day[-1]]
    first_after = [float(one.day[np.searchsorted(one.day, day)]) for day in renewals]
    return replace(one, fresh=tuple(sorted({*one.fresh, *first_after})))


def _gaps(one: Series, history: History) -> str:
    """What is to be said of the days of a series, if anything."""
    if len(one) < 3:
        return {1: "one point tells no drift", 2: "two points tell little of its drift"}[len(one)] + (
            "; what the fleet and the spec's storage say stands for it"
        )
    step = np.diff(one.day)
    usual = float(np.median(step))
    k = int(np.argmax(step))
    if step[k] > _LONG_GAP * usual:
        between = f"{history.label(one.day[k])} and {history.label(one.day[k + 1])}"
        return f"nothing between {between}; the gap counts as it is, nothing was filled in"
    return "the days are irregular; they were taken as they are" if np.ptp(step) > 0.5 * usual else ""
