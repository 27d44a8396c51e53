"""The clock of a recording: written times, counters that wrap, and clocks that jitter.

A clock jitters when its steps differ by over half of the usual one in more than 5 % of them: stamps that a
computer gave on arrival. Samples are then taken together in equal steps, each the mean of what arrived in it,
so that what follows sees an even clock; steps in which nothing arrived stay gaps.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError
from planner.nouns.array import Array
from planner.protocols import RawBlock
from planner.recordings.column_map import CLOCK, ISO, ColumnMap, factor, is_written_time
from planner.recordings.samples import Account, Samples, joined

DAY_S = 86400.0
_DATES = ("%d", "%j", "%x", "%c", "%s")
ODD_STEP = 0.5  # of the usual step: what differs by more is odd
MOST_ODD = 0.05  # share of odd steps of an even clock: lost samples
PAUSE = 20.0  # usual steps: a longer one is a gap in any clock
WIDEST = 4.0  # mean steps that samples of a jittering clock are taken together over, at most


@dataclass(frozen=True)
class Clock:
    """Steps in s: usual (median), mean without pauses, deviation; step: what the samples are taken over."""

    usual: float
    mean: float
    deviation: float
    step: float
    jitters: bool


def clock_of(time: Array) -> Clock | None:
    """The clock of (n,) times in s; None for fewer than three, or where time stands still."""
    steps = np.diff(time)
    steps = steps[steps > 0]  # where power-ons stand one behind the other, time falls
    if len(steps) < 2:
        return None
    usual = float(np.median(steps))
    near = steps[steps <= PAUSE * max(usual, float(np.percentile(steps, 75)))]
    if not len(near) or not np.isfinite(usual) or near.mean() <= 0:
        return None
    mean = float(near.mean())
    odd = float(np.mean(np.abs(near - usual) > ODD_STEP * usual))
    if odd <= MOST_ODD:
        even = near[near <= 3 * usual]
        return Clock(usual, mean, float(near.std()), float(even.mean()), False)
    wide = float(np.clip(np.percentile(near, 95), mean, WIDEST * mean))
    return Clock(usual, mean, float(near.std()), wide, True)


def evened(blocks: Iterator[Samples], step: float) -> Iterator[Samples]:
    """Samples of equal steps of `step` s: the mean of the good samples in each; empty steps are left out."""
    rest: Samples | None = None
    for block in blocks:
        here = block if rest is None else joined([rest, block])
        number = np.floor(here.time / step + 1e-9).astype(np.int64)
        open_from = int(np.searchsorted(number, number[-1])) if len(number) else 0
        if open_from:
            yield _binned(here[:open_from], number[:open_from], step)
        rest = here[open_from:]
    if rest is not None and len(rest):
        yield _binned(rest, np.floor(rest.time / step + 1e-9).astype(np.int64), step)


def _binned(samples: Samples, number: NDArray[np.int64], step: float) -> Samples:
    first = np.flatnonzero(np.diff(number, prepend=number[0] - 1))
    good = samples.good
    count = np.add.reduceat(good.astype(float), first)
    temperature = samples.temperature_degc
    known = np.isfinite(temperature)
    warm = np.add.reduceat(known.astype(float), first)
    label = samples.label
    if label is not None:
        last = np.append(first[1:], len(samples)) - 1
        label = np.where(label[first] == label[last], label[first], "")
    return Samples(
        time=np.asarray((number[first] + 0.5) * step, dtype=np.float64),
        values=_means(np.where(good[:, None], samples.values, 0.0), first, count),
        temperature_degc=np.where(
            warm > 0, np.add.reduceat(np.where(known, temperature, 0.0), first) / np.maximum(warm, 1), np.nan
        ),
        reference=None
        if samples.reference is None
        else _means(samples.reference, first, np.diff(np.append(first, len(samples))).astype(float)),
        label=label,
        good=count > 0,
        spike=np.zeros(len(first), dtype=bool),
    )


def _means(values: Array, first: NDArray[np.intp], count: Array) -> Array:
    return np.asarray(np.add.reduceat(values, first, axis=0) / np.maximum(count, 1)[:, None])


# ---------------------------------------------------------------- times of a file


class SampleClock:
    """Time of the samples: from the column, or from the rate and the number of each sample.

    start: s on the file's own clock at the first sample, None before there is one
    """

    def __init__(
        self, path: Path, columns: ColumnMap, names: Mapping[str | int, str], account: Account
    ) -> None:
        self.path, self.columns, self.names, self.account = path, columns, names, account
        self.start: float | None = None
        self.last = -np.inf
        self.turns = 0.0
        self.before: float | None = None
        self.dropped = 0

    def timed(self, block: RawBlock, samples: Samples) -> Samples:
        """The samples with their times; those whose time does not rise are left out and counted."""
        part = self.columns.time
        if part is None:
            assert self.columns.rate is not None  # the map was checked
            self.start = 0.0
            return replace(samples, time=block.sample / self.columns.rate)
        time = self._unwrapped(self.seconds(block))
        finite = np.isfinite(time)
        if self.start is None and finite.any():
            self.start = float(time[finite][0])
        time = time - (self.start or 0.0)
        before = np.maximum.accumulate(np.concatenate([[self.last], np.where(finite, time, -np.inf)]))[:-1]
        rises = finite & (time > before)
        if not rises.all():
            first = int(np.flatnonzero(~rises)[0])
            self.dropped += int((~rises).sum())
            self.account.counts["time_not_rising"] += int((~rises).sum())
            self.account.note(f"time does not rise at sample {int(block.sample[first]) + 1}")
        steps = np.diff(time[rises], prepend=self.last if np.isfinite(self.last) else np.nan)
        if np.isfinite(steps).any():
            low, high = self.account.steps
            self.account.steps = (min(low, float(np.nanmin(steps))), max(high, float(np.nanmax(steps))))
        self.last = max(self.last, float(np.max(time, where=finite, initial=-np.inf)))
        return replace(samples, time=time)[rises]

    def seconds(self, block: RawBlock) -> Array:
        """(n,) s on the file's clock, of a map that names a column of time."""
        part = self.columns.time
        assert part is not None
        raw = block.columns[self.names[part.column]]
        if is_written_time(part.unit):
            seconds = written_seconds(raw, part.unit)
            if len(seconds) and not np.isfinite(seconds).any():
                raise InputError(f"{self.path}: {str(raw[0])!r} is no time of the unit {part.unit!r}")
            return seconds
        with np.errstate(over="ignore", invalid="ignore"):  # times that are not finite are left out
            raw = self._uncounted(raw, part.wraps)
            seconds = (raw * part.scale + part.offset) * factor(part.unit)
            if part.plus is not None:
                more = part.plus
                raw = block.columns[self.names[more.column]]
                seconds = seconds + ((raw - more.zero) * more.scale + more.offset) * factor(more.unit)
        return np.asarray(seconds)

    def _uncounted(self, raw: Array, wraps: float | None) -> Array:
        """Counts that go on where the counter begins again: a fall of over half of its range."""
        if wraps is None or not len(raw):
            return raw
        steps = np.diff(raw, prepend=raw[0] if self.before is None else self.before)
        found = raw + self.turns + wraps * np.cumsum(np.nan_to_num(steps) < -wraps / 2)
        self.before, self.turns = float(raw[-1]), float(found[-1] - raw[-1])
        return np.asarray(found)

    def _unwrapped(self, time: Array) -> Array:
        """Times of day, without a date, that go on over midnight."""
        part = self.columns.time
        if part is None or not _without_date(part.unit):
            return time
        last = self.last + (self.start or 0.0) if np.isfinite(self.last) else time[0] if len(time) else 0.0
        before = np.concatenate([[last], time + self.turns])[:-1] if len(time) else time
        found = time + self.turns + DAY_S * np.cumsum(np.nan_to_num(time + self.turns - before) < -DAY_S / 2)
        if len(found) and np.isfinite(found[-1]):
            self.turns = float(found[-1] - time[-1])
        return np.asarray(found)

    def close(self, rows: int) -> None:
        """Raises InputError when so much ran back that the clock must have been set, or files joined."""
        if self.dropped > 0.01 * (rows + self.dropped) + 2:
            raise InputError(
                f"{self.path}: time does not rise in {self.dropped} of {rows + self.dropped} samples "
                f"({'; '.join(self.account.remarks[:1])}); was the clock set, or were recordings joined? "
                "Power-ons one behind the other are told apart by `run: {clock: restarts}` in the map"
            )


def _without_date(unit: str) -> bool:
    return unit.lower() == CLOCK or ("%" in unit and not any(sign in unit for sign in _DATES))


def written_seconds(texts: NDArray[Any], unit: str) -> Array:
    """(n,) s of times in words; NaN for what is none. `iso`, `clock`, or a pattern of strptime."""
    read = {ISO: _iso, CLOCK: _of_clock}.get(unit.lower())
    if read is None:
        pattern = unit

        def read(text: str) -> float:
            return (dt.datetime.strptime(text, pattern) - _EPOCH).total_seconds()

    return np.array([_or_nan(read, str(text).strip()) for text in texts], dtype=float)


_EPOCH = dt.datetime(1970, 1, 1)
_EPOCH_UTC = _EPOCH.replace(tzinfo=dt.UTC)


def _or_nan(read: Any, text: str) -> float:
    try:
        return float(read(text))
    except (ValueError, OverflowError):
        return np.nan


def _iso(text: str) -> float:
    found = dt.datetime.fromisoformat(text.replace(",", "."))
    return (found - (_EPOCH if found.tzinfo is None else _EPOCH_UTC)).total_seconds()


def _of_clock(text: str) -> float:
    hours, minutes, seconds = text.replace(",", ".").split(":")
    return 3600.0 * int(hours) + 60.0 * int(minutes) + float(seconds)
