"""A calibration's tables applied to readings: y = (1 + κ)(M u) + b solved for u.

What the gyros need of the specific force is taken from the corrected accelerometers, so these come first;
where an effect makes these in turn need the rate, they are corrected once more, with the corrected gyros.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from planner import catalog, response
from planner.effects._dependence import depends_on
from planner.nouns.array import Array
from planner.nouns.calibration import Tables
from planner.nouns.conditions import Conditions
from planner.nouns.dwell_table import DwellTable
from planner.protocols import SENSORS, Condition, Sensor
from planner.response import Acting
from planner.temperature_table import hats

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
    return response.true_input(sensor, y, conditions, acting(tables, sensor, conditions))


def acting(tables: Tables, sensor: Sensor, conditions: Conditions) -> list[Acting]:
    """A calibration's tables and terms as effects at work under some conditions."""
    known = catalog.effects()
    weights = hats(conditions.temperature_degc, tables.temperature_degc, tables.reach)
    off = tables.misalignment - np.eye(3)
    found = [
        Acting(known["bias"], weights @ tables.bias.T),
        Acting(known["scale_factor"], weights @ tables.scale.T),
    ]
    if np.any(tables.asymmetry):
        found.append(Acting(known["scale_factor_asymmetry"], tables.asymmetry))
    if np.any(off):
        misalignment = known["misalignment"]
        places = [("xyz".index(t.name[0]), "xyz".index(t.name[1])) for t in misalignment.terms(sensor)]
        found.append(Acting(misalignment, np.array([off[place] for place in places])))
    for term in tables.extra:
        effect = known[term.effect]
        names = [t.name for t in effect.terms(sensor)]
        found.append(Acting(effect, term.value * (np.array(names) == term.term), term.nonlinear))
    return found
