"""The spec's flight, many times, each with what its own calibration left: full nonlinear navigation.

The readings of a unit are y = Y u + y₀ + (what is neither constant nor proportional), Y = (1 + κ) M, and the
correction knows Ŷ and ŷ₀: û = Ŷ⁻¹ (Y u + y₀ − ŷ₀) = A u + c. In flight A and c change with the temperature
and the in-run drift, so they are given at a few moments and linear between. That makes û − u a linear
combination of fixed columns, hat(t) · u_j on channel i, and `planner.physics.perturbed` navigates all flights
through it with nothing linearised.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from planner.physics.error_dynamics import ErrorHistory, propagate_errors
from planner.physics.perturbed import navigate_with_errors
from planner.protocols import SENSORS, Sensor
from planner.spec.model import Requirement
from planner.verify.along_flight import COMPONENTS, conditions_of
from planner.verify.beside import ALIGNMENT, NOTHING, Beside, noise_name
from planner.verify.residuals import Left
from planner.verify.structure import affine

BLOCK_S = 0.25
MOMENT_S = 60.0  # a tenth of the in-run process's usual correlation time
MOMENT_K = 2.0
INSTANTS = 120  # of a flight at which a requirement that holds at any moment is looked at
BASIC = 12  # columns of A and c


def moments(trajectory: Trajectory, shortest_s: float = 10.0 * MOMENT_S) -> Array:
    """(K,) times at which A and c are given: often enough for the in-run drift and the temperature.

    shortest_s: correlation time of the fastest in-run process
    """
    t = trajectory.time_s
    warmed = float(np.abs(np.diff(trajectory.temperature_degc)).sum())
    apart = min(MOMENT_S, max(shortest_s / 10.0, 1.0))
    count = max(int(np.ceil((t[-1] - t[0]) / apart)), int(np.ceil(warmed / MOMENT_K)), 1)
    return np.linspace(float(t[0]), float(t[-1]), count + 1)


@dataclass(frozen=True)
class FlightModel:
    """A flight prepared for many units.

    moments: (K,) s; extras: (sensor, effect) of each error that is neither constant nor proportional
    instants: (m,) s at which errors are wanted; linear: their sensitivities per column, (m, 3, p) each
    beside: noise and initial alignment, the last columns of each sensor
    """

    trajectory: Trajectory
    moments: Array
    extras: tuple[tuple[Sensor, str], ...]
    instants: Array
    linear: ErrorHistory
    beside: Beside = field(default=NOTHING)

    def forcing(self, start: int, stop: int) -> tuple[list[Array], list[Array]]:
        """Columns of both sensors over the samples start..stop."""
        return forcing(self.trajectory, self.moments, self.extras, start, stop, self.beside)

    def navigate(self, coefficients: Array) -> ErrorHistory:
        """Navigation errors (m, 3, B) of flights with coefficients (B, p), nonlinear."""
        with np.errstate(all="ignore"):  # a useless calibration may lead beyond all numbers
            return navigate_with_errors(
                self.trajectory, self.forcing, coefficients, block_s=BLOCK_S, instants=self.instants.tolist()
            )


def flight_model(
    trajectory: Trajectory,
    errors: Sequence[tuple[Sensor, str]],
    instants: Array,
    beside: Beside = NOTHING,
    shortest_s: float = 10.0 * MOMENT_S,
) -> FlightModel:
    """The flight of a spec with errors (sensor, effect), looked at at instants (s)."""
    at = moments(trajectory, shortest_s)
    extras = tuple((s, e) for s, e in errors if affine(s, e) is None)
    history = propagate_errors(
        trajectory, lambda a, b: forcing(trajectory, at, extras, a, b, beside), instants=instants.tolist()
    )
    rows = [int(np.argmin(np.abs(history.time_s - t))) for t in instants]
    chosen = ErrorHistory(
        history.time_s[rows], history.position[rows], history.velocity[rows], history.attitude[rows]
    )
    return FlightModel(trajectory, at, extras, instants, chosen, beside)


def instants_of(trajectory: Trajectory, requirements: Sequence[Requirement]) -> Array:
    """(m,) s at which the requirements hold; of one that holds at any moment many."""
    end = float(trajectory.time_s[-1])
    wanted = {end, *(float(r.at) for r in requirements if not isinstance(r.at, str))}
    if any(r.at == "any" for r in requirements):
        wanted |= {float(t) for t in np.linspace(0.0, end, INSTANTS + 1)[1:]}
    return np.array(sorted(wanted))


def forcing(
    trajectory: Trajectory,
    at: Array,
    extras: Sequence[tuple[Sensor, str]],
    start: int,
    stop: int,
    beside: Beside = NOTHING,
) -> tuple[list[Array], list[Array]]:
    """Columns of both sensors: for every moment c (3), A − I (9), the extras; then noise and alignment."""
    c = conditions_of(trajectory, start, stop)
    middle = (trajectory.time_s[start:stop] + trajectory.time_s[start + 1 : stop + 1]) / 2.0
    hat = np.array([np.interp(middle, at, row) for row in np.eye(len(at))])
    found: dict[Sensor, list[Array]] = {}
    for sensor, u in zip(SENSORS, (c.rate, c.specific_force), strict=True):
        basic = _basic(u)
        own = [catalog.effects()[e].regressors(sensor, c) for s, e in extras if s == sensor]
        found[sensor] = [h[:, None, None] * columns for h in hat for columns in (basic, *own)]
        found[sensor].append(beside.columns(sensor, trajectory, start, stop))
    return found["gyro"], found["accelerometer"]


def _basic(u: Array) -> Array:
    """(n, 3, 12): one on each channel, then u_j on channel i in the order of A's rows."""
    columns = np.zeros((len(u), 3, BASIC))
    for i in range(3):
        columns[:, i, i] = 1.0
        columns[:, i, 3 + 3 * i : 6 + 3 * i] = u
    return columns


# ---------------------------------------------------------------- coefficients


def exact_coefficients(
    model: FlightModel, left: Sequence[Left], beside: Mapping[str, Array] | None = None
) -> Array:
    """(B, p) of what the correction leaves, products of scale factor and misalignment included.

    beside: coefficients of noise and alignment by name; left out: none
    """
    own = {}
    for sensor in SENSORS:
        mine = [e for e in left if e.sensor == sensor]
        A, c = _corrected(sensor, mine, len(left[0].true), len(model.moments))
        basic = np.concatenate([c, (A - np.eye(3)).reshape(*A.shape[:2], 9)], axis=2)
        own[sensor] = _with_extras(basic, model, sensor, {e.effect: e.total for e in mine})
    return _with_beside(model, own, beside or {})


def part_coefficients(model: FlightModel, sensor: Sensor, effect: str, value: Array) -> Array:
    """(B, p) of values (B, K, t) of one error to first order."""
    own = {}
    found = affine(sensor, effect)
    for s in SENSORS:
        basic = np.zeros((*value.shape[:2], BASIC))
        if found is not None and s == sensor:
            basic[:, :, :3] = value @ found.constant.T
            basic[:, :, 3:] = value @ found.slope.reshape(9, -1).T
        own[s] = _with_extras(basic, model, s, {effect: value} if s == sensor and found is None else {})
    return _with_beside(model, own, {})


def beside_coefficients(model: FlightModel, beside: Mapping[str, Array], units: int) -> Array:
    """(B, p) of noise or alignment alone."""
    nothing = {s: _with_extras(np.zeros((units, len(model.moments), BASIC)), model, s, {}) for s in SENSORS}
    return _with_beside(model, nothing, beside)


def _with_extras(basic: Array, model: FlightModel, sensor: Sensor, values: Mapping[str, Array]) -> Array:
    """(B, K k) in the order of the forcing: at every moment the twelve, then the extras."""
    parts = [basic]
    for s, effect in model.extras:
        if s == sensor:
            count = len(catalog.effects()[effect].terms(sensor))
            parts.append(values.get(effect, np.zeros((*basic.shape[:2], count))))
    return np.concatenate(parts, axis=2).reshape(len(basic), -1)


def _with_beside(model: FlightModel, own: Mapping[Sensor, Array], beside: Mapping[str, Array]) -> Array:
    """(B, p) gyros then accelerometers, each with its columns beside; a self-alignment's tilt is here."""
    units, all_parts = len(own["gyro"]), []
    for sensor in SENSORS:
        parts = [own[sensor]]
        if sensor in model.beside.noise:
            count = 3 * (len(model.beside.edges) - 1)
            parts.append(beside.get(noise_name(sensor), np.zeros((units, count))))
        if sensor == "gyro" and model.beside.alignment is not None:
            given = beside.get(ALIGNMENT, np.zeros((units, 3)))
            parts.append(given + _levelled(model, own["accelerometer"]))
        all_parts += parts
    return np.concatenate(all_parts, axis=1)


def _levelled(model: FlightModel, accelerometer: Array) -> Array:
    """(B, 3) tilt that the accelerometers' error at the first sample makes, where they level themselves."""
    if model.beside.alignment is None or not model.beside.alignment.self_aligned:
        return np.zeros((len(accelerometer), 3))
    columns = np.concatenate(forcing(model.trajectory, model.moments, model.extras, 0, 1)[1], axis=2)[0]
    return model.beside.tilt(model.trajectory, accelerometer @ columns.T)


def _corrected(sensor: Sensor, mine: Sequence[Left], units: int, count: int) -> tuple[Array, Array]:
    """A (B, K, 3, 3) and c (B, K, 3) of one sensor: û = A u + c."""
    true, offset = _reading(sensor, [(e, e.true) for e in mine], (units, count))
    found, known = _reading(sensor, [(e, e.estimated) for e in mine], (units, count))
    inverse = np.linalg.inv(found)
    return inverse @ true, (inverse @ (offset - known)[..., None])[..., 0]


def _reading(
    sensor: Sensor, values: Sequence[tuple[Left, Array]], shape: tuple[int, int]
) -> tuple[Array, Array]:
    """Y (B, K, 3, 3) and y₀ (B, K, 3) of y = (1 + κ)(M u) + b = Y u + y₀."""
    slope = {group: np.zeros((*shape, 3, 3)) for group in ("bias", "scale_factor", "misalignment")}
    offset = {group: np.zeros((*shape, 3)) for group in slope}
    for error, value in values:
        found = affine(sensor, error.effect)
        if found is not None:
            slope[found.group] += np.einsum("ijt,bkt->bkij", found.slope, value)
            offset[found.group] += value @ found.constant.T
    bent = np.eye(3) + slope["scale_factor"]
    Y = bent @ (np.eye(3) + slope["misalignment"]) + slope["bias"]
    leaned = (bent @ offset["misalignment"][..., None])[..., 0]
    return Y, leaned + offset["scale_factor"] + offset["bias"]


# ---------------------------------------------------------------- errors that requirements ask for


def vectors_of(history: ErrorHistory, instants: Array, requirement: Requirement) -> Array:
    """(k, c, B) components that a requirement asks for, at the instants at which it holds."""
    field_of, components = COMPONENTS[requirement.error]
    values: Array = getattr(history, field_of)[:, components]
    return values[instants_at(instants, requirement)]


def instants_at(instants: Array, requirement: Requirement) -> list[int]:
    """Which of the instants a requirement holds at."""
    if requirement.at == "any":
        return list(range(len(instants)))
    at = instants[-1] if requirement.at == "end" else float(requirement.at)
    return [int(np.argmin(np.abs(instants - at)))]


def lengths_of(vectors: Array) -> Array:
    """(B,) the largest length over the instants; infinite for a flight that ran beyond all numbers."""
    with np.errstate(all="ignore"):
        longest = np.linalg.norm(vectors, axis=1).max(axis=0)
    return np.where(np.isfinite(longest), longest, np.inf)
