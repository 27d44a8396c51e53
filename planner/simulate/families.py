"""A spec's temperature curves by one named family: what is drawn of every error that has one."""

from __future__ import annotations

from planner.errors import InputError
from planner.protocols import SENSORS, Sensor
from planner.simulate.curves.measured import one_unit, several_units, table_of
from planner.simulate.temperature_curves import CurveFamily, curve_family
from planner.spec.budget import ErrorBudget
from planner.spec.curve_names import FAMILY_NAMES, FamilyName
from planner.spec.model import Spec
from planner.spec.places import did_you_mean
from planner.spec.temperature_residual import CurveName


def family_named(word: str) -> FamilyName:
    """The family of a user's word. Raises InputError for one that there is not."""
    for name in FAMILY_NAMES:
        if word == name:
            return name
    raise InputError(f"--curves {word[:40]!r}: no family of curves{did_you_mean(word, FAMILY_NAMES)}")


def curve_families(spec: Spec, name: FamilyName = "measured") -> dict[tuple[Sensor, str], CurveFamily]:
    """(sensor, effect) -> its curves, of every budget that varies with temperature.

    A table leaves the family that it names itself, or else `name`; so does the table that one unit's measured
    curve leaves. `measured`: that curve itself, up to its sign, and cosines for the tables. The curves of
    several units are always their own Gaussian.
    """
    low, high = spec.plan.temperatures.range
    found = {
        (sensor, effect): _family(budget, low, high, name)
        for sensor in SENSORS
        for effect, budget in getattr(spec.unit, sensor).items()
    }
    return {error: family for error, family in found.items() if family is not None}


def _family(budget: ErrorBudget, low: float, high: float, name: FamilyName) -> CurveFamily | None:
    shape: CurveName = "cosines" if name == "measured" else name
    if budget.measured_curves:
        return several_units(budget.measured_curves)
    if budget.measured_curve is not None:
        if name == "measured":
            return one_unit(budget.measured_curve)
        return curve_family(table_of(budget.measured_curve, low, high), low, high, "largest", shape)
    table = budget.residual_table
    if table is None:
        return None
    return curve_family(table, low, high, budget.residual_figure, budget.curve_family_name or shape)
