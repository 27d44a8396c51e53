"""Coefficients of the declared model that the plan's records cannot determine as well as the plan claims."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner import catalog
from planner.nouns.conditions import Conditions
from planner.nouns.sensor import ErrorName
from planner.protocols import Sensor
from planner.spec.budget import ErrorBudget
from planner.spec.model import Spec
from planner.spec.own_units import own_unit
from planner.units import from_si
from planner.verify.calibrations import Estimator
from planner.verify.declared import sensed
from planner.verify.experiment import Experiment

NOTICEABLE = 0.01  # a per cent of the input, the order of an uncalibrated scale factor


@dataclass(frozen=True)
class Weak:
    """A coefficient that the plan's records cannot determine, and why."""

    error: str
    axis: str
    why: str


def weak_coefficients(e: Experiment) -> tuple[Weak, ...]:
    """Those whose standard error over the whole campaign exceeds what the error is without a calibration."""
    found: dict[tuple[str, str], Weak] = {}
    for estimators in e.estimators.values():
        for estimator in estimators:
            for weak in _of(e, estimator):
                found.setdefault((weak.error, weak.axis), weak)
    return tuple(found.values())


def _of(e: Experiment, estimator: Estimator) -> list[Weak]:
    model, found = estimator.model, []
    sensor = model.sensor
    for i, column in enumerate(model.columns):
        whole = e.unit.budgets.get((sensor, column.effect), ErrorBudget()).whole_variation
        known, error = catalog.effects()[column.effect], ErrorName.of(sensor, column.effect)
        unit = own_unit(e.spec, sensor, column.effect)
        shown = _shown(float(estimator.error[i]), unit)
        why = None
        if estimator.undetermined[i] and _nowhere(e.spec, sensor, column.effect, column.index):
            continue
        if estimator.undetermined[i]:
            why = "no record of the plan tells it from the others"
        elif whole > 0 and estimator.error[i] > whole:
            why = f"known to ±{shown} only, uncalibrated it is up to {_shown(whole, unit)}"
        elif whole == 0 and known.group == "scale_factor" and error_share(e, estimator, i) > NOTICEABLE:
            why = f"known to ±{shown} only, and the spec has no budget for it"
        if why is not None:
            found.append(Weak(error, column.term, why))
    return found


def _nowhere(spec: Spec, sensor: Sensor, effect: str, index: int) -> bool:
    """Whether a term is nothing at any temperature of use, under any turn and load, at any time."""
    low, high = spec.plan.temperatures.range
    rows = 2000
    rng = np.random.default_rng(1)  # any will do, the same every time
    c = Conditions(
        rate=rng.normal(size=(rows, 3)),
        specific_force=rng.normal(scale=10.0, size=(rows, 3)),
        temperature_degc=np.linspace(low, high, rows),
        temperature_rate=rng.normal(scale=0.01, size=rows),
        time_on=rng.uniform(0.0, 4000.0, rows),
        day=rng.uniform(0.0, 50.0, rows),
    )
    return not np.any(catalog.effects()[effect].regressors(sensor, c)[:, :, index])


def error_share(e: Experiment, estimator: Estimator, i: int) -> float:
    """What a scale effect's standard error does to a reading, as a share of the largest input."""
    model, c = estimator.model, e.records.conditions
    u = sensed(model.sensor, c)[:, list(model.channels)]
    most = float(np.abs(model.scaled(c, u)[:, :, i - len(model.bias)]).max())
    return float(estimator.error[i]) * most / float(np.abs(u).max())


def _shown(value: float, unit: str) -> str:
    """A figure with its unit; a bare ratio has none."""
    text = f"{from_si(value, unit):.3g}"
    return text if unit == "1" else f"{text} {unit}"
