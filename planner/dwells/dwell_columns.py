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

    expected: a table without it is worth a note, which says `without`: what cannot be told then
    absent: what stands in the record when the file lacks it; None where the record holds None
    """

    name: str
    field: str
    unit: str = "1"
    axis: int | None = None
    kind: Kind = "number"
    expected: bool = True
    absent: float | str | None = None
    without: str = ""


@dataclass(frozen=True)
class AxisTriad:
    """Three columns that belong together, `pattern` with {} for the axis; without: as for one column."""

    field: str
    pattern: str
    unit: str
    expected: bool = True
    without: str = ""

    def columns(self) -> tuple[DwellColumn, ...]:
        """The three columns x, y, z."""
        return tuple(
            DwellColumn(self.pattern.format(axis), self.field, self.unit, i, expected=self.expected)
            for i, axis in enumerate(AXES)
        )


TRIADS = (
    AxisTriad("ref_rate", "ref_rate_{}_dps", "deg/s", without="the unit is taken as at rest"),
    AxisTriad("ref_acc", "ref_acc_{}_g", "g", without="the calibrated accelerometers are the reference"),
    AxisTriad("gyro", "gyro_{}_dps", "deg/s", without="nothing is said of the gyros"),
    AxisTriad("acc", "acc_{}_g", "g", without="nothing is said of the accelerometers"),
    AxisTriad("gyro_std", "gyro_{}_std_dps", "deg/s", expected=False),
    AxisTriad("acc_std", "acc_{}_std_g", "g", expected=False),
)
SINGLES = (
    DwellColumn("unit", "unit", kind="text", absent="1", without="all rows are one unit's"),
    DwellColumn("run", "run", kind="count", absent=1, without="a power-on ends where time_on_s falls"),
    DwellColumn("day", "day", absent=0.0, without="ageing and bias_step cannot be tested"),
    DwellColumn("time_on_s", "time_on", "s", absent=0.0, without="warm_up cannot be tested"),
    DwellColumn("duration_s", "duration", "s", absent=0.0, without="all records last equally long"),
    DwellColumn(
        "temp_degc", "temperature_degc", absent=20.0, without="no effect of temperature can be tested"
    ),
    DwellColumn(
        "temp_rate_degc_min",
        "temperature_rate",
        "K/min",
        absent=0.0,
        without="temperature_rate cannot be tested",
    ),
    DwellColumn("step", "step", kind="text", expected=False),
    DwellColumn("bench", "bench", kind="text", expected=False),
    DwellColumn("n_samples", "n_samples", kind="count", expected=False),
    DwellColumn("kind", "kind", kind="text", expected=False),
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
            return Fault(self.file, 0, 0, f"row {row + 1}: {path}", message, "P701")
        return Fault(self.file, int(self.lines[row]), 1, path, message, "P701")
