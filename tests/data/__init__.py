"""Reduced tables of other people's recordings, and where the recordings themselves would be."""

from __future__ import annotations

from pathlib import Path

import pytest

from planner.dwells.dwell_files import read_dwells
from planner.dwells.table_rows import rows_of
from planner.nouns.dwell_table import DwellTable

HERE = Path(__file__).parent
RECORDINGS = Path(__file__).parents[2].parent / "shared" / "data"


def table(name: str, part: str = "") -> DwellTable:
    """A reduced table of this folder; `part`: only rows whose step begins so."""
    import numpy as np

    found = read_dwells(HERE / f"{name}.csv", motions=True)
    if not part:
        return found
    assert found.step is not None
    return rows_of(found, np.char.startswith(found.step, part))


def recording(name: str, why: str) -> Path:
    """A recording or a folder of them, or a test that is skipped because of what only the recording has."""
    path = RECORDINGS / name
    if not path.exists():
        pytest.skip(f"needs {why}: {path} is not here, and tests/data keeps means only")
    return path
