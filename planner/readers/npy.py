"""NumPy .npy and .npz recordings: a matrix, runs of them, or named fields; .npy through a memory map."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from planner.errors import InputError
from planner.protocols import RawBlock
from planner.readers._arrays import columns_of, wanted_blocks


class NpyReader:
    """Columns column_1 … of (n, k), also (n, k, m) and (m, n, k) of m runs; fields of a structured array.

    Of an .npz the columns of each array under its name, `gyro_1` …; its arrays are packed, so they are read
    whole.
    """

    name = "npy"
    suffixes = (".npy", ".npz")

    def recognises(self, path: Path, head: bytes) -> bool:
        """By the magic number of the npy format, or of a zip that is called .npz."""
        return head.startswith(b"\x93NUMPY") or (head.startswith(b"PK") and path.suffix.lower() == ".npz")

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
    import warnings

    import numpy as np

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that a damaged header may be of Python 2
            loaded = np.load(path, mmap_mode="r", allow_pickle=False)
        arrays = {"column": loaded} if isinstance(loaded, np.ndarray) else dict(loaded)
    except Exception as error:  # numpy, zipfile and tokenize raise ten kinds for a cut or foreign file
        raise InputError(f"{path} is not a whole .npy file of numbers: {error}") from error
    found: dict[str, Any] = {}
    for name, array in arrays.items():
        prefix = "" if len(arrays) == 1 and name == "column" else f"{name}."
        if array.dtype.names and array.ndim == 1:
            found |= {f"{prefix}{field}": array[field] for field in array.dtype.names}
    lone = arrays.get("column")
    if len(arrays) == 1 and lone is not None and not found and lone.ndim not in (2, 3):
        raise InputError(f"{path}: an array of shape {lone.shape}; expected rows × columns")
    return {**found, **columns_of({n: a for n, a in arrays.items() if not a.dtype.names})}


READER = NpyReader()
