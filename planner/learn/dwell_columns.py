"""The columns of a dwell table: name in the file, field of the record, unit (interfaces, section 4)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from planner.errors import Fault

Kind = Literal["text", "count", "number"]
AXES = ("x", "y", "z")


@dataclass(frozen=True)
class DwellColumn:
    """One column: `field` of DwellTable, its axis (0, 1, 2; None for a column of its own), the file's unit.

    expected: a table without it is worth a note, because some effect cannot be told without it
    absent: what stands in the record when the file lacks it; None where the record holds None
    """

    name: str
    field: str
    unit: str = "1"
    axis: int | None = None
    kind: Kind = "number"
    expected: bool = True
    absent: float | str | None = None


@dataclass(frozen=True)
class AxisTriad:
    """Three columns that belong together, `pattern` with {} for the axis."""

    field: str
    pattern: str
    unit: str
    expected: bool = True

    def columns(self) -> tuple[DwellColumn, ...]:
        """The three columns x, y, z."""
        return tuple(
            DwellColumn(self.pattern.format(axis), self.field, self.unit, i, expected=self.expected)
            for i, axis in enumerate(AXES)
        )


TRIADS = (
    AxisTriad("ref_rate", "ref_rate_{}_dps", "deg/s"),
    AxisTriad("ref_acc", "ref_acc_{}_g", "g"),
    AxisTriad("gyro", "gyro_{}_dps", "deg/s"),
    AxisTriad("acc", "acc_{}_g", "g"),
    AxisTriad("gyro_std", "gyro_{}_std_dps", "deg/s", expected=False),
    AxisTriad("acc_std", "acc_{}_std_g", "g", expected=False),
)
SINGLES = (
    DwellColumn("unit", "unit", kind="text", absent="1"),
    DwellColumn("run", "run", kind="count", absent=1),
    DwellColumn("day", "day", absent=0.0),
    DwellColumn("time_on_s", "time_on", "s", absent=0.0),
    DwellColumn("duration_s", "duration", "s", absent=0.0),
    DwellColumn("temp_degc", "temperature_degc", absent=20.0),
    DwellColumn("temp_rate_degc_min", "temperature_rate", "K/min", absent=0.0),
    DwellColumn("step", "step", kind="text", expected=False),
    DwellColumn("bench", "bench", kind="text", expected=False),
    DwellColumn("n_samples", "n_samples", kind="count", expected=False),
)
COLUMNS = (
    *SINGLES[:7],
    *(column for triad in TRIADS for column in triad.columns()),
    *SINGLES[7:],
)
BY_NAME = {column.name: column for column in COLUMNS}


@dataclass(frozen=True)
class RawDwells:
    """A file's columns as they stand, (n,) each; lines: (n,) line of every row, None where rows have none."""

    file: str
    columns: Mapping[str, NDArray[Any]]
    names: tuple[str, ...]
    lines: NDArray[np.int64] | None = None
    notes: tuple[str, ...] = ()

    def fault(self, row: int, path: str, message: str) -> Fault:
        """A fault of one row, at its line where the file has lines."""
        if self.lines is None:
            return Fault(self.file, 0, 0, f"row {row + 1}: {path}", message)
        return Fault(self.file, int(self.lines[row]), 1, path, message)
