"""Coefficients of the declared model that the plan's records cannot determine as well as the plan claims."""

from __future__ import annotations

from dataclasses import dataclass

from planner import catalog
from planner.protocols import Sensor
from planner.spec.budget import ErrorBudget
from planner.units import from_si
from planner.verify.calibrations import ChannelEstimator
from planner.verify.experiment import Experiment

NOTICEABLE = 0.01  # a per cent, the order of an uncalibrated scale factor
SCALES = ("scale_factor", "scale_factor_asymmetry", "scale_factor_nonlinearity")


@dataclass(frozen=True)
class Weak:
    """A coefficient that the plan's records cannot determine, and why."""

    error: str
    axis: str
    why: str


def weak_coefficients(e: Experiment) -> tuple[Weak, ...]:
    """Those whose standard error by the design is larger than the whole error is without a calibration."""
    found: dict[tuple[str, str], Weak] = {}
    for sensor, channels in e.estimators.items():
        for estimator in channels:
            for weak in _of_channel(e, sensor, estimator):
                found.setdefault((weak.error, weak.axis), weak)
    return tuple(found.values())


def _of_channel(e: Experiment, sensor: Sensor, estimator: ChannelEstimator) -> list[Weak]:
    found = []
    for i, column in enumerate(estimator.model.columns()[: estimator.count]):
        budget = e.unit.budgets.get((sensor, column.effect), ErrorBudget())
        whole = budget.whole_variation
        error = f"{sensor}.{column.effect}"
        unit = catalog.effects()[column.effect].units[sensor]
        shown = _shown(float(estimator.error[i]), unit)
        if estimator.undetermined[i]:
            found.append(Weak(error, column.term, "no record of the plan tells it from the others"))
        elif whole > 0 and estimator.error[i] > whole:
            found.append(
                Weak(
                    error,
                    column.term,
                    f"known to ±{shown} only, uncalibrated it is up to {_shown(whole, unit)}",
                )
            )
        elif whole == 0 and column.effect in SCALES and estimator.error[i] > NOTICEABLE:
            found.append(
                Weak(error, column.term, f"known to ±{shown} only, and the spec has no budget for it")
            )
    return found


def _shown(value: float, unit: str) -> str:
    """A figure with its unit; a bare ratio has none."""
    text = f"{from_si(value, unit):.3g}"
    return text if unit == "1" else f"{text} {unit}"
