"""HDF5 recordings, and MATLAB's .mat v7.3 files, which are HDF5 with the axes turned."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planner.errors import InputError
from planner.protocols import RawBlock
from planner.readers._arrays import columns_of, wanted_blocks

MAGIC = b"\x89HDF\r\n\x1a\n"


class Hdf5Reader:
    """Datasets (n,), (n, k), (n, k, m), also in groups as `imu/gyro_1`; a v7.3 file turns the sides round."""

    name = "hdf5"
    suffixes = (".h5", ".hdf5", ".mat")

    def recognises(self, path: Path, head: bytes) -> bool:
        """By HDF5's signature, at the start or behind MATLAB's text of 512 bytes."""
        return head.startswith(MAGIC) or head[512:520] == MAGIC

    def names(self, path: Path, skip_lines: int = 0) -> tuple[str, ...]:
        """The columns of the file. Raises InputError for a file that is not whole."""
        with _opened(path) as file:
            return tuple(_columns(path, file))

    def blocks(
        self, path: Path, wanted: Sequence[str], texts: Sequence[str] = (), skip_lines: int = 0
    ) -> Iterator[RawBlock]:
        """The wanted columns in blocks. Raises InputError for lengths that differ and for a damaged file."""
        with _opened(path) as file:
            try:
                yield from wanted_blocks(path, _columns(path, file), wanted, texts)
            except (OSError, RuntimeError, KeyError) as error:
                raise InputError(f"{path} is not a whole HDF5 file: {error}") from error


class _Turned:
    """A dataset of MATLAB's: its sides stand the other way round."""

    def __init__(self, dataset: Any) -> None:
        self.dataset = dataset
        self.shape = tuple(dataset.shape[::-1])

    def __getitem__(self, place: Any) -> Any:
        places = place if isinstance(place, tuple) else (place,)
        whole = (*places, *[slice(None)] * (len(self.shape) - len(places)))
        return np.asarray(self.dataset[whole[::-1]]).T


def _opened(path: Path) -> Any:
    import h5py

    try:
        return h5py.File(path, "r")
    except OSError as error:
        raise InputError(f"{path} is not a whole HDF5 file: {error}") from error


def _columns(path: Path, file: Any) -> dict[str, Any]:
    """Column name -> where it stands; MATLAB's datasets carry the attribute MATLAB_class."""
    import h5py

    found: dict[str, Any] = {}

    def note(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.ndim in (1, 2, 3) and not name.startswith("#"):
            if item.dtype.names:
                found.update(
                    {f"{name}.{field}": item.fields(field) for field in item.dtype.names if item.ndim == 1}
                )
            else:
                found[name] = _Turned(item) if "MATLAB_class" in item.attrs and item.ndim > 1 else item

    try:
        file.visititems(note)
    except Exception as error:  # h5py raises many kinds for what is damaged within
        raise InputError(f"{path} is not a whole HDF5 file: {error}") from error
    flat = {
        n: _Flat(a) if len(a.shape) == 2 and a.shape[0] == 1 < a.shape[1] else a for n, a in found.items()
    }
    return columns_of(flat)


class _Flat:
    """A matrix of a single row as one column."""

    def __init__(self, array: Any) -> None:
        self.array = array
        self.shape = (array.shape[1],)

    def __getitem__(self, rows: slice) -> Any:
        return self.array[0, rows]


READER = Hdf5Reader()
