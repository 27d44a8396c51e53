"""White noise of a sensor as data sheets write it: a density per root hertz, or a random walk per root hour.

    N = 0.1 deg/√h = 0.1/60 deg/s/√Hz        0.02 m/s/√h = 0.02/60 m/s²/√Hz

A mean over t seconds scatters by N/√t (IEEE Std 952). SI inside: rad/s/√Hz, m/s²/√Hz.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Annotated

from pydantic import BeforeValidator, Field

from planner.errors import Unfit
from planner.protocols import Sensor
from planner.quantities import NUMBER_PATTERN, schema
from planner.units import UnitError, to_si, unit_factor

USUAL: Mapping[Sensor, tuple[float, str]] = {"gyro": (0.003, "deg/s"), "accelerometer": (1e-4, "g")}
"""Of a small unit, per root hertz: what records have where a spec says nothing."""

_ROOT = re.compile(r"(.+?)/\s*(?:sqrt\s*\(\s*(Hz|hz|h|hr|s)\s*\)|√\s*\(?\s*(Hz|hz|h|hr|s)\s*\)?)\s*")
_SECONDS = {"s": 1.0, "h": 3600.0, "hr": 3600.0}
PATTERN = rf"^\s*{NUMBER_PATTERN}\s*.+/\s*(sqrt\s*\(|√).*$"


def usual(sensor: Sensor) -> float:
    """SI per √Hz of the records of a sensor of whose noise a spec says nothing."""
    value, unit = USUAL[sensor]
    return value * unit_factor(unit)[0]


def gyro_density(value: object) -> float:
    """rad/s/√Hz of a gyro's noise. Raises Unfit for what is none."""
    return _fitting(value, "deg/s", "deg", "0.1 deg/sqrt(h)")


def accelerometer_density(value: object) -> float:
    """m/s²/√Hz of an accelerometer's noise. Raises Unfit for what is none."""
    return _fitting(value, "g", "m/s", "0.05 m/s/sqrt(h)")


def _fitting(value: object, unit: str, walk: str, example: str) -> float:
    """`unit` per root hertz, or its integral `walk` per root hour or second."""
    try:
        return _read(value, unit, walk, example)
    except UnitError as error:
        raise Unfit("P331", f"{error}; write e.g. '{example}'") from None


def _read(value: object, unit: str, walk: str, example: str) -> float:
    found = _ROOT.fullmatch(value) if isinstance(value, str) else None
    if found is None:
        raise Unfit(
            "P331",
            f"{str(value)[:60]!r} is no noise density, which ends in /sqrt(h) or /sqrt(Hz); "
            f"write e.g. '{example}'",
        )
    per = found[2] or found[3]
    if per in _SECONDS:
        return to_si(found[1], walk) / math.sqrt(_SECONDS[per])
    return to_si(found[1], unit)


GyroNoise = Annotated[
    float,
    BeforeValidator(gyro_density),
    Field(ge=0),
    schema("0.1 deg/sqrt(h)", PATTERN),
]
AccelerometerNoise = Annotated[
    float,
    BeforeValidator(accelerometer_density),
    Field(ge=0),
    schema("0.05 m/s/sqrt(h)", PATTERN),
]
