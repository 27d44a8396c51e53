"""Stage: sensitivities and sizes of the sensor errors in, the navigation error over the flight's time out.

What every sensor error, and every axis of the unit, adds to the navigation error from the start to a
requirement's instant (K 3.3.2, figs 3.13-3.17). By the rule worst_case lengths add, otherwise their squares:

    e_j(t) = ε_j Σ_terms ‖v_term(t)‖         total(t) = Σ_j e_j(t)
    e_j(t) = ε_j √Σ_terms ‖v_term(t)‖²       total(t) = √Σ_j e_j(t)²
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from planner.catalog import effects
from planner.nouns.allowances import ErrorModel
from planner.nouns.array import Array
from planner.nouns.plan import Achieved
from planner.nouns.sensitivities import Constraint, Sensitivities, SensitivityColumn
from planner.nouns.sensor import SENSORS
from planner.plan.budget import uncalibrated
from planner.plan.spec_to_sensitivity import COMPONENTS
from planner.protocols import AXES
from planner.solvers.linear_combination import weights
from planner.spec.model import NAVIGATION_ERRORS

SHARED = "all axes"  # of a term that several channels have in common


@dataclass(frozen=True)
class ErrorOverFlight:
    """One navigation error over the flight, SI. adds: lengths add, otherwise their squares.

    by_error: sensor error -> (m,); by_axis: `x`, `y`, `z`, `all axes` -> (m,), gyro and accelerometer of an
    axis together; total: (m,) of all; time_s: (m,) from the start of the flight
    """

    error: str
    unit: str
    adds: bool
    time_s: Array
    by_error: Mapping[str, Array]
    by_axis: Mapping[str, Array]
    total: Array


def error_over_flight(
    found: Sensitivities,
    sizes: Mapping[str, float],
    error: str,
    *,
    adds: bool,
    until: float | None = None,
) -> ErrorOverFlight:
    """The navigation error `error` that sensor errors of these SI sizes make, up to `until` (s).

    sizes: sensor error -> size of each of its terms; those that are left out count as nothing
    """
    end = found.time_s[-1] if until is None else until
    keep = found.time_s <= end + 1e-9
    name, components = COMPONENTS[error]
    history: Array = getattr(found, name)[keep][:, components, :]
    size = np.array([sizes.get(c.error, 0.0) for c in found.columns])
    each = np.linalg.norm(history, axis=1) * size
    axes = [axis_of(c) for c in found.columns]
    names = [c.error for c in found.columns]
    return ErrorOverFlight(
        error=error,
        unit=NAVIGATION_ERRORS[error],
        adds=adds,
        time_s=found.time_s[keep],
        by_error=_grouped(each, names, [n for n in dict.fromkeys(names) if sizes.get(n, 0.0) > 0], adds),
        by_axis=_grouped(each, axes, [a for a in (*AXES, SHARED) if a in axes], adds),
        total=_together(each, adds),
    )


def axis_of(column: SensitivityColumn) -> str:
    """The axis whose reading a column's term corrupts, or `all axes`."""
    name, _, effect = column.error.partition(".")
    terms = [t for s in SENSORS if s == name and effect in effects() for t in effects()[effect].terms(s)]
    channels = next((t.channels for t in terms if t.name == column.axis), ())
    return AXES[channels[0]] if len(channels) == 1 else SHARED


def uncalibrated_sizes(models: Sequence[ErrorModel]) -> dict[str, float]:
    """Sensor error -> largest size before calibration: systematic and all random parts (K table 4.1)."""
    return {m.name: uncalibrated(m, "worst_case").allowed for m in models}


def planned_sizes(achieved: Achieved, binding: Constraint) -> dict[str, float]:
    """Sensor error -> the size at which its part of the promise at the binding instant is what the plan says.

    The plan splits what it achieves into shares: of the sum (worst_case) or of the squares.
    """
    adds = achieved.rule == "worst_case"
    whole = sum(achieved.shares.values()) or 1.0
    found = {}
    for error, share in achieved.shares.items():
        part = max(share / whole, 0.0)
        # weights of a percentile are root mean squares, as of rss
        per_unit = float(weights(binding, [error])[0])
        found[error] = achieved.achieved * (part if adds else part**0.5) / per_unit if per_unit > 0 else 0.0
    return found


def _grouped(each: Array, owner: Sequence[str], groups: Sequence[str], adds: bool) -> dict[str, Array]:
    return {g: _together(each[:, [o == g for o in owner]], adds) for g in groups}


def _together(each: Array, adds: bool) -> Array:
    """(m, p) lengths -> (m,) their sum or the root of the sum of their squares."""
    return np.asarray(each.sum(axis=1) if adds else np.sqrt((each**2).sum(axis=1)))
