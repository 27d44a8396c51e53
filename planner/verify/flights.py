"""The spec's flight, many times, each with what its own calibration left: full nonlinear navigation.

The readings of a unit are y = Y u + y₀ + (what is neither constant nor proportional), Y = (1 + κ) M, and the
correction knows Ŷ and ŷ₀: û = Ŷ⁻¹ (Y u + y₀ − ŷ₀) = A u + c. In flight A and c change with the temperature
and the in-run drift, so they are given at a few moments and linear between. That makes û − u a linear
combination of fixed columns, hat(t) · u_j on channel i, and `planner.physics.perturbed` navigates all flights
through it with nothing linearised.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from planner.physics.blocks import Blocks, block_edges, pieces
from planner.physics.error_dynamics import ErrorHistory, errors_at
from planner.physics.perturbed import navigate_with_errors
from planner.protocols import SENSORS, Sensor
from planner.spec.model import Requirement
from planner.verify.along_flight import COMPONENTS
from planner.verify.beside import NOTHING, Beside
from planner.verify.flight_columns import BASIC, Columns, columns_of
from planner.verify.residuals import Left
from planner.verify.structure import affine

BLOCK_S = 0.25
MOMENT_S = 60.0  # a tenth of the in-run process's usual correlation time
MOMENT_K = 2.0
MOST_KEPT = 64_000_000  # bytes of what columns leave in the blocks of a flight: ten minutes and more
INSTANTS = 120  # of a flight at which a requirement that holds at any moment is looked at


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

    instants: (m,) s at which errors are wanted; linear: their sensitivities per column, (m, 3, p) each
    """

    columns: Columns
    instants: Array
    linear: ErrorHistory

    @property
    def trajectory(self) -> Trajectory:
        """The flight itself."""
        return self.columns.trajectory

    @property
    def moments(self) -> Array:
        """(K,) s at which A and c are given."""
        return self.columns.moments

    @property
    def beside(self) -> Beside:
        """Noise and initial alignment."""
        return self.columns.beside

    def navigate(self, coefficients: Array) -> ErrorHistory:
        """Navigation errors (m, 3, B) of flights with coefficients (B, p), nonlinear."""
        with np.errstate(all="ignore"):  # a useless calibration may lead beyond all numbers
            flown = navigate_with_errors(
                self.trajectory,
                self.columns.forcing,
                coefficients,
                block_s=BLOCK_S,
                instants=self.instants.tolist(),
                active=self.columns.active,
                blocks=self._blocks,
            )
        if self.beside.height > 0:
            flown.position[:, 2] += coefficients[:, -1]
        return flown

    @cached_property
    def _blocks(self) -> tuple[Blocks, ...] | None:
        """What the columns leave in every block, for all flights; None where that needs much memory."""
        edges = block_edges(self.trajectory.time_s, BLOCK_S, self.instants.tolist())
        found, size = [], 0
        for piece in pieces(self.trajectory, self.columns.forcing, edges):
            size += piece.response.nbytes
            if size > MOST_KEPT:
                return None
            found.append(piece)
        return tuple(found)

    def __getstate__(self) -> dict[str, object]:
        """Without what is kept of the blocks: workers find it sooner than they would be sent it."""
        return {name: value for name, value in vars(self).items() if name != "_blocks"}

    def without_beside(self) -> FlightModel:
        """The same flight with neither noise nor an error of the alignment; its linear model is not kept."""
        return replace(self, columns=replace(self.columns, beside=NOTHING))


def flight_model(
    trajectory: Trajectory,
    errors: Sequence[tuple[Sensor, str]],
    instants: Array,
    beside: Beside = NOTHING,
    shortest_s: float = 10.0 * MOMENT_S,
    range_degc: tuple[float, float] | None = None,
) -> FlightModel:
    """The flight of a spec with errors (sensor, effect), looked at at instants (s).

    range_degc: within which flights may start, None: as warm as the trajectory
    """
    at = moments(trajectory, shortest_s)
    return looked_at(columns_of(trajectory, errors, at, beside, range_degc), instants)


def looked_at(columns: Columns, instants: Array) -> FlightModel:
    """A flight with its columns at other instants."""
    linear = errors_at(columns.trajectory, columns.forcing, columns.active, columns.count, instants.tolist())
    if columns.beside.height > 0:
        linear.position[:, 2, -1] = 1.0
    return FlightModel(columns, instants, linear)


def instants_of(trajectory: Trajectory, requirements: Sequence[Requirement]) -> Array:
    """(m,) s at which the requirements hold; of one that holds at any moment many."""
    end = float(trajectory.time_s[-1])
    wanted = {end, *(float(r.at) for r in requirements if not isinstance(r.at, str))}
    if any(r.at == "any" for r in requirements):
        wanted |= {float(t) for t in np.linspace(0.0, end, INSTANTS + 1)[1:]}
    return np.array(sorted(wanted))


# ---------------------------------------------------------------- coefficients


def exact_coefficients(
    model: FlightModel, left: Sequence[Left], beside: Mapping[str, Array] | None = None
) -> Array:
    """(B, p) of what the correction leaves, products of scale factor and misalignment included.

    beside: coefficients of noise and alignment by name; left out: none
    """
    own, columns = {}, model.columns
    for sensor in SENSORS:
        mine = [e for e in left if e.sensor == sensor]
        A, c = _corrected(sensor, mine, len(left[0].true), len(model.moments))
        basic = np.concatenate([c, (A - np.eye(3)).reshape(*A.shape[:2], 9)], axis=2)
        values = {e.effect: e.total for e in mine}
        own[sensor] = columns.of_values(basic, sensor, values, left[0].temperature_degc)
    return columns.with_beside(own, beside or {})


def part_coefficients(
    model: FlightModel, sensor: Sensor, effect: str, value: Array, degc: Array | None = None
) -> Array:
    """(B, p) of values (B, K, t) of one error to first order; degc: (B, K), None: as the trajectory."""
    own, found = {}, affine(sensor, effect)
    for s in SENSORS:
        basic = np.zeros((*value.shape[:2], BASIC))
        if found is not None and s == sensor:
            basic[:, :, :3] = value @ found.constant.T
            basic[:, :, 3:] = value @ found.slope.reshape(9, -1).T
        extra = {effect: value} if s == sensor and found is None else {}
        own[s] = model.columns.of_values(basic, s, extra, degc)
    return model.columns.with_beside(own, {})


def beside_coefficients(model: FlightModel, beside: Mapping[str, Array], units: int) -> Array:
    """(B, p) of noise or alignment alone."""
    none = np.zeros((units, len(model.moments), BASIC))
    nothing = {s: model.columns.of_values(none, s, {}) for s in SENSORS}
    return model.columns.with_beside(nothing, beside)


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
    misaligned = (bent @ offset["misalignment"][..., None])[..., 0]
    return Y, misaligned + offset["scale_factor"] + offset["bias"]


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
