"""MATLAB .mat recordings up to version 7; version 7.3 is HDF5 and is read as such."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planner.errors import InputError
from planner.protocols import RawBlock
from planner.readers._arrays import columns_of, wanted_blocks
from planner.readers._matlab_elements import check_elements


class MatlabReader:
    """Variables (n, 1) or (1, n) as `time`, (n, k) and (n, k, m) as `gyro_1` …, structs as `imu.gyro_1`.

    The format packs each variable in one piece of at most 2 GB, so the wanted ones are read whole.
    """

    name = "matlab"
    suffixes = (".mat",)

    def recognises(self, path: Path, head: bytes) -> bool:
        """By the text on top; version 4, which has none, by suffix and zero bytes, and by not being HDF5."""
        old = path.suffix.lower() == ".mat" and b"\0" in head[:20] and b"\x89HDF" not in head[:520]
        return head.startswith(b"MATLAB 5.0") or old

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
    from scipy.io.matlab import matfile_version

    try:
        if matfile_version(path)[0] == 1:  # versions 5 to 7
            check_elements(path)
        variables = loadmat(path, simplify_cells=True)
    except InputError:
        raise
    except Exception as error:  # scipy raises many kinds, down to struct.error, for a cut or foreign file
        raise InputError(f"{path} is not a whole MATLAB file: {type(error).__name__}: {error}") from error
    arrays = {name: np.asarray(a) for name, a in _flat(variables) if np.ndim(a) in (1, 2, 3)}
    return columns_of({n: a[0] if a.ndim == 2 and a.shape[0] == 1 else a for n, a in arrays.items()})


def _flat(variables: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in variables.items():
        if name.startswith("__"):
            continue
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


READER = MatlabReader()
