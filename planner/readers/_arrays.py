"""Arrays of numbers as columns: what npy, HDF5 and MATLAB files have in common."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError
from planner.protocols import RawBlock

BLOCK_ROWS = 1 << 18  # 12 columns of doubles are 25 MB


def column_names(arrays: Mapping[str, tuple[int, ...]]) -> dict[str, tuple[str, int | None]]:
    """Column name -> (array, its column): `gyro` for one dimension, `gyro_1` … for the columns of a matrix.

    arrays: name -> shape (rows,) or (rows, k); other shapes, and matrices of a single row, are left out.
    """
    found: dict[str, tuple[str, int | None]] = {}
    for name, shape in arrays.items():
        if len(shape) == 1 or (len(shape) == 2 and shape[1] == 1):
            found[name] = (name, None if len(shape) == 1 else 0)
        elif len(shape) == 2 and shape[1] <= 256:
            found |= {f"{name}_{i + 1}": (name, i) for i in range(shape[1])}
    return found


def wanted_blocks(
    path: Path, columns: Mapping[str, Any], wanted: Sequence[str], texts: Sequence[str]
) -> Iterator[RawBlock]:
    """The wanted ones of a file's columns, name -> (rows,), in blocks.

    Raises InputError when their lengths differ, when there are no rows, and for what is no number.
    """
    chosen = {name: columns[name] for name in wanted}
    rows = _same_length(path, {name: len(column) for name, column in chosen.items()})
    yield from _blocks(path, chosen, texts, rows)


def _same_length(path: Path, lengths: Mapping[str, int]) -> int:
    """The number of rows that all wanted columns have. Raises InputError when they differ, or it is none."""
    if len(set(lengths.values())) > 1:
        told = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise InputError(f"{path}: the columns have different lengths: {told}")
    rows = next(iter(lengths.values()), 0)
    if not rows:
        raise InputError(f"{path} has no rows")
    return rows


def _blocks(path: Path, columns: Mapping[str, Any], texts: Sequence[str], rows: int) -> Iterator[RawBlock]:
    """Blocks from things that can be sliced, name -> (rows,)."""
    for start in range(0, rows, BLOCK_ROWS):
        stop = min(start + BLOCK_ROWS, rows)
        block = {name: as_column(path, name, c[start:stop], name in texts) for name, c in columns.items()}
        yield RawBlock(block, np.arange(start, stop), {})


def as_column(path: Path, name: str, values: Any, text: bool) -> NDArray[Any]:
    """Doubles, or texts. Raises InputError for anything else."""
    array = np.asarray(values)
    if text:
        return array.astype(np.str_) if array.dtype.kind != "S" else np.char.decode(array, "utf-8", "replace")
    if array.dtype.kind not in "fiub":
        raise InputError(f"{path}: column {name!r} holds no numbers")
    return array.astype(np.float64)
