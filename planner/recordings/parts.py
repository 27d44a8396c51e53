"""The power-ons of one file: by a column, by gaps in time, or where the clock begins again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError
from planner.protocols import RawBlock, RawReader
from planner.readers._arrays import RUN
from planner.recordings.column_map import ColumnMap, PowerOns, UnitColumn
from planner.recordings.samples import Account

MOST_PARTS = 10_000


@dataclass(frozen=True)
class Part:
    """The rows of one power-on: those that say what `where` does, from sample `first` to before `last`.

    together: they stand in one piece, so that first and last tell them all
    unit, run: what they are called; None: as the file and the map say
    """

    where: Mapping[str, str] = field(default_factory=dict)
    first: int = 0
    last: int | None = None
    together: bool = False
    unit: str | None = None
    run: int | None = None

    def taken(self, block: RawBlock) -> RawBlock:
        """The block's rows of this power-on; samples are counted from its first, and on without holes."""
        keep = block.sample >= self.first
        if self.last is not None:
            keep &= block.sample < self.last
        for name, text in () if self.together else self.where.items():
            keep &= same_text(block.columns[name], text)
        if keep.all() and not self.first and not self.where:
            return block
        columns = {name: values[keep] for name, values in block.columns.items()}
        sample = block.sample[keep] - self.first
        return RawBlock(columns, sample, block.losses, block.remarks)


def same_text(values: NDArray[Any], text: str) -> NDArray[np.bool_]:
    """(n,) which texts are that one; `1.0` is the same as `1`."""
    texts = np.asarray(values, dtype=np.str_)
    kinds, which = np.unique(texts, return_inverse=True)
    return np.asarray(np.array([plain_text(kind) == text for kind in kinds], dtype=bool)[which])


def plain_text(text: str | float) -> str:
    """A text without blanks around it, a whole number without its point."""
    stripped = str(text).strip()
    try:
        number = float(stripped)
    except ValueError:
        return stripped
    return str(int(number)) if number.is_integer() and abs(number) < 1e15 else stripped


def parts_of(
    path: Path, reader: RawReader, columns: ColumnMap, names: Mapping[str | int, str], given: tuple[str, ...]
) -> list[Part]:
    """The power-ons of a file, in its order; one that is the whole file when the map tells none apart.

    names: source -> column; given: the file's columns. Raises InputError where there are too many.
    """
    keys = []
    if isinstance(columns.unit, UnitColumn):
        keys.append(names[columns.unit.column])
    runs = columns.run
    if isinstance(runs, PowerOns) and runs.column is not None:
        keys.append(names[runs.column])
    elif RUN in given:
        keys.append(RUN)
    if keys:
        found = _by_columns(path, reader, columns, keys, isinstance(columns.unit, UnitColumn))
    elif isinstance(runs, PowerOns):
        found = _by_time(path, reader, columns, runs, names)
    else:
        return [Part()]
    if len(found) > MOST_PARTS:
        raise InputError(f"{path} would be {len(found)} power-ons; is that the column, or the gap?")
    return found


@dataclass
class _Extent:
    """From which sample to before which one the rows of a power-on reach, and whether in one piece."""

    first: int
    last: int = -1
    together: bool = True

    def take(self, first: int, last: int) -> None:
        """Rows first … last − 1 are of it too."""
        self.together &= self.last in (-1, first)
        self.last = last


def _by_columns(
    path: Path, reader: RawReader, columns: ColumnMap, keys: Sequence[str], has_unit: bool
) -> list[Part]:
    """One for every combination of texts, in the order of the first rows."""
    seen: dict[tuple[str, ...], _Extent] = {}
    for block in reader.blocks(path, keys, keys, columns.skip_lines):
        stacked = np.column_stack([np.asarray(block.columns[key], dtype=np.str_) for key in keys])
        if not len(stacked):
            continue
        new = np.append(True, (stacked[1:] != stacked[:-1]).any(axis=1))[: len(stacked)]
        starts = np.flatnonzero(new)
        stops = np.append(starts[1:], len(stacked))
        for start, stop in zip(starts.tolist(), stops.tolist(), strict=True):
            texts = tuple(plain_text(text) for text in stacked[start])
            extent = seen.setdefault(texts, _Extent(int(block.sample[start])))
            extent.take(int(block.sample[start]), int(block.sample[stop - 1]) + 1)
        if len(seen) > MOST_PARTS:
            break
    numbers: dict[str, int] = {}
    found = []
    for texts, extent in seen.items():
        unit = texts[0] if has_unit else None
        number = numbers[unit or ""] = numbers.get(unit or "", -1) + 1
        run = columns.first_run + number
        where, last = dict(zip(keys, texts, strict=True)), extent.last if extent.together else None
        first = extent.first if extent.together else 0
        found.append(Part(where, first, last, extent.together, unit, run))
    return found


def _by_time(
    path: Path, reader: RawReader, columns: ColumnMap, runs: PowerOns, names: Mapping[str | int, str]
) -> list[Part]:
    edges = [0, *_edges(path, reader, columns, runs, names)]
    bounds = zip(edges, [*edges[1:], None], strict=True)
    return [Part(first=first, last=last, run=runs.first + i) for i, (first, last) in enumerate(bounds)]


def _edges(
    path: Path, reader: RawReader, columns: ColumnMap, runs: PowerOns, names: Mapping[str | int, str]
) -> Iterator[int]:
    """Samples with which another power-on begins."""
    from planner.recordings.clocks import SampleClock
    from planner.recordings.column_map import is_written_time

    time = columns.time
    assert time is not None  # the map was checked
    clock = SampleClock(path, columns, names, Account())
    wanted = [names[time.column], *([names[time.plus.column]] if time.plus else [])]
    texts = wanted[:1] if is_written_time(time.unit) else []
    last = np.nan
    for block in reader.blocks(path, wanted, texts, columns.skip_lines):
        seconds = clock.seconds(block)
        with np.errstate(invalid="ignore", over="ignore"):
            steps = np.diff(seconds, prepend=last)
            new = steps < 0 if runs.gap is None else (steps < 0) | (steps > runs.gap)
        yield from block.sample[new].tolist()
        known = seconds[np.isfinite(seconds)]
        last = float(known[-1]) if len(known) else last
