"""MATLAB .mat recordings up to version 7; version 7.3 is HDF5 and is read as such."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planner.errors import InputError
from planner.protocols import RawBlock
from planner.readers._arrays import column_names, wanted_blocks


class MatlabReader:
    """Variables (n, 1) or (1, n) as `time`, (n, k) as `gyro_1` …, fields of a struct as `imu.gyro_1`.

    The format packs each variable in one piece of at most 2 GB, so the wanted ones are read whole.
    """

    name = "matlab"
    suffixes = (".mat",)

    def recognises(self, path: Path, head: bytes) -> bool:
        """By the text on top, or the suffix for version 4, and by not being HDF5."""
        hdf5 = b"\x89HDF" in head[:520]
        return not hdf5 and (head.startswith(b"MATLAB 5.0") or path.suffix.lower() == ".mat")

    def names(self, path: Path, skip_lines: int = 0) -> tuple[str, ...]:
        """The columns of the file. Raises InputError for a file that is not whole."""
        return tuple(_columns(path))

    def blocks(
        self, path: Path, wanted: Sequence[str], texts: Sequence[str] = (), skip_lines: int = 0
    ) -> Iterator[RawBlock]:
        """The wanted columns in blocks. Raises InputError when their lengths differ."""
        yield from wanted_blocks(path, _columns(path), wanted, texts)


def _columns(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    try:
        variables = loadmat(path, simplify_cells=True)
    except Exception as error:  # scipy raises many kinds, down to struct.error, for a cut or foreign file
        raise InputError(f"{path} is not a whole MATLAB file: {type(error).__name__}: {error}") from error
    arrays = {name: np.asarray(a) for name, a in _flat(variables) if np.ndim(a) in (1, 2)}
    arrays = {name: a[0] if a.ndim == 2 and a.shape[0] == 1 else a for name, a in arrays.items()}
    places = column_names({name: a.shape for name, a in arrays.items()})
    return {
        column: arrays[name] if index is None else arrays[name][:, index]
        for column, (name, index) in places.items()
    }


def _flat(variables: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in variables.items():
        if name.startswith("__"):
            continue
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


READER = MatlabReader()
