"""Stage: a flight and the declared errors in, the linear combination and the constraints on it out.

    navigation error = Σ over errors and their terms of column · coefficient        (K 3.3, eqs 32-34)

The columns come from the linear error equations, `planner.physics.error_dynamics`; a column's forcing is
what its effect says it adds to the sensor's output along the flight.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from planner.catalog import effects
from planner.errors import InputError
from planner.nouns.array import Array, Rule
from planner.nouns.conditions import Conditions
from planner.nouns.sensitivities import Constraint, Sensitivities, SensitivityColumn
from planner.nouns.trajectory import Trajectory
from planner.physics.error_dynamics import propagate_errors
from planner.protocols import SENSORS, Effect, Sensor
from planner.spec.model import NAVIGATION_ERRORS, Given, PercentileRule, Requirement, Spec
from planner.units import unit_factor

LOOKED_AT = 600  # instants of a requirement at any moment: every second of ten minutes
COMPONENTS = {  # navigation error -> field of Sensitivities, components that count
    "position": ("position", slice(0, 3)),
    "horizontal": ("position", slice(0, 2)),
    "north": ("position", slice(0, 1)),
    "east": ("position", slice(1, 2)),
    "up": ("position", slice(2, 3)),
    "velocity": ("velocity", slice(0, 3)),
    "attitude": ("attitude", slice(0, 3)),
    "roll_pitch": ("attitude", slice(0, 2)),
    "heading": ("attitude", slice(2, 3)),
}


# ---------------------------------------------------------------- columns


def sensitivities(
    trajectory: Trajectory, errors: Sequence[str], *, instants: Sequence[float] = ()
) -> Sensitivities:
    """Navigation error per SI unit of every term of the errors, in one pass over the flight.

    errors: names such as `gyro.bias`, `accelerometer.misalignment`; the columns keep this order
    instants: times (s) at which a requirement holds; the history gets an entry there, to the nearest sample.
    Without them it has one every second, sixty or more in a flight.
    Raises InputError for an unknown error.
    """
    named = [(error, *_effect_of(error)) for error in errors]
    by_sensor = {sensor: [effect for _, s, effect in named if s == sensor] for sensor in SENSORS}

    def forcing(start: int, stop: int) -> tuple[list[Array], list[Array]]:
        conditions = conditions_of(trajectory, start, stop)
        gyro, accelerometer = (
            [effect.regressors(sensor, conditions) for effect in by_sensor[sensor]] for sensor in SENSORS
        )
        return gyro, accelerometer

    history = propagate_errors(trajectory, forcing, instants=instants)
    order = _as_asked(named)
    return Sensitivities(
        time_s=history.time_s,
        columns=tuple(
            SensitivityColumn(error, term.name, effect.units[sensor])
            for error, sensor, effect in named
            for term in effect.terms(sensor)
        ),
        position=history.position[:, :, order],
        velocity=history.velocity[:, :, order],
        attitude=history.attitude[:, :, order],
    )


def conditions_of(trajectory: Trajectory, start: int = 0, stop: int | None = None) -> Conditions:
    """What the sensors are exposed to along the flight: means over the sampling intervals start..stop."""
    stop = len(trajectory.angle_increment) if stop is None else stop
    ends = slice(start, stop + 1)
    step = (trajectory.time_s[-1] - trajectory.time_s[0]) / len(trajectory.angle_increment)
    temperature, time_on = trajectory.temperature_degc[ends], trajectory.time_on[ends]
    return Conditions(
        rate=trajectory.angle_increment[start:stop] / step,
        specific_force=trajectory.velocity_increment[start:stop] / step,
        temperature_degc=0.5 * (temperature[:-1] + temperature[1:]),
        temperature_rate=np.diff(temperature) / step,
        time_on=0.5 * (time_on[:-1] + time_on[1:]),
        day=np.full(stop - start, trajectory.day),
    )


def _effect_of(error: str) -> tuple[Sensor, Effect]:
    sensor, _, name = error.partition(".")
    effect = effects().get(name)
    for known in get_args(Sensor):
        if known == sensor and effect is not None and sensor in effect.sensors:
            return known, effect
    raise InputError(
        f"{error!r} is no sensor error; expected gyro.<effect> or accelerometer.<effect> with one of "
        + ", ".join(effects())
    )


def _as_asked(named: Sequence[tuple[str, Sensor, Effect]]) -> NDArray[np.int64]:
    """Indices that bring the columns, gyros first, into the order of the errors."""
    sizes = np.array([len(effect.terms(sensor)) for _, sensor, effect in named], dtype=int)
    by_sensor = np.argsort([SENSORS.index(sensor) for _, sensor, _ in named], kind="stable")
    owner = np.repeat(by_sensor, sizes[by_sensor])
    return np.argsort(owner, kind="stable")


# ---------------------------------------------------------------- constraints


def constraints(spec: Spec, sensitivities: Sensitivities | None) -> tuple[Constraint, ...]:
    """Every requirement at every instant that can bind, as vectors per error.

    With given (published) coefficients there is one vector of one component per error, and `sensitivities`
    is not used. `at: any` yields one constraint per instant of the history, without those that another
    instant implies. Raises InputError for an instant outside the flight.
    """
    if isinstance(spec.sensitivities, Given):
        vectors = {name: np.array([[value.si]]) for name, value in spec.sensitivities.given.items()}
        return tuple(
            _constraint(i, wanted, 0.0 if isinstance(wanted.at, str) else wanted.at, vectors)
            for i, wanted in enumerate(spec.requirement)
        )
    if sensitivities is None:
        raise ValueError("simulated sensitivities are needed when the spec gives none")
    return tuple(
        _constraint(i, wanted, time, vectors)
        for i, wanted in enumerate(spec.requirement)
        for time, vectors in _at_instants(wanted, sensitivities)
    )


def _constraint(index: int, wanted: Requirement, time: float, vectors: Mapping[str, Array]) -> Constraint:
    percentile = wanted.rule.percentile if isinstance(wanted.rule, PercentileRule) else None
    rule: Rule = "percentile" if isinstance(wanted.rule, PercentileRule) else wanted.rule
    unit = NAVIGATION_ERRORS[wanted.error]
    return Constraint(index, wanted.error, unit, rule, wanted.limit.si, time, vectors, percentile)


def _at_instants(wanted: Requirement, found: Sensitivities) -> list[tuple[float, dict[str, Array]]]:
    name, components = COMPONENTS[wanted.error]
    history: Array = getattr(found, name)[:, components, :]
    if wanted.at == "end":
        return [(float(found.time_s[-1]), _by_error(history[-1], found.columns))]
    if wanted.at == "any":
        keep = _undominated(wanted, history, found.columns)
        return [(float(found.time_s[i]), _by_error(history[i], found.columns)) for i in keep]
    return [(wanted.at, _by_error(_interpolated(found.time_s, history, wanted.at), found.columns))]


def _by_error(components: Array, columns: Sequence[SensitivityColumn]) -> dict[str, Array]:
    """(k, p) -> error name -> (terms, k)."""
    names = [column.error for column in columns]
    return {name: components[:, [n == name for n in names]].T.copy() for name in dict.fromkeys(names)}


def _interpolated(time_s: Array, history: Array, at: float) -> Array:
    """Linear between the two instants around `at`; to half a sample if `at` was asked for beforehand."""
    if not time_s[0] <= at <= time_s[-1]:
        raise InputError(
            f"a requirement holds at {at:g} s, but the flight ends at {time_s[-1]:g} s; "
            "choose an instant inside the flight, or `end`"
        )
    i = int(np.clip(np.searchsorted(time_s, at), 1, len(time_s) - 1))
    share = (at - time_s[i - 1]) / (time_s[i] - time_s[i - 1])
    return np.asarray((1.0 - share) * history[i - 1] + share * history[i])


def _undominated(wanted: Requirement, history: Array, columns: Sequence[SensitivityColumn]) -> list[int]:
    """Instants that no other instant implies, whatever the sizes of the errors; in order of time.

    What an error of unit size adds at an instant is a scalar by the rules worst_case (sum of the lengths of
    its terms) and rss (sum of their squares), and a covariance by a percentile; one instant implies another
    if it adds at least as much (covariance: the difference is positive semidefinite) for every error.
    """
    names = [column.error for column in columns]
    share = np.stack(
        [_added(wanted, history[:, :, [n == name for n in names]]) for name in dict.fromkeys(names)], axis=1
    )
    size = np.trace(share, axis1=2, axis2=3)
    kept: list[int] = []
    for i in _largest_of_stretches(size.sum(axis=1)):
        slack = np.linalg.eigvalsh(share[kept] - share[i]).min(axis=-1) + 1e-9 * size[i]
        if not np.any(np.all(slack >= 0.0, axis=1)):
            kept.append(int(i))
    return sorted(kept)


def _largest_of_stretches(size: Array) -> NDArray[np.int64]:
    """Instants (m,) by size, the largest first; of a long flight's the largest of each of its stretches."""
    stretches = np.array_split(np.arange(len(size)), min(len(size), LOOKED_AT))
    chosen = np.array([s[np.argmax(size[s])] for s in stretches])
    return np.asarray(chosen[np.argsort(-size[chosen], kind="stable")])


def _added(wanted: Requirement, vectors: Array) -> Array:
    """(m, k, terms) -> what the error adds at each instant, (m, 1, 1) or for a percentile (m, k, k)."""
    if isinstance(wanted.rule, PercentileRule):
        return np.asarray(vectors @ vectors.swapaxes(1, 2))
    squares = np.sum(vectors**2, axis=1)
    total = np.sum(squares if wanted.rule == "rss" else np.sqrt(squares), axis=1)
    return np.asarray(total[:, None, None])


# ---------------------------------------------------------------- for people and files


@dataclass(frozen=True)
class SensitivityRow:
    """One column as the interfaces print it: signed errors for one `per` of the sensor error, at `time_s`."""

    error: str
    axis: str
    per: str
    north_m: float
    east_m: float
    up_m: float
    north_mps: float
    east_mps: float
    up_mps: float
    roll_deg: float
    pitch_deg: float
    heading_deg: float
    time_s: float


def sensitivity_rows(
    sensitivities: Sensitivities, at: Literal["end", "any"] | float = "end"
) -> list[SensitivityRow]:
    """Every column per display unit of its coefficient (scale factor: per 1).

    at: the end of the flight, a time in seconds inside it, or `any`: for each column the moment of its
    largest position error. Raises InputError for a time outside the flight.
    """
    history = np.concatenate(
        [sensitivities.position, sensitivities.velocity, np.rad2deg(sensitivities.attitude)], axis=1
    )
    return [
        _row(column, sensitivities.time_s, history[:, :, i], at)
        for i, column in enumerate(sensitivities.columns)
    ]


def _row(
    column: SensitivityColumn, time_s: Array, history: Array, at: Literal["end", "any"] | float
) -> SensitivityRow:
    """history (m, 9) of one column: north, east, up in m, then in m/s, then roll, pitch, heading in deg."""
    if at == "any":
        instant = int(np.linalg.norm(history[:, :3], axis=1).argmax())
        values, time = history[instant], float(time_s[instant])
    elif at == "end":
        values, time = history[-1], float(time_s[-1])
    else:
        values, time = _interpolated(time_s, history, float(at)), float(at)
    north, east, up, v_north, v_east, v_up, roll, pitch, heading = (
        float(value) for value in values * unit_factor(column.unit)[0]
    )
    return SensitivityRow(
        error=column.error,
        axis=column.axis,
        per=column.unit,
        north_m=north,
        east_m=east,
        up_m=up,
        north_mps=v_north,
        east_mps=v_east,
        up_mps=v_up,
        roll_deg=roll,
        pitch_deg=pitch,
        heading_deg=heading,
        time_s=time,
    )
