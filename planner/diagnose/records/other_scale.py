"""Power-ons that were written in another unit of measurement: rad/s under deg/s, kelvin under degC."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.records.other_scale_at_rest import scaled_at_rest
from planner.errors import InputError
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Sensor
from planner.units import STANDARD_GRAVITY_MPS2

FAR_OFF = 0.2  # of the factor of the other power-ons: ten times what one unit is off by
LEFT = 0.05  # of the input, that the multiple may leave: lean and bias of such a unit
LEAST_ROWS = 3
LEAST_RATE = float(np.radians(3.0))  # below which a bias may be as large as a rate
HOTTEST = 175.0  # degC: no silicon sensor is calibrated there; -98 degC in kelvin
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
    """One power-on of which a column reads in another unit. rows: (n,) of the table; what: in words.

    sensor: whose readings they are, or "temperature"
    """

    run: int
    sensor: Sensor | Literal["temperature"]
    rows: NDArray[np.bool_]
    what: str

    @property
    def guess(self) -> str:
        """What it may have been, in words."""
        return f"run {self.run}: {self.what}"


def other_scales(table: DwellTable) -> list[OtherScale]:
    """The power-ons whose readings follow their reference by another factor than those of the others do.

    From rows with an input of half a g or 3 deg/s and more. A factor that all have may be the sensor's own,
    of raw readings; where it is one between units of measurement a heading is wrong: raises InputError.
    """
    found: list[OtherScale] = []
    for sensor, y, u, least in _inputs(table):
        runs, factors = _factors(table.run, y, u, least)
        usual = float(np.median(factors)) if len(factors) else 1.0
        if _unit(sensor, usual):
            raise InputError(f"{table.source or 'the table'}, unit {table.unit[0]}: {_said(sensor, usual)}")
        off = np.abs(factors / usual - 1.0) > FAR_OFF
        pairs = zip(runs[off].tolist(), factors[off].tolist(), strict=True)
        found += [OtherScale(run, sensor, table.run == run, _said(sensor, f)) for run, f in pairs]
    known = {one.run for one in found}
    return [*found, *(one for one in _at_rest(table) if one.run not in known), *_temperatures(table)]


def _at_rest(table: DwellTable) -> Iterator[OtherScale]:
    """Power-ons of faces alone, whose gyros read no multiple of their reference."""
    if table.ref_rate is None:
        return
    rests = np.linalg.norm(table.ref_rate, axis=1) < LEAST_RATE
    for run, factor in scaled_at_rest(table, rests, tuple(_READ["gyro"])):
        of = f"{factor:.4g} of the Earth's rate, and of their noise"
        what = f"the gyros read {of}, as if {_READ['gyro'][factor]}"
        yield OtherScale(run, "gyro", table.run == run, what)


def _temperatures(table: DwellTable) -> Iterator[OtherScale]:
    """Power-ons at a temperature that no unit stands."""
    hot = table.temperature_degc > HOTTEST
    if hot.all():
        raise InputError(f"{table.source or 'the table'}, unit {table.unit[0]}: {_hot(table, hot)}")
    for run in np.unique(table.run[hot]).tolist():
        mine = table.run == run
        yield OtherScale(run, "temperature", mine, _hot(table, mine & hot))


def _hot(table: DwellTable, rows: NDArray[np.bool_]) -> str:
    return f"the temperature reads {np.median(table.temperature_degc[rows]):.1f} degC, as if in kelvin"


def _unit(sensor: Sensor, factor: float) -> str:
    """The unit of measurement that makes this factor, in words, or nothing."""
    return next((said for f, said in _READ[sensor].items() if abs(factor / f - 1.0) < CLOSE), "")


def _said(sensor: Sensor, factor: float) -> str:
    unit = _unit(sensor, factor)
    return f"the {sensor}s read {factor:.4g} times their reference" + (f", as if {unit}" if unit else "")


def _factors(run: NDArray[np.int64], y: Array, u: Array, least: float) -> tuple[NDArray[np.int64], Array]:
    """Power-ons whose readings (n, 3) are a multiple of their references, and by what factor.

    Least squares without a constant, over the rows with an input of `least` and more.
    """
    size = np.linalg.norm(u, axis=1)
    strong = size >= least
    runs, which = np.unique(run[strong], return_inverse=True)
    y, u, size = y[strong], u[strong], size[strong]
    rows = np.bincount(which, minlength=len(runs))
    factor = np.bincount(which, np.sum(y * u, axis=1)) / np.bincount(which, size**2)
    left = np.linalg.norm(y - factor[which][:, None] * u, axis=1)
    fits = np.bincount(which, left < LEFT * np.maximum(np.abs(factor), 1e-3)[which] * size)
    alike = (rows >= LEAST_ROWS) & (factor > 0.0) & (fits > 0.5 * rows)
    return runs[alike], factor[alike]


def _inputs(table: DwellTable) -> Iterator[tuple[Sensor, Array, Array, float]]:
    if table.gyro is not None and table.ref_rate is not None:
        yield "gyro", table.gyro, table.ref_rate, LEAST_RATE
    if table.acc is not None and table.ref_acc is not None:
        yield "accelerometer", table.acc, table.ref_acc, 0.5 * STANDARD_GRAVITY_MPS2
