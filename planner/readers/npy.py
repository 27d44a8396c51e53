"""NumPy .npy recordings: a matrix, or named fields; read through a memory map."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from planner.errors import InputError
from planner.protocols import RawBlock
from planner.readers._arrays import wanted_blocks


class NpyReader:
    """Columns column_1 … of a matrix (n, k), or the fields of a structured array (n,)."""

    name = "npy"
    suffixes = (".npy",)

    def recognises(self, path: Path, head: bytes) -> bool:
        """By the magic number of the npy format."""
        return head.startswith(b"\x93NUMPY")

    def names(self, path: Path, skip_lines: int = 0) -> tuple[str, ...]:
        """Field names or column_1 …."""
        return tuple(_columns(path))

    def blocks(
        self, path: Path, wanted: Sequence[str], texts: Sequence[str] = (), skip_lines: int = 0
    ) -> Iterator[RawBlock]:
        """The wanted columns in blocks."""
        yield from wanted_blocks(path, _columns(path), wanted, texts)


def _columns(path: Path) -> dict[str, Any]:
    """Name -> (n,) view into the file. Raises InputError for pickled objects, other shapes and a cut file."""
    import numpy as np

    try:
        array = np.load(path, mmap_mode="r", allow_pickle=False)
    except (ValueError, OSError, EOFError) as error:
        raise InputError(f"{path} is not a whole .npy file of numbers: {error}") from error
    if array.dtype.names:
        return {name: array[name] for name in array.dtype.names}
    if array.ndim != 2:
        raise InputError(f"{path}: an array of shape {array.shape}; expected rows × columns")
    return {f"column_{i + 1}": array[:, i] for i in range(array.shape[1])}


READER = NpyReader()
