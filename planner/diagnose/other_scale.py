"""Power-ons whose readings are a multiple of their reference: written in another unit of measurement."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Sensor
from planner.units import STANDARD_GRAVITY_MPS2

FAR_OFF = 0.2  # of the factor of the other power-ons: ten times what one unit is off by
LEFT = 0.05  # of the input, that the multiple may leave: lean and bias of such a unit
LEAST_ROWS = 3
CLOSE = 0.03  # of a factor between units of measurement, within which it is that
_DEGREE = float(np.pi / 180.0)
_READ: dict[Sensor, dict[float, str]] = {
    "gyro": {_DEGREE: "in rad/s", 3600.0: "in deg/h", 1e3: "in mdps", 1.0 / _DEGREE: "converted twice"},
    "accelerometer": {
        STANDARD_GRAVITY_MPS2: "in m/s²",
        1e3: "in mg",
        1.0 / STANDARD_GRAVITY_MPS2: "converted twice",
    },
}


@dataclass(frozen=True)
class OtherScale:
    """One power-on of one sensor. rows: (n,) of the table; factor: reading over reference."""

    run: int
    sensor: Sensor
    rows: NDArray[np.bool_]
    factor: float

    @property
    def guess(self) -> str:
        """What it may have been, in words."""
        return f"run {self.run}: {_said(self.sensor, self.factor)}"


def other_scales(table: DwellTable) -> list[OtherScale]:
    """The power-ons whose readings follow their reference by another factor than those of the others do.

    From rows with an input of half a g or 3 deg/s and more. A factor that all have may be the sensor's own,
    of raw readings; where it is one between units of measurement a heading is wrong: raises InputError.
    """
    found: list[OtherScale] = []
    for sensor, y, u, least in _inputs(table):
        strong = np.linalg.norm(u, axis=1) >= least
        mine = [s for run in np.unique(table.run[strong]) if (s := _scale(table, sensor, y, u, strong, run))]
        if not mine:
            continue
        usual = float(np.median([s.factor for s in mine]))
        if _unit(sensor, usual):
            raise InputError(f"{table.source or 'the table'}, unit {table.unit[0]}: {_said(sensor, usual)}")
        found += [s for s in mine if abs(s.factor / usual - 1.0) > FAR_OFF]
    return found


def _unit(sensor: Sensor, factor: float) -> str:
    """The unit of measurement that makes this factor, in words, or nothing."""
    return next((said for f, said in _READ[sensor].items() if abs(factor / f - 1.0) < CLOSE), "")


def _said(sensor: Sensor, factor: float) -> str:
    unit = _unit(sensor, factor)
    return f"the {sensor}s read {factor:.4g} times their reference" + (f", as if {unit}" if unit else "")


def _scale(
    table: DwellTable, sensor: Sensor, y: Array, u: Array, strong: NDArray[np.bool_], run: int
) -> OtherScale | None:
    """Of one power-on, if one factor says its readings; least squares without a constant."""
    rows = strong & (table.run == run)
    if rows.sum() < LEAST_ROWS:
        return None
    factor = float(np.sum(y[rows] * u[rows]) / np.sum(u[rows] ** 2))
    left = np.linalg.norm(y[rows] - factor * u[rows], axis=1)
    fits = left < LEFT * max(abs(factor), 1e-3) * np.linalg.norm(u[rows], axis=1)
    alike = factor > 0.0 and fits.mean() > 0.5
    return OtherScale(int(run), sensor, table.run == run, factor) if alike else None


def _inputs(table: DwellTable) -> Iterator[tuple[Sensor, Array, Array, float]]:
    if table.gyro is not None and table.ref_rate is not None:
        yield "gyro", table.gyro, table.ref_rate, float(np.radians(3.0))
    if table.acc is not None and table.ref_acc is not None:
        yield "accelerometer", table.acc, table.ref_acc, 0.5 * STANDARD_GRAVITY_MPS2
