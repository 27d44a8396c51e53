"""A calibration's tables applied to readings: y = (1 + κ)(M u) + b solved for u.

What the gyros need of the specific force is taken from the corrected accelerometers, so these come first;
where an effect makes these in turn need the rate, they are corrected once more, with the corrected gyros.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from planner import catalog
from planner.calibration import ExtraTerm, Tables
from planner.effects._dependence import depends_on
from planner.learn.temperature_nodes import hats
from planner.measured import DwellTable
from planner.protocols import SENSORS, Condition, Sensor
from planner.records import Array, Conditions

_ROUNDS = 4  # κ is 1e-2 at most, so every round wins two digits
_RATE: Condition = "rate"
_FORCE: Condition = "specific_force"


def corrected(table: DwellTable, tables: Mapping[Sensor, Tables]) -> DwellTable:
    """The dwell table with corrected readings; a sensor without tables, or without readings, stays."""
    conditions = replace(
        table.conditions(),
        rate=np.zeros((len(table), 3)) if table.gyro is None else table.gyro,
        specific_force=_force(table),
    )
    readings: dict[Sensor, Array | None] = {"gyro": table.gyro, "accelerometer": table.acc}
    found = dict(readings)
    rounds = 2 if needing(tables, "accelerometer", _RATE) and "gyro" in tables else 1
    for sensor in SENSORS[::-1] * rounds:
        y = readings[sensor]
        if y is not None and sensor in tables:
            true = true_input(y, tables[sensor], sensor, conditions)
            conditions = replace(conditions, **{_RATE if sensor == "gyro" else _FORCE: true})
            found[sensor] = true
    return replace(table, gyro=found["gyro"], acc=found["accelerometer"])


def needing(tables: Mapping[Sensor, Tables], sensor: Sensor, condition: Condition) -> list[str]:
    """Names of the effects outside a sensor's temperature tables that need a condition, in their order."""
    terms = tables[sensor].extra if sensor in tables else ()
    shapes = {t.effect: tuple(sorted(t.nonlinear.items())) for t in terms}
    return [name for name, shape in shapes.items() if _needs(name, sensor, condition, shape)]


@lru_cache(maxsize=256)
def _needs(name: str, sensor: Sensor, condition: Condition, shape: tuple[tuple[str, float], ...]) -> bool:
    """Whether it needs that on this sensor: one with `rate, specific_force` may take what is sensed."""
    effect = catalog.effects()[name]
    return condition in effect.needs and depends_on(effect, sensor, condition, dict(shape))


def _force(table: DwellTable) -> Array:
    if table.acc is not None:
        return table.acc
    return np.zeros((len(table), 3)) if table.ref_acc is None else table.ref_acc


def true_input(y: Array, tables: Tables, sensor: Sensor, conditions: Conditions) -> Array:
    """(n, 3) input u that the readings y (n, 3) came from; SI.

    conditions: the readings stand in for the true rate and force, which only small effects ask for
    """
    weights = hats(conditions.temperature_degc, tables.temperature_degc, tables.reach)
    left = y - weights @ tables.bias.T - _extra(tables, "bias", sensor, conditions)
    scale = weights @ tables.scale.T
    slope = 1.0 + scale + 0.5 * np.sign(left) * tables.asymmetry
    v = left / slope
    inverse = np.linalg.inv(tables.misalignment)
    for _ in range(_ROUNDS if tables.extra else 0):
        here = replace(conditions, **{_RATE if sensor == "gyro" else _FORCE: v})
        v = (left - _extra(tables, "scale_factor", sensor, here)) / slope
    u = v @ inverse.T
    for _ in range(_ROUNDS if tables.extra else 0):
        here = replace(conditions, **{_RATE if sensor == "gyro" else _FORCE: u})
        u = (v - _extra(tables, "misalignment", sensor, here)) @ inverse.T
    return np.asarray(u)


def _extra(tables: Tables, group: str, sensor: Sensor, conditions: Conditions) -> Array:
    """(n, 3) what the effects of one group outside the tables add."""
    total = np.zeros((len(conditions.day), 3))
    for term in tables.extra:
        effect = catalog.effects()[term.effect]
        if effect.group == group:
            index = [t.name for t in effect.terms(sensor)].index(term.term)
            total += term.value * _regressors(term, sensor, conditions)[:, :, index]
    return total


def _regressors(term: ExtraTerm, sensor: Sensor, conditions: Conditions) -> Array:
    found: Array = catalog.effects()[term.effect].regressors(sensor, conditions, term.nonlinear)
    return found
