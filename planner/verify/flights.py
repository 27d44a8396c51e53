"""The spec's flight, many times, each with what its own calibration left: full nonlinear navigation.

The corrected readings of a unit are û = M̂⁻¹ [(1 + κ) M u + b − b̂]/(1 + κ̂) = A u + c. In flight A and c change
with the temperature and the in-run drift, so they are given at a few moments and linear between. That makes
û − u a linear combination of fixed columns, hat(t) · u_j on channel i, and
`planner.physics.perturbed` navigates all flights through it with nothing linearised.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from planner import catalog
from planner.physics.error_dynamics import ErrorHistory, propagate_errors
from planner.physics.perturbed import navigate_with_errors
from planner.protocols import SENSORS, Sensor
from planner.records import Array, Conditions, Trajectory
from planner.spec.model import Requirement
from planner.verify.residuals import Left, channel_of

BLOCK_S = 0.25
MOMENT_S = 60.0  # a tenth of the in-run process's correlation time
MOMENT_K = 2.0
INSTANTS = 60  # of a flight at which a requirement that holds at any moment is looked at
COMPONENTS = {
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
TABLED = ("bias", "scale_factor", "misalignment")  # what A and c are made of


def moments(trajectory: Trajectory) -> Array:
    """(K,) times at which A and c are given: often enough for the in-run drift and the temperature."""
    t = trajectory.time_s
    warmed = float(np.abs(np.diff(trajectory.temperature_degc)).sum())
    count = max(int(np.ceil((t[-1] - t[0]) / MOMENT_S)), int(np.ceil(warmed / MOMENT_K)), 1)
    return np.linspace(float(t[0]), float(t[-1]), count + 1)


@dataclass(frozen=True)
class FlightModel:
    """A flight prepared for many units.

    moments: (K,) s; extras: (sensor, effect) of each error beside the tables
    instants: (m,) s at which errors are wanted; linear: their sensitivities per column, (m, 3, p) each
    """

    trajectory: Trajectory
    moments: Array
    extras: tuple[tuple[Sensor, str], ...]
    instants: Array
    linear: ErrorHistory

    def forcing(self, start: int, stop: int) -> tuple[list[Array], list[Array]]:
        """Columns of both sensors over the samples start..stop."""
        return forcing(self.trajectory, self.moments, self.extras, start, stop)

    def navigate(self, coefficients: Array) -> ErrorHistory:
        """Navigation errors (m, 3, B) of flights with coefficients (B, p), nonlinear."""
        with np.errstate(all="ignore"):  # a useless calibration may lead beyond all numbers
            return navigate_with_errors(
                self.trajectory, self.forcing, coefficients, block_s=BLOCK_S, instants=self.instants.tolist()
            )


def flight_model(
    trajectory: Trajectory, errors: Sequence[tuple[Sensor, str]], requirements: Sequence[Requirement]
) -> FlightModel:
    """The flight of a spec with budgeted errors (sensor, effect)."""
    at = moments(trajectory)
    extras = tuple((s, e) for s, e in errors if e not in TABLED)
    instants = _instants(trajectory, requirements)
    history = propagate_errors(
        trajectory, lambda a, b: forcing(trajectory, at, extras, a, b), instants=instants.tolist()
    )
    rows = [int(np.argmin(np.abs(history.time_s - t))) for t in instants]
    chosen = ErrorHistory(
        history.time_s[rows], history.position[rows], history.velocity[rows], history.attitude[rows]
    )
    return FlightModel(trajectory, at, extras, instants, chosen)


def _instants(trajectory: Trajectory, requirements: Sequence[Requirement]) -> Array:
    end = float(trajectory.time_s[-1])
    wanted = {end, *(float(r.at) for r in requirements if not isinstance(r.at, str))}
    if any(r.at == "any" for r in requirements):
        wanted |= {float(t) for t in np.linspace(0.0, end, INSTANTS + 1)[1:]}
    return np.array(sorted(wanted))


def conditions_of(trajectory: Trajectory, start: int, stop: int) -> Conditions:
    """Means over the sampling intervals start..stop of the flight."""
    step = trajectory.time_s[1] - trajectory.time_s[0]
    warm, on = (
        (x[start:stop] + x[start + 1 : stop + 1]) / 2.0
        for x in (trajectory.temperature_degc, trajectory.time_on)
    )
    return Conditions(
        rate=trajectory.angle_increment[start:stop] / step,
        specific_force=trajectory.velocity_increment[start:stop] / step,
        temperature_degc=warm,
        temperature_rate=np.diff(trajectory.temperature_degc[start : stop + 1]) / step,
        time_on=on,
        day=np.full(stop - start, trajectory.day),
    )


def forcing(
    trajectory: Trajectory,
    at: Array,
    extras: Sequence[tuple[Sensor, str]],
    start: int,
    stop: int,
) -> tuple[list[Array], list[Array]]:
    """Columns of gyros and accelerometers: for every moment c (3) and A − I (9), then the extras."""
    c = conditions_of(trajectory, start, stop)
    middle = (trajectory.time_s[start:stop] + trajectory.time_s[start + 1 : stop + 1]) / 2.0
    hat = np.array([np.interp(middle, at, row) for row in np.eye(len(at))])
    found: dict[Sensor, list[Array]] = {}
    for sensor, u in zip(SENSORS, (c.rate, c.specific_force), strict=True):
        basic = _basic(u)
        own = [catalog.effects()[e].regressors(sensor, c) for s, e in extras if s == sensor]
        found[sensor] = [h[:, None, None] * columns for h in hat for columns in (basic, *own)]
    return found["gyro"], found["accelerometer"]


def _basic(u: Array) -> Array:
    """(n, 3, 12): one on each channel, then u_j on channel i in the order of A's rows."""
    columns = np.zeros((len(u), 3, 12))
    for i in range(3):
        columns[:, i, i] = 1.0
        columns[:, i, 3 + 3 * i : 6 + 3 * i] = u
    return columns


# ---------------------------------------------------------------- coefficients


def exact_coefficients(model: FlightModel, left: Sequence[Left]) -> Array:
    """(B, p) of what the correction leaves, products of scale factor and misalignment included."""
    blocks = []
    for sensor in SENSORS:
        mine = {e.effect: e for e in left if e.sensor == sensor}
        A, c = _corrected(mine, len(left[0].true), len(model.moments))
        basic = np.concatenate([c, (A - np.eye(3)).reshape(*A.shape[:2], 9)], axis=2)
        blocks.append(_with_extras(basic, model, sensor, {e: x.total for e, x in mine.items()}))
    return np.concatenate(blocks, axis=1)


def part_coefficients(
    model: FlightModel, sensor: Sensor, effect: str, terms: Sequence[str], value: Array
) -> Array:
    """(B, p) of one part of one error to first order; value: (B, K, t)."""
    units, count = value.shape[:2]
    blocks = []
    for each in SENSORS:
        basic = np.zeros((units, count, 12))
        mine = each == sensor
        if mine and effect in TABLED:
            for t, term in enumerate(terms):
                basic[:, :, _place(effect, term)] = value[:, :, t]
        extra = {effect: value} if mine and effect not in TABLED else {}
        blocks.append(_with_extras(basic, model, each, extra))
    return np.concatenate(blocks, axis=1)


def _place(effect: str, term: str) -> int:
    i = channel_of(term)
    j = channel_of(term[1]) if effect == "misalignment" else i
    return i if effect == "bias" else 3 + 3 * i + j


def _with_extras(basic: Array, model: FlightModel, sensor: Sensor, values: Mapping[str, Array]) -> Array:
    """(B, K · k) in the order of the forcing: at every moment the twelve, then the extras."""
    parts = [basic]
    for s, effect in model.extras:
        if s == sensor:
            count = len(catalog.effects()[effect].terms(sensor))
            parts.append(values.get(effect, np.zeros((*basic.shape[:2], count))))
    return np.concatenate(parts, axis=2).reshape(len(basic), -1)


def _corrected(mine: Mapping[str, Left], units: int, count: int) -> tuple[Array, Array]:
    """A (B, K, 3, 3) and c (B, K, 3) of one sensor: û = A u + c."""
    shape = (units, count, 3)
    nothing = np.zeros(shape)
    b, k = (mine[e].total if e in mine else nothing for e in ("bias", "scale_factor"))
    true, estimated = (
        (mine["scale_factor"].true, mine["scale_factor"].estimated) if "scale_factor" in mine else (k, k)
    )
    lean = mine.get("misalignment")
    M, found = (_matrix(lean, which, units, count) for which in ("true", "estimated"))
    inverse = np.linalg.inv(found)
    A = inverse @ (((1.0 + true) / (1.0 + estimated))[..., None] * M)
    c = (inverse @ (b / (1.0 + estimated))[..., None])[..., 0]
    return A, c


def _matrix(lean: Left | None, which: str, units: int, count: int) -> Array:
    matrix = np.zeros((units, count, 3, 3))
    matrix[..., range(3), range(3)] = 1.0
    if lean is not None:
        for t, term in enumerate(lean.terms):
            matrix[..., channel_of(term[0]), channel_of(term[1])] = getattr(lean, which)[:, :, t]
    return matrix


# ---------------------------------------------------------------- errors that requirements ask for


def vectors_of(history: ErrorHistory, instants: Array, requirement: Requirement) -> Array:
    """(k, c, B) components that a requirement asks for, at the instants at which it holds."""
    field, components = COMPONENTS[requirement.error]
    values: Array = getattr(history, field)[:, components]
    if requirement.at == "any":
        return values
    at = instants[-1] if requirement.at == "end" else float(requirement.at)
    return values[[int(np.argmin(np.abs(instants - at)))]]


def lengths_of(vectors: Array) -> Array:
    """(B,) the largest length over the instants; infinite for a flight that ran beyond all numbers."""
    with np.errstate(all="ignore"):
        longest = np.linalg.norm(vectors, axis=1).max(axis=0)
    return np.where(np.isfinite(longest), longest, np.inf)
