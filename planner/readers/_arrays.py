"""Arrays of numbers as columns: what npy, HDF5 and MATLAB files have in common.

    (n,), (n, 1), (1, n)     one column, `gyro`
    (n, k)                   k columns, `gyro_1` …
    (n, k, m), (m, n, k)     k columns of m runs, one behind the other, and the column `array_run` from 1

n samples is the longest side of three; of the other two k is 3 where there is a 3, else 6, else the shorter.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError
from planner.protocols import RawBlock

BLOCK_ROWS = 1 << 18  # 12 columns of doubles are 25 MB
RUN = "array_run"
MOST_COLUMNS = 256


@dataclass(frozen=True)
class Sides:
    """Which side of a three-dimensional array is what, and how long samples and runs are."""

    sample: int
    column: int
    run: int
    samples: int
    runs: int


def sides_of(shape: tuple[int, ...]) -> Sides:
    """The sides of a shape of three."""
    sample = int(np.argmax(shape))
    others = [i for i in range(3) if i != sample]
    threes = [i for i in others if shape[i] == 3] or [i for i in others if shape[i] == 6]
    after = (sample + 1) % 3 if sample < 2 else 1  # (n, k, m), (m, n, k), (m, k, n) where two sides are 3
    column = min(others, key=lambda i: shape[i]) if not threes else after if after in threes else threes[0]
    (run,) = (i for i in others if i != column)
    return Sides(sample, column, run, shape[sample], shape[run])


class Column:
    """One column of an array of one or two dimensions, read slice by slice."""

    def __init__(self, array: Any, index: int | None) -> None:
        self.array, self.index = array, index

    def __len__(self) -> int:
        return int(self.array.shape[0])

    def __getitem__(self, rows: slice) -> Any:
        return self.array[rows] if self.index is None else self.array[rows, self.index]


class RunColumn:
    """One column of an array of three dimensions: the runs one behind the other."""

    def __init__(self, array: Any, sides: Sides, index: int) -> None:
        self.array, self.sides, self.index = array, sides, index

    def __len__(self) -> int:
        return self.sides.samples * self.sides.runs

    def __getitem__(self, rows: slice) -> Any:
        n = self.sides.samples
        pieces = []
        start = rows.start
        while start < rows.stop:
            run, first = divmod(start, n)
            last = min(n, first + rows.stop - start)
            pieces.append(self._piece(run, slice(first, last)))
            start += last - first
        return np.concatenate(pieces) if pieces else np.zeros(0)

    def _piece(self, run: int, samples: slice) -> Any:
        place: list[Any] = [0, 0, 0]
        place[self.sides.sample], place[self.sides.column], place[self.sides.run] = samples, self.index, run
        return np.asarray(self.array[tuple(place)])


class Repeated:
    """A column that all runs share, such as the time, or the number of the run itself."""

    def __init__(self, column: Any, sides: Sides) -> None:
        self.column, self.sides = column, sides

    def __len__(self) -> int:
        return self.sides.samples * self.sides.runs

    def __getitem__(self, rows: slice) -> Any:
        place = np.arange(rows.start, rows.stop)
        if self.column is None:
            return place // self.sides.samples + 1
        return np.asarray(self.column[slice(0, self.sides.samples)])[place % self.sides.samples]


def columns_of(arrays: Mapping[str, Any]) -> dict[str, Any]:
    """Column name -> what can be sliced, of arrays of one to three dimensions; others are left out."""
    cubes = {name: sides_of(a.shape) for name, a in arrays.items() if len(a.shape) == 3 and min(a.shape) > 0}
    sides = next(iter(cubes.values()), None)
    found: dict[str, Any] = {}
    for name, array in arrays.items():
        shape = tuple(array.shape)
        if name in cubes:
            width = shape[cubes[name].column]
            if width <= MOST_COLUMNS:
                found |= {f"{name}_{i + 1}": RunColumn(array, cubes[name], i) for i in range(width)}
        elif len(shape) == 1 or (len(shape) == 2 and shape[1] == 1):
            column = Column(array, None if len(shape) == 1 else 0)
            shared = sides is not None and shape[0] == sides.samples
            found[name] = Repeated(column, sides) if sides is not None and shared else column
        elif len(shape) == 2 and shape[1] <= MOST_COLUMNS:
            found |= {f"{name}_{i + 1}": Column(array, i) for i in range(shape[1])}
    if sides is not None:
        found[RUN] = Repeated(None, sides)
    return found


def wanted_blocks(
    path: Path, columns: Mapping[str, Any], wanted: Sequence[str], texts: Sequence[str]
) -> Iterator[RawBlock]:
    """The wanted ones of a file's columns, name -> (rows,), in blocks.

    Raises InputError when their lengths differ, when there are no rows, and for what is no number.
    """
    chosen = {name: columns[name] for name in wanted}
    rows = same_length(path, chosen)
    if not rows:
        raise InputError(f"{path} has no rows")
    for start in range(0, rows, BLOCK_ROWS):
        stop = min(start + BLOCK_ROWS, rows)
        block = {name: as_column(path, name, c[start:stop], name in texts) for name, c in chosen.items()}
        yield RawBlock(block, np.arange(start, stop), {})


def same_length(path: Path, columns: Mapping[str, Any]) -> int:
    """The number of rows that all columns have. Raises InputError when they differ."""
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise InputError(f"{path}: the columns have different lengths: {told}")
    return next(iter(lengths.values()), 0)


def as_column(path: Path, name: str, values: Any, text: bool) -> NDArray[Any]:
    """Doubles, or texts. Raises InputError for anything else."""
    array = np.asarray(values)
    if text:
        return array.astype(np.str_) if array.dtype.kind != "S" else np.char.decode(array, "utf-8", "replace")
    if array.dtype.kind == "M":  # moments: s since 1970
        return array.astype("datetime64[ns]").astype(np.int64) * 1e-9
    if array.dtype.kind not in "fiub":
        raise InputError(f"{path}: column {name!r} holds no numbers")
    return array.astype(np.float64)
