"""Several files of one run, joined by time: accelerometer and gyro apart, or rows of each kind in turn.

The recording's own file sets the times. A sensor that stands elsewhere is brought to them: the nearest sample
where both are about as fast, the mean of what fell into a step where it is faster, a straight line between
samples where it is slower. Nothing is made up in its gaps.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError
from planner.nouns.array import Array
from planner.recordings.column_map import SENSOR_KEYS, AxisColumns, ColumnMap, OneColumn
from planner.recordings.parts import plain_text
from planner.recordings.samples import Samples, joined

SAME_RATE = 1.5  # times as fast, either way, is about as fast
LONGEST_STEPS = 5.0  # usual steps of the follower: a longer one is a gap


@dataclass(frozen=True)
class Source:
    """One file of a run, with the rows of it that count and what the map says of it."""

    path: Path
    columns: ColumnMap
    where: Mapping[str, str]
    keys: tuple[str, ...]


def sources_of(path: Path, columns: ColumnMap) -> list[Source]:
    """The files of one run, that which sets the times first.

    path: the recording, or a folder of its files. Raises InputError for a file that is not there.
    """
    groups: dict[tuple[str, tuple[tuple[str, str], ...]], dict[str, Any]] = {}
    for key, part in columns.parts.items():
        where = tuple((str(c), plain_text(text)) for c, text in part.where.items())
        groups.setdefault((str(_beside(path, part)), where), {})[key] = part
    if len(groups) == 1 and not path.is_dir():
        ((file, where),) = groups
        if Path(file) == path and not where:
            return [Source(path, columns, {}, tuple(columns.parts))]
    found = [_source(Path(file), columns, dict(where), parts) for (file, where), parts in groups.items()]
    for source in found:
        if not source.path.is_file():
            raise InputError(
                f"{path}: the map reads {', '.join(source.keys)} from {source.path}, which is no file"
            )
    own = [s for s in found if s.path == path and not s.where and {"gyro", "acc"} & set(s.keys)]
    sensors = [s for s in found if {"gyro", "acc"} & set(s.keys)]
    first = (own or sensors)[0]
    return [first, *(source for source in found if source is not first)]


def _beside(path: Path, part: AxisColumns | OneColumn) -> Path:
    """The file of a part: the recording's own, one beside it, or one in the folder."""
    if part.file is None:
        if path.is_dir():
            raise InputError(f"{path} is a folder; name the file of every sensor in the map, file: acc.csv")
        return path
    if isinstance(part.file, str):
        return (path if path.is_dir() else path.parent) / part.file
    name = path.name
    for old, new in part.file.items():
        if not old or old not in name:
            raise InputError(f"{path}: the map replaces {old!r} in the file's name, where it does not stand")
        name = name.replace(old, new)
    return path.with_name(name)


def _source(
    path: Path, columns: ColumnMap, where: Mapping[str, str], parts: Mapping[str, AxisColumns | OneColumn]
) -> Source:
    """The map of one file alone: its parts, and its own times where a part names them."""
    times = [part.time for part in parts.values() if isinstance(part, AxisColumns) and part.time is not None]
    lone = {key: parts.get(key) for key in (*SENSOR_KEYS, "temperature")}
    changed = columns.model_copy(update={**lone, "time": times[0] if times else columns.time})
    return Source(path, changed, dict(where), tuple(parts))


# ---------------------------------------------------------------- bringing together


class Follower:
    """The samples of another file at the times of the recording; asked in order of time.

    blocks: (start of the file's clock, samples) of the other file; name: of it, for people
    """

    def __init__(self, blocks: Iterator[tuple[float, Samples]], name: str) -> None:
        self.blocks, self.name = blocks, name
        self.held: Samples | None = None
        self.ended = False
        self.step = np.nan
        self.way = ""
        self.met = False

    def at(self, time: Array) -> Samples:
        """The follower's samples at (n,) absolute times in s, rising; what it lacks is NaN and not good."""
        self._read_to(float(time[-1]) if len(time) else -np.inf)
        held = self.held
        if held is None or not len(held) or not len(time):
            raise InputError(f"{self.name} has no samples")
        if not self.way:
            self._choose(time, held)
        place = np.searchsorted(held.time, time)
        right = np.clip(place, 0, len(held) - 1)
        left = np.clip(place - 1, 0, len(held) - 1)
        far = np.minimum(np.abs(held.time[right] - time), np.abs(held.time[left] - time))
        apart = held.time[right] - held.time[left] > LONGEST_STEPS * self.step
        missing = (far > LONGEST_STEPS * self.step / 2) | (apart & (far > self.step))
        self.met |= bool((~missing).any())
        taken = {"nearest": self._nearest, "mean": self._mean, "line": self._line}[self.way]
        found = taken(held, time, left, right)
        self._drop_before(float(time[-1]))
        values = np.where(missing[:, None], np.nan, found.values)
        return Samples(
            time, values, found.temperature_degc, found.reference, None, found.good & ~missing, found.spike
        )

    def close(self, path: Path) -> None:
        """Raises InputError when the two never meet in time."""
        if not self.met:
            raise InputError(
                f"{self.name} and {path} have no time in common; do their clocks begin alike, in one unit? "
                "`time` within the sensor of the map is the other file's"
            )

    def _choose(self, time: Array, held: Samples) -> None:
        own = float(np.median(np.diff(time))) if len(time) > 1 else np.nan
        self.step = float(np.median(np.diff(held.time))) if len(held) > 1 else own
        ratio = own / self.step if self.step > 0 else 1.0
        self.way = "mean" if ratio > SAME_RATE else "line" if ratio < 1 / SAME_RATE else "nearest"
        self.own = own

    @property
    def remark(self) -> str:
        """How the follower was brought to the recording's times."""
        words = {
            "nearest": "the nearest sample",
            "mean": "means over its steps, which are longer",
            "line": "straight lines between samples, which are further apart",
        }
        return f"{self.name} is joined by time: {words.get(self.way, '')}"

    def _read_to(self, end: float) -> None:
        margin = 0.0 if not np.isfinite(self.step) else (LONGEST_STEPS + 1) * self.step
        parts = [] if self.held is None else [self.held]
        while not self.ended and (not parts or not len(parts[-1]) or parts[-1].time[-1] <= end + margin):
            block = next(self.blocks, None)
            if block is None:
                self.ended = True
                break
            start, samples = block
            parts.append(_from(start, samples))
        self.held = joined(parts) if parts else None

    def _drop_before(self, end: float) -> None:
        """What lies long before the last asked time is not asked again."""
        if self.held is not None:
            first = int(np.searchsorted(self.held.time, end - 2 * LONGEST_STEPS * max(self.step, self.own)))
            self.held = self.held[max(0, first - 2) :]

    def _nearest(
        self, held: Samples, time: Array, left: NDArray[np.intp], right: NDArray[np.intp]
    ) -> Samples:
        closer = np.abs(held.time[right] - time) < np.abs(held.time[left] - time)
        return held[np.where(closer, right, left)]

    def _line(self, held: Samples, time: Array, left: NDArray[np.intp], right: NDArray[np.intp]) -> Samples:
        span = np.maximum(held.time[right] - held.time[left], 1e-12)
        share = np.clip((time - held.time[left]) / span, 0.0, 1.0)
        values = held.values[left] + share[:, None] * (held.values[right] - held.values[left])
        warm = held.temperature_degc
        degc = warm[left] + share * (warm[right] - warm[left])
        reference = held.reference
        if reference is not None:
            reference = reference[left] + share[:, None] * (reference[right] - reference[left])
        good = held.good[left] & held.good[right]
        return Samples(time, values, degc, reference, None, good, held.spike[left])

    def _mean(self, held: Samples, time: Array, left: NDArray[np.intp], right: NDArray[np.intp]) -> Samples:
        """Over half a step to either side; the nearest where nothing fell into it."""
        half = self.own / 2.0
        first = np.searchsorted(held.time, time - half)
        last = np.searchsorted(held.time, time + half)
        near = self._nearest(held, time, left, right)
        empty = last <= first
        values = np.where(empty[:, None], near.values, _between(held.values, first, last))
        degc = np.where(
            empty, near.temperature_degc, _between(held.temperature_degc[:, None], first, last)[:, 0]
        )
        reference = None if held.reference is None else _between(held.reference, first, last)
        return Samples(time, values, degc, reference, None, near.good, near.spike)


def _between(values: Array, first: NDArray[np.intp], last: NDArray[np.intp]) -> Array:
    """(n, k) means of rows first … last − 1 of (m, k) values, by sums from the beginning."""
    sums = np.vstack([np.zeros((1, values.shape[1])), np.cumsum(np.nan_to_num(values), axis=0)])
    means = (sums[last] - sums[first]) / np.maximum(last - first, 1)[:, None]
    return np.where(np.isnan(values).all(axis=0), np.nan, means)


def _from(start: float, samples: Samples) -> Samples:
    """The samples with times on the file's own clock."""
    return Samples(samples.time + start, *list(vars(samples).values())[1:])
