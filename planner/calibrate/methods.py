"""The methods of calibration by their names: what each takes of the table, and which effects it fits.

Where the mathematics is the same, a classical method is the general estimator with the effects and the
records that the method asks for: generalised least squares gives the published closed forms (closed_forms)
when the records are the published ones, and intervals with them.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.calibrate.fit_options import DECLARED, SINS_OUTPUTS, FitOptions
from planner.errors import InputError
from planner.nouns.calibration import Tables
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Sensor
from planner.temperature_table import GAP_K
from planner.units import STANDARD_GRAVITY_MPS2

TURNING = np.radians(1.0)  # rad/s; K's slowest turn is 10 deg/s
LOADED_G = 1.5
LEAST_STEPS = 3


@dataclass(frozen=True)
class Method:
    """A method behind the general estimator: its sensors, effects, the rows that it takes, what it needs."""

    sensors: tuple[Sensor, ...]
    effects: tuple[str, ...]
    rows: Callable[[DwellTable], NDArray[np.bool_]]
    source: str
    needs: str


def resting(table: DwellTable) -> NDArray[np.bool_]:
    """(n,) records at rest."""
    if table.ref_rate is None:
        return np.ones(len(table), dtype=bool)
    return np.asarray(np.linalg.norm(table.ref_rate, axis=1) < TURNING)


def turning(table: DwellTable) -> NDArray[np.bool_]:
    """(n,) records of turns; all rests go with them, for the bias that K removes first."""
    return np.ones(len(table), dtype=bool)


def loaded(table: DwellTable) -> NDArray[np.bool_]:
    """(n,) all records, when some are of a centrifuge: over 1.5 g."""
    if table.ref_acc is None or table.ref_rate is None:
        return np.zeros(len(table), dtype=bool)
    g = np.linalg.norm(table.ref_acc, axis=1) / STANDARD_GRAVITY_MPS2
    return np.full(len(table), bool((g > LOADED_G).sum() >= LEAST_STEPS))


def over_inputs(table: DwellTable) -> NDArray[np.bool_]:
    """(n,) all records, when they hold at least three sizes of rate or of load: two make a straight line."""
    if table.ref_rate is None and table.ref_acc is None:
        return np.zeros(len(table), dtype=bool)
    sizes = [
        len(np.unique(np.round(np.abs(r).max(axis=1) / step)))
        for r, step in ((table.ref_rate, TURNING), (table.ref_acc, STANDARD_GRAVITY_MPS2))
        if r is not None
    ]
    return np.full(len(table), max(sizes) >= LEAST_STEPS)


def over_temperatures(table: DwellTable) -> NDArray[np.bool_]:
    """(n,) all records, when they hold two temperatures or more."""
    return np.full(len(table), bool(np.ptp(table.temperature_degc) > GAP_K))


BOTH: tuple[Sensor, ...] = ("gyro", "accelerometer")
_CUBE = ("bias", "scale_factor", "misalignment")
_TABLES = ("bias", "bias_temperature", "scale_factor", "scale_factor_temperature", "misalignment")
METHODS = {
    "six_position_gyro": Method(
        ("gyro",), ("bias", "g_sensitivity"), resting, "K 2.2.2", "rests with every axis up and down"
    ),
    "six_position_accelerometer": Method(
        ("accelerometer",),
        ("bias", "scale_factor", "scale_factor_asymmetry", "misalignment"),
        resting,
        "K 2.2.3",
        "rests with every axis up, down and level, with ref_acc",
    ),
    "scale_factor_rotations": Method(
        ("gyro",),
        ("bias", "scale_factor", "scale_factor_asymmetry", "misalignment"),
        turning,
        "K 2.2.4",
        "turns about every axis, both ways, and rests, with ref_rate",
    ),
    "nonlinearity": Method(
        BOTH,
        ("bias", "scale_factor", "scale_factor_asymmetry", "scale_factor_nonlinearity", "misalignment"),
        over_inputs,
        "K 2.2.5",
        "three rates or loads at least, both ways, with ref_rate and ref_acc",
    ),
    "centrifuge": Method(
        BOTH,
        (
            "bias",
            "g_sensitivity",
            "scale_factor",
            "scale_factor_acceleration",
            "misalignment",
            "arm_bending",
        ),
        loaded,
        "K 2.2.6, 4.3.3",
        "three loads over 1.5 g at least, in several mountings, and rests, with ref_rate and ref_acc",
    ),
    "nonlinearity_table": Method(
        BOTH,
        ("bias", "scale_factor", "scale_factor_asymmetry", "scale_factor_curve", "misalignment"),
        over_inputs,
        "K 2.2.5, table 2.4",
        "eight rates or loads, both ways, with ref_rate and ref_acc",
    ),
    "nonlinearity_polynomial": Method(
        BOTH,
        ("bias", "scale_factor", "scale_factor_polynomial", "misalignment"),
        over_inputs,
        "K 2.2.5, table 2.4",
        "rates or loads of several sizes, both ways, with ref_rate and ref_acc",
    ),
    "load_tables": Method(
        BOTH,
        (
            "bias",
            "load_curve",
            "scale_factor",
            "scale_factor_nonlinearity",
            "scale_factor_acceleration",
            "scale_factor_acceleration_squared",
            "misalignment",
            "arm_length",
            "arm_bending",
        ),
        loaded,
        "K 2.2.6, eq. 21, 3.1",
        "eight loads up to 100 g on six faces, and turns and rests near the axis, with ref_rate and ref_acc",
    ),
    "temperature_tables": Method(
        BOTH, _TABLES, over_temperatures, "K 2.4", "two temperatures at least, with references"
    ),
    "temperature_tables_with_rate": Method(
        BOTH,
        (*_TABLES, "temperature_rate"),
        over_temperatures,
        "K 2.4, 2.11",
        "the same, with records while the chamber heats and cools",
    ),
    "temperature_tables_with_rate_and_time_on": Method(
        BOTH,
        (*_TABLES, "temperature_rate", "warm_up"),
        over_temperatures,
        "K 2.4",
        "the same, with records from power-on until the unit is warm",
    ),
    "bias_and_warm_up": Method(
        BOTH, ("bias", "warm_up"), resting, "K 2.1", "rests from power-on until the unit is warm"
    ),
    "drift_table": Method(
        BOTH,
        ("bias", "drift_curve"),
        resting,
        "K 2.1, tables 2.13, 2.18",
        "rests from the first seconds after power-on, up to an hour",
    ),
    "drift_table_over_temperature": Method(
        BOTH,
        ("bias", "bias_temperature", "drift_curve", "drift_curve_over_temperature"),
        over_temperatures,
        "K 2.1, figure 4.7",
        "rests from the first seconds after power-on, up to an hour, at several temperatures",
    ),
    "temperature_and_rate_tables": Method(
        BOTH,
        (*_TABLES, "temperature_rate_table"),
        over_temperatures,
        "K 2.4.2, 2.11",
        "the same, with records while the chamber heats and cools at every temperature",
    ),
    "temperature_and_rate_tables_over_time_on": Method(
        BOTH,
        (*_TABLES, "temperature_rate_table_over_time"),
        over_temperatures,
        "K 2.4.2",
        "the same, soon after power-on and half an hour later",
    ),
    "triad_least_squares": Method(
        ("accelerometer",),
        ("bias", "scale_factor", "misalignment"),
        resting,
        "A",
        "rests in four orientations at least, with ref_acc",
    ),
    "cube": Method(
        BOTH,
        _CUBE,
        turning,
        "B, way 1",
        "rests on six faces and turns by multiples of 90 deg; no references",
    ),
    "cube_accelerometers": Method(
        ("accelerometer",), _CUBE, turning, "B, task 2", "rests on six faces; no references"
    ),
    "cube_gyros": Method(
        ("gyro",),
        _CUBE,
        turning,
        "B, task 3",
        "rests on faces and turns by multiples of 90 deg; no references",
    ),
}
CUBES = ("cube", "cube_accelerometers", "cube_gyros")
# the sources' own words for their methods; B 7, to check a calibration, is the residual on what was left out
BY_SOURCE = {
    "A": "triad_least_squares",
    "B2": "cube_accelerometers",
    "B3": "cube_gyros",
    "B4": "free_orientations",
    "B5": "ellipsoid",
    "B6": "rests_and_turns",
}
_NEEDS_OF_OTHERS = {
    DECLARED: "records with ref_rate and ref_acc, or rests in nine attitudes",
    SINS_OUTPUTS: "a log of attitude and velocity: rests in six attitudes, turns about every axis",
    "free_orientations": "rests in nine attitudes, faces and edges",
    "free_orientations_symmetric": "rests in nine attitudes, faces and edges",
    "ellipsoid": "rests in nine attitudes, faces and edges",
    "rests_and_turns": "rests in nine attitudes, and the turns by hand between them that `reduce` keeps",
}


def needs_of(method: str) -> str:
    """What records a method needs, in words."""
    return METHODS[method].needs if method in METHODS else _NEEDS_OF_OTHERS[method]


NAMES = (
    DECLARED,
    "free_orientations",
    "free_orientations_symmetric",
    "ellipsoid",
    "rests_and_turns",
    SINS_OUTPUTS,
    *METHODS,
)
ROBUST = ("no", "huber", "bisquare")


def fit_options(
    method: str,
    robust: str,
    latitude_deg: float | None,
    prior: Mapping[Sensor, Tables] | None = None,
    nodes: int | None = None,
    turn_deg: float | None = None,
) -> FitOptions:
    """Options from words; a method also by its source's, `A` or `B2` … `B6`.

    Raises InputError for a word that we do not know.
    """
    method = BY_SOURCE.get(method, method)
    if method == "B1":
        raise InputError("--method: B1 finds the rests of a recording: `planner reduce RAW -o DATA`")
    if method not in NAMES:
        close = difflib.get_close_matches(method, NAMES, 1)
        hint = f"did you mean {close[0]}?" if close else f"there are {', '.join(NAMES)}"
        raise InputError(f"--method: no method is called {method!r}; {hint}")
    if robust not in ROBUST:
        raise InputError(f"--robust must be one of {', '.join(ROBUST)}, not {robust!r}")
    latitude = None if latitude_deg is None else float(np.radians(latitude_deg))
    if prior is not None and method not in (DECLARED, "cube"):
        raise InputError(f"--prior recalibrates by the general estimator or the cube, not by {method}")
    if turn_deg is not None and (turn_deg <= 0 or turn_deg % 90.0):
        raise InputError(
            f"--turn must be a multiple of 90 deg, such as 1440 for four turns, not {turn_deg:g}"
        )
    turn = None if turn_deg is None else float(np.radians(turn_deg))
    return FitOptions(method, robust, latitude, prior, nodes, turn)  # type: ignore[arg-type]  # both words were checked above
