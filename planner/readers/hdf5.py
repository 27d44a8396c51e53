"""HDF5 recordings, and MATLAB's .mat v7.3 files, which are HDF5 with the axes turned."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from planner.errors import InputError
from planner.protocols import RawBlock
from planner.readers._arrays import column_names, wanted_blocks

MAGIC = b"\x89HDF\r\n\x1a\n"


class Hdf5Reader:
    """Datasets (n,) and (n, k), also in groups as `imu/gyro_1`; a v7.3 file stores (k, n)."""

    name = "hdf5"
    suffixes = (".h5", ".hdf5", ".mat")

    def recognises(self, path: Path, head: bytes) -> bool:
        """By HDF5's signature, at the start or behind MATLAB's text of 512 bytes."""
        return head.startswith(MAGIC) or head[512:520] == MAGIC

    def names(self, path: Path, skip_lines: int = 0) -> tuple[str, ...]:
        """The columns of the file. Raises InputError for a file that is not whole."""
        with _opened(path) as file:
            return tuple(_columns(file))

    def blocks(
        self, path: Path, wanted: Sequence[str], texts: Sequence[str] = (), skip_lines: int = 0
    ) -> Iterator[RawBlock]:
        """The wanted columns in blocks. Raises InputError for lengths that differ and for a damaged file."""
        with _opened(path) as file:
            try:
                yield from wanted_blocks(path, _columns(file), wanted, texts)
            except OSError as error:
                raise InputError(f"{path} is not a whole HDF5 file: {error}") from error


class _Column:
    """One column of a dataset, read slice by slice."""

    def __init__(self, dataset: Any, index: int | None, turned: bool) -> None:
        self.dataset, self.index, self.turned = dataset, index, turned

    def __len__(self) -> int:
        return int(self.dataset.shape[1 if self.turned else 0])

    def __getitem__(self, rows: slice) -> Any:
        if self.turned:
            return self.dataset[self.index or 0, rows]
        return self.dataset[rows] if self.index is None else self.dataset[rows, self.index]


def _opened(path: Path) -> Any:
    import h5py

    try:
        return h5py.File(path, "r")
    except OSError as error:
        raise InputError(f"{path} is not a whole HDF5 file: {error}") from error


def _columns(file: Any) -> dict[str, _Column]:
    """Column name -> where it stands; MATLAB's datasets carry the attribute MATLAB_class."""
    import h5py

    found: dict[str, Any] = {}

    def note(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.ndim in (1, 2) and not name.startswith("#"):
            found[name] = item

    file.visititems(note)
    turned = {name: "MATLAB_class" in item.attrs and item.ndim == 2 for name, item in found.items()}
    shapes = {n: tuple(item.shape[::-1]) if turned[n] else tuple(item.shape) for n, item in found.items()}
    return {
        column: _Column(found[name], index, turned[name])
        for column, (name, index) in column_names(shapes).items()
    }


READER = Hdf5Reader()
