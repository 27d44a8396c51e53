"""The methods of calibration by their names: what each takes of the table, and which effects it fits.

Where the mathematics is the same, a classical method is the general estimator with the effects and the
records that the method asks for: generalised least squares gives the published closed forms (closed_forms)
when the records are the published ones, and intervals with them.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError
from planner.learn.fit_options import DECLARED, FitOptions
from planner.measured import DwellTable
from planner.protocols import Sensor

TURNING = np.radians(1.0)  # rad/s; K's slowest turn is 10 deg/s


@dataclass(frozen=True)
class Method:
    """A method behind the general estimator: its sensors, effects, and the rows that it takes."""

    sensors: tuple[Sensor, ...]
    effects: tuple[str, ...]
    rows: Callable[[DwellTable], NDArray[np.bool_]]
    source: str


def resting(table: DwellTable) -> NDArray[np.bool_]:
    """(n,) records at rest."""
    if table.ref_rate is None:
        return np.ones(len(table), dtype=bool)
    return np.asarray(np.linalg.norm(table.ref_rate, axis=1) < TURNING)


def turning(table: DwellTable) -> NDArray[np.bool_]:
    """(n,) records of turns; all rests go with them, for the bias that K removes first."""
    return np.ones(len(table), dtype=bool)


METHODS = {
    "six_position_gyro": Method(("gyro",), ("bias", "g_sensitivity"), resting, "K 2.2.2"),
    "six_position_accelerometer": Method(
        ("accelerometer",),
        ("bias", "scale_factor", "scale_factor_asymmetry", "misalignment"),
        resting,
        "K 2.2.3",
    ),
    "scale_factor_rotations": Method(
        ("gyro",), ("bias", "scale_factor", "scale_factor_asymmetry", "misalignment"), turning, "K 2.2.4"
    ),
    "triad_least_squares": Method(("accelerometer",), ("bias", "scale_factor", "misalignment"), resting, "A"),
    "cube": Method(("gyro", "accelerometer"), ("bias", "scale_factor", "misalignment"), turning, "B, way 1"),
}
NAMES = (DECLARED, "free_orientations", "free_orientations_symmetric", *METHODS)
ROBUST = ("no", "huber", "bisquare")


def fit_options(method: str, robust: str, latitude_deg: float | None) -> FitOptions:
    """Options from words. Raises InputError for one that we do not know."""
    if method not in NAMES:
        close = difflib.get_close_matches(method, NAMES, 1)
        hint = f"did you mean {close[0]}?" if close else f"there are {', '.join(NAMES)}"
        raise InputError(f"--method: no method is called {method!r}; {hint}")
    if robust not in ROBUST:
        raise InputError(f"--robust must be one of {', '.join(ROBUST)}, not {robust!r}")
    latitude = None if latitude_deg is None else float(np.radians(latitude_deg))
    return FitOptions(method, robust, latitude)  # type: ignore[arg-type]
