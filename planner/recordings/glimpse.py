"""A first look at a file of which nothing is known: its columns, their names and units, its first rows."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError
from planner.nouns.array import Array
from planner.protocols import RawReader
from planner.readers._arrays import RUN
from planner.recordings.formats import reader_of

MOST_ROWS = 1 << 18
_LARGEST = 1e100  # of a number at which somebody only looks: a broken one is none whose square overflows
MOST_COLUMNS = 128
_BRACKETED = re.compile(r"^(.*?)[\s_]*[\[({]\s*([^\])}]*?)\s*[\])}]\s*$")
_ENDINGS = {
    "dps": "deg/s", "deg_s": "deg/s", "degps": "deg/s", "rad_s": "rad/s", "radps": "rad/s", "rps": "rad/s",
    "mps2": "m/s^2", "ms2": "m/s^2", "m_s2": "m/s^2", "mss": "m/s^2", "mg": "mg", "g": "g",
    "ns": "ns", "nsec": "ns", "nsecs": "ns", "nanosec": "ns", "us": "us", "usec": "us", "ms": "ms",
    "msec": "ms", "s": "s", "sec": "s", "secs": "s", "degc": "degC", "c": "degC", "k": "K",
}  # fmt: skip


@dataclass(frozen=True)
class Glimpse:
    """The first rows of a file.

    names: of all columns; units: column -> unit that its name or a row of units says, where one does
    numbers: column -> (n,) of those that hold numbers; texts: column -> (n,) of the others
    skipped: lines above the table; whole: these rows are all that there are
    """

    path: Path
    reader: str
    names: tuple[str, ...]
    units: dict[str, str]
    numbers: dict[str, Array]
    texts: dict[str, NDArray[np.str_]]
    skipped: int
    whole: bool

    def __len__(self) -> int:
        return len(next(iter((self.numbers or self.texts).values()), ()))


def glimpse(path: Path) -> Glimpse:
    """The first rows of a file. Raises InputError when it cannot be read, or has no column of numbers."""
    reader = reader_of(path)
    names = reader.names(path)
    if len(names) > MOST_COLUMNS:
        raise InputError(f"{path} has {len(names)} columns, too many to guess from; write the map by hand")
    units = {name: unit for name in names if (unit := unit_of_name(name))}
    skipped, words = 0, set[str]()
    if reader.name == "text":
        from planner.readers.text import read_layout

        layout = read_layout(path)
        skipped = layout.skipped
        units |= {n: u for n, u in zip(names, layout.units, strict=False) if u}
        words = _words(path, names)
    numbers: dict[str, Array] = {}
    texts: dict[str, NDArray[np.str_]] = {}
    if reader.name in ("text", "packets", "parquet"):
        found = _rows(reader, path, tuple(n for n in names if n not in words), tuple(words))
        numbers = {n: v.astype(np.float64) for n, v in found.items() if n not in words}
        texts = {n: v.astype(np.str_) for n, v in found.items() if n in words}
    else:
        numbers = _of_one_length(reader, path, names)
    if not numbers:
        raise InputError(f"{path} has no column of numbers")
    numbers = {n: np.clip(v, -_LARGEST, _LARGEST) for n, v in numbers.items()}
    rows = len(next(iter(numbers.values())))
    return Glimpse(path, reader.name, names, units, numbers, texts, skipped, rows < MOST_ROWS)


def _rows(
    reader: RawReader, path: Path, numbers: tuple[str, ...], words: tuple[str, ...]
) -> dict[str, NDArray[np.generic]]:
    """Column -> the first rows; columns that cannot be numbers are left out."""
    wanted = [*numbers, *words]
    parts: list[dict[str, NDArray[np.generic]]] = []
    rows = 0
    for block in reader.blocks(path, wanted, words):
        parts.append(dict(block.columns))
        rows += len(block.sample)
        if rows >= MOST_ROWS:
            break
    if not rows:
        raise InputError(f"{path} has no samples")
    return {name: np.concatenate([part[name] for part in parts])[:MOST_ROWS] for name in wanted}


def _of_one_length(reader: RawReader, path: Path, names: tuple[str, ...]) -> dict[str, Array]:
    """Columns of numbers, those of the length that most of them have."""
    found: dict[str, Array] = {}
    for name in names:
        if name == RUN:
            continue
        try:
            found |= {n: v.astype(float) for n, v in _rows(reader, path, (name,), ()).items()}
        except InputError:
            continue
    usual = Counter(map(len, found.values())).most_common(1)
    return {name: values for name, values in found.items() if len(values) == usual[0][0]} if usual else {}


def _words(path: Path, names: tuple[str, ...]) -> set[str]:
    """Columns of a text file whose first cells are mostly no numbers."""
    from planner.readers._layout import cells_of, decoded, is_number
    from planner.readers.text import read_layout

    layout = read_layout(path)
    with path.open("rb") as file:
        file.seek(layout.offset)
        text = decoded(file.read(1 << 16))
    rows = [cells_of(line, layout.delimiter) for line in text.split(layout.newline)[:-1] if line.strip()]
    whole = [row for row in rows[:500] if len(row) == len(names)]
    found = set()
    for i, name in enumerate(names):
        cells = [row[i] for row in whole if row[i]]
        if cells and sum(is_number(cell, layout.decimal) for cell in cells) < 0.5 * len(cells):
            found.add(name)
    return found


def unit_of_name(name: str) -> str:
    """The unit that a name says: `acc_x [m/s^2]`, `gyro_x_dps`, `time_us`; empty for none."""
    told = _BRACKETED.match(name)
    if told and told[2]:
        return told[2]
    parts = re.split(r"[_\s.]+", bare_name(name))
    for count in (2, 1):
        ending = "_".join(parts[-count:]).lower()
        if len(parts) > count and ending in _ENDINGS:
            return _ENDINGS[ending]
    return ""


def bare_name(name: str) -> str:
    """The name without a unit in brackets."""
    told = _BRACKETED.match(name)
    return (told[1] if told else name).strip()
