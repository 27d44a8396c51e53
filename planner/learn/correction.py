"""A calibration's tables applied to readings: y = (1 + κ)(M u) + b solved for u.

Bias effects that depend on the specific force take the corrected accelerometers, so these come first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from planner import catalog, measurement
from planner.calibration import Tables
from planner.measured import DwellTable
from planner.measurement import Acting
from planner.protocols import SENSORS, Sensor
from planner.records import Array, Conditions
from planner.temperature_table import hats

_RATE, _FORCE = "rate", "specific_force"


def corrected(table: DwellTable, tables: Mapping[Sensor, Tables]) -> DwellTable:
    """The dwell table with corrected readings; a sensor without tables, or without readings, stays."""
    conditions = replace(
        table.conditions(),
        rate=np.zeros((len(table), 3)) if table.gyro is None else table.gyro,
        specific_force=_force(table),
    )
    found: dict[Sensor, Array | None] = {"gyro": table.gyro, "accelerometer": table.acc}
    for sensor in reversed(SENSORS):
        readings = found[sensor]
        if readings is not None and sensor in tables:
            true = true_input(readings, tables[sensor], sensor, conditions)
            conditions = replace(conditions, **{_RATE if sensor == "gyro" else _FORCE: true})
            found[sensor] = true
    return replace(table, gyro=found["gyro"], acc=found["accelerometer"])


def _force(table: DwellTable) -> Array:
    if table.acc is not None:
        return table.acc
    return np.zeros((len(table), 3)) if table.ref_acc is None else table.ref_acc


def true_input(y: Array, tables: Tables, sensor: Sensor, conditions: Conditions) -> Array:
    """(n, 3) input u that the readings y (n, 3) came from; SI.

    conditions: the readings stand in for the true rate and force, which only small effects ask for
    """
    return measurement.true_input(sensor, y, conditions, acting(tables, sensor, conditions))


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
        lean = known["misalignment"]
        found.append(
            Acting(
                lean,
                np.array([off["xyz".index(t.name[0]), "xyz".index(t.name[1])] for t in lean.terms(sensor)]),
            )
        )
    for term in tables.extra:
        effect = known[term.effect]
        names = [t.name for t in effect.terms(sensor)]
        found.append(Acting(effect, term.value * (np.array(names) == term.term), term.nonlinear))
    return found
