"""An effect on one sensor only, and at the parameters that one unit was found to have: 156 s, not 600.

    drift_curve_of_gyro                           drift_curve on the gyros; the accelerometers have none
    warm_up_of_gyro_with_time_constant_156        warm_up on the gyros, usually of 156 s

The name says it, so that every room that asks the catalogue plans, flies and checks with that; a budget
stands under the same name. A fit begins at the parameters and finds each channel's own. Numbers are as the
effect takes them (s, degC, day); `m` stands for minus, `p` for the point. What steps keeps its own name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

from planner.effects._channels import BaseEffect
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Effect, Sensor, Term

_NUMBER = r"m?\d+(?:p\d+)?"
_PATTERN = rf"([a-z][a-z_]*?)_of_(gyro|acc)(?:_with_([a-z_]+_{_NUMBER}(?:_and_[a-z_]+_{_NUMBER})*))?"
_SENSORS: Mapping[str, Sensor] = {"gyro": "gyro", "acc": "accelerometer"}


class Shaped(BaseEffect):
    """`plain` on one sensor, and with other usual values of its parameters; all else is as it says."""

    def __init__(self, name: str, plain: Effect, sensor: Sensor, values: Mapping[str, float]) -> None:
        self.plain, self.sensor = plain, sensor
        self.name = name
        self.sensors = (sensor,)
        self.units = {sensor: plain.units[sensor]}
        self.parameters = tuple(replace(p, default=values.get(p.name, p.default)) for p in plain.parameters)
        said = ", ".join(p.shown(p.default) for p in self.parameters if p.name in values)
        self.title = f"{plain.title} of {said}" if said else f"{plain.title}, {sensor} only"
        for what in (
            "group", "needs", "variable", "temperature_of", "tabled", "bench_only", "misfit", "history",
            "nodal", "apart", "follows_drift", "one_scale", "linear_in_force", "largest", "equation",
            "source",
        ):  # fmt: skip
            setattr(self, what, getattr(plain, what, getattr(BaseEffect, what, None)))

    def terms(self, sensor: Sensor) -> tuple[Term, ...]:
        """As the plain effect's."""
        return self.plain.terms(sensor)

    def regressors(
        self, sensor: Sensor, conditions: Conditions, nonlinear: Mapping[str, float] | None = None
    ) -> Array:
        """As the plain effect's, at this unit's parameters where none are given."""
        return self.plain.regressors(sensor, conditions, {**self.nonlinear, **(nonlinear or {})})


def shaped_name(plain: str, sensor: Sensor, values: Mapping[str, float]) -> str:
    """`warm_up_of_gyro_with_time_constant_156`; values to three digits."""
    short = "gyro" if sensor == "gyro" else "acc"
    parts = (f"{name}_{_written(value)}" for name, value in values.items())
    return f"{plain}_of_{short}_with_{'_and_'.join(parts)}"


def _written(x: float) -> str:
    return f"{float(f'{x:.3g}'):f}".rstrip("0").rstrip(".").replace("-", "m").replace(".", "p")


def plain_name(name: str) -> str:
    """`warm_up` of `warm_up_of_gyro_with_time_constant_156`; of another effect its own name."""
    e = shaped_of(name)
    return name if e is None else e.plain.name


def plain_names(effects: tuple[str, ...], sensor: Sensor) -> tuple[str, ...]:
    """The same effects, on one sensor, by the names that they have at their usual parameters."""
    known = ((name, shaped_of(name)) for name in effects)
    return tuple(name if e is None else e.plain.name for name, e in known if e is None or e.sensor == sensor)


@lru_cache(maxsize=1024)
def shaped_of(name: str) -> Shaped | None:
    """The effect that a name describes; None where it describes none, or a parameter is out of range."""
    from planner import catalog

    match = re.fullmatch(_PATTERN, name)
    if match is None or match[1] not in iter(catalog.effects()):
        return None
    plain, sensor = catalog.effects()[match[1]], _SENSORS[match[2]]
    values = {}
    for part in match[3].split("_and_") if match[3] else ():
        key, _, number = part.rpartition("_")
        values[key] = float(number.replace("m", "-").replace("p", "."))
    ranges = {p.name: p for p in plain.parameters if not p.stepped}
    if sensor not in plain.sensors or any(
        key not in ranges or not ranges[key].low <= value <= ranges[key].high for key, value in values.items()
    ):
        return None
    return Shaped(name, plain, sensor, values)
