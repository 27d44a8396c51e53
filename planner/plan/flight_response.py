"""The linear combination of a flight in which the errors change: navigation error per error, term and moment.

An error of a term that runs through values s_k at moments t_k, linear between, adds Σ_k s_k · (response to
the hat function of t_k): drift within the flight and tables over its temperature are linear in few numbers.
An effect that changes with temperature by its own equation (misalignment per kelvin) is propagated at the
temperatures between which that equation is straight: Σ_n hat_n(T(t_k)) R_kn is its response from any start.
White noise of a sensor adds Σ_b J_b J_bᵀ N² / Δ over boxes of time Δ, J_b the response to one over box b.
It is the same along all axes, so J_b is along north, east and down: along those of a body that turns the
response changes its sign within a box, and hardly anything would be left of the noise.
A self-alignment's tilt belongs to what the accelerometers err by at the first moment (initial_attitude).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.sensor import ErrorName
from planner.nouns.trajectory import Trajectory
from planner.physics.blocks import Indices
from planner.physics.error_dynamics import errors_at
from planner.plan import initial_attitude
from planner.plan.spec_to_sensitivity import COMPONENTS, conditions_of
from planner.protocols import SENSORS
from planner.spec.model import Requirement
from planner.spec.references import InitialAlignment
from planner.temperature_table import hats as hats_of
from planner.temperature_table import steps_within

MOMENT_S = 60.0  # a tenth of the usual correlation time of the in-run process
MOMENTS_IN_TIME = 2.0  # at least, of a shorter one: what lines between them make of it adds 1 % to its sigma
MOST_FOR_DRIFT = 120  # moments: of a long flight shorter times count as this many have them
MOMENT_K = 2.0
BOXES = 24  # of white noise, or more; a response that grows like t² is then integrated to 1e-3
TURN = 0.25  # rad, at most in a box: tilts in a turn drive the vertical to and fro
MOST_BOXES = 240
INSTANTS = 60  # of a flight, for a requirement that holds at any moment
STEP_K = 5.0  # between temperatures at which effects that change with it are looked at; their kinks lie there
STRAIGHT = 1e-9  # of the largest, by which an effect may differ from a straight line over temperature
PROBES = 32  # samples of a flight on which that is tried


@dataclass(frozen=True)
class Flying:
    """One term of one error, in flight."""

    error: ErrorName
    term: str
    channel: int


@dataclass(frozen=True)
class OverTemperature:
    """Terms of one error that change with temperature. errors: (m, 9, t, N, K); nodes: (N,) degC ascending"""

    places: slice
    nodes: Array
    errors: Array


@dataclass(frozen=True)
class FlightResponse:
    """The linear combination of a flight.

    time_s: (m,) instants; moments: (K,) s; temperature_degc: (K,) of the flight there
    flying: F terms; errors: (m, 9, F, K) position, velocity, attitude, per SI unit of a term at a moment,
        at the flight's own temperatures; warmer: those of them that are others when it is warmer
    white: (m, 9, 2, 3 b) of b boxes per unit of noise of each sensor along each axis, a record of a second
    height: sigma of the height aid, m, one draw a flight that the computed height has all along; 0: none
    aligned: (m, 9, a) one sigma each of the initial attitude's own chances, one draw a flight
    """

    time_s: Array
    moments: Array
    temperature_degc: Array
    flying: tuple[Flying, ...]
    errors: Array
    white: Array
    height: float = 0.0
    aligned: Array = field(default_factory=lambda: np.zeros((1, 9, 0)))
    warmer: tuple[OverTemperature, ...] = ()

    def started(self, along: Array, instants: Sequence[int], components: slice) -> Array:
        """(S or 1, I, c, F, K) errors at some instants of flights at temperatures (S, K); 1: all the same."""
        J = self.errors[list(instants)][None, :, components]
        if not self.warmer:
            return J
        J = np.repeat(J, len(along), axis=0)
        for w in self.warmer:
            hats = hats_of(along.ravel(), w.nodes, 0.0).reshape(*along.shape, -1)  # (S, K, N)
            own = w.errors[list(instants)][:, components]
            J[:, :, :, w.places] = np.einsum("ictnk,skn->sictk", own, hats, optimize=True)
        return J

    def of(self, wanted: Requirement) -> tuple[slice, list[int]]:
        """Which of the nine components a requirement asks for, and at which instants."""
        components = nine_of(wanted.error)
        if wanted.at == "any":
            return components, list(range(len(self.time_s)))
        at = self.time_s[-1] if wanted.at == "end" else float(wanted.at)
        return components, [int(np.argmin(np.abs(self.time_s - at)))]


def nine_of(error: str) -> slice:
    """Which of position, velocity and attitude (9,) a requirement on an error asks for."""
    name, part = COMPONENTS[error]
    first = 3 * ("position", "velocity", "attitude").index(name)
    return slice(first + part.start, first + part.stop)


def flight_response(
    trajectory: Trajectory,
    errors: Sequence[ErrorName],
    requirements: Sequence[Requirement],
    alignment: InitialAlignment | None = None,
    range_degc: tuple[float, float] | None = None,
    in_run_s: float = np.inf,
) -> FlightResponse:
    """The linear combination of a flight for some errors, at the instants that requirements ask for.

    alignment: how well the flight knows its attitude at the start; None: perfectly
    range_degc: within which flights may start, None: where this one does
    in_run_s: the shortest correlation time of an error that drifts
    """
    at = _moments(trajectory, in_run_s)
    instants = _instants(trajectory, requirements)
    named = [e for sensor in SENSORS for e in errors if e.sensor == sensor]
    asked = [
        one
        for e in named
        for one in ((e, None), *((e, float(degc)) for degc in _nodes(trajectory, e, range_degc)))
    ]
    hats = _propagated(trajectory, instants, _Errors(trajectory, at, asked))
    hats = hats.reshape(len(instants), 9, -1, len(at))
    aligned = np.zeros((len(instants), 9, 0))
    if alignment is not None:
        turned = initial_attitude.turned(trajectory, instants)
        aligned = turned @ initial_attitude.by_chance(trajectory, alignment)
        if alignment.self_aligned:
            hats[..., 0] += turned @ _tilts(trajectory, asked)
    flying, own, warmer = _sorted(asked, hats)
    return FlightResponse(
        instants,
        at,
        np.interp(at, trajectory.time_s, trajectory.temperature_degc),
        flying,
        own,
        white_response(trajectory, instants),
        trajectory.height_aid_m or 0.0,
        aligned,
        warmer,
    )


def white_response(trajectory: Trajectory, instants: Array) -> Array:
    """(m, 9, 2, 3 b) at instants (m,) s, per unit of noise of each sensor along each axis, SI per √Hz.

    Noise is the same along all axes: those are north, east and down here.
    """
    boxes = _boxes(trajectory)
    white = _propagated(trajectory, instants, _Boxes(trajectory, boxes)).reshape(len(instants), 9, 2, -1)
    return np.asarray(white * np.sqrt(boxes / (trajectory.time_s[-1] - trajectory.time_s[0])))


_Asked = tuple[ErrorName, float | None]
"""An error at the flight's own temperatures (None), or as it is at another all along."""


def _sorted(
    asked: Sequence[_Asked], hats: Array
) -> tuple[tuple[Flying, ...], Array, tuple[OverTemperature, ...]]:
    """What flies, its errors, and those over temperature, from all that was propagated (m, 9, columns, K)."""
    flying: list[Flying] = []
    own: list[Array] = []
    over: dict[ErrorName, tuple[slice, list[float], list[Array]]] = {}
    first = 0
    for error, degc in asked:
        terms = catalog.effects()[error.effect].terms(error.sensor)
        mine = hats[:, :, first : first + len(terms)]
        first += len(terms)
        if degc is None:
            over[error] = (slice(len(flying), len(flying) + len(terms)), [], [])
            flying += [Flying(error, term.name, term.channels[0]) for term in terms]
            own.append(mine)
        else:
            over[error][1].append(degc)
            over[error][2].append(mine)
    warmer = tuple(OverTemperature(p, np.array(t), np.stack(x, axis=3)) for p, t, x in over.values() if t)
    nothing = np.zeros((*hats.shape[:2], 0, hats.shape[3]))
    return tuple(flying), np.concatenate([nothing, *own], axis=2), warmer


def _nodes(trajectory: Trajectory, error: ErrorName, range_degc: tuple[float, float] | None) -> Array:
    """(N,) degC between which an error is straight over temperature; none if it does not change by itself."""
    known = catalog.effects()[error.effect]
    if range_degc is None or not catalog.changes_with_temperature(known):
        return np.empty(0)
    grid = steps_within(*range_degc, STEP_K)
    samples = len(trajectory.angle_increment)
    step = max(samples // PROBES, 1)
    rows = np.arange(step // 2, samples, step)
    some = conditions_of(trajectory, 0, samples).at(rows)
    x = np.array([known.regressors(error.sensor, _at(some, degc)) for degc in grid])
    share = ((grid[1:-1] - grid[:-2]) / (grid[2:] - grid[:-2]))[:, None, None, None]
    bent = np.abs(x[1:-1] - (1.0 - share) * x[:-2] - share * x[2:]).max(axis=(1, 2, 3), initial=0.0)
    bends = np.concatenate([[True], bent > STRAIGHT * np.abs(x).max(initial=0.0), [True]])
    return np.asarray(grid[bends])


def _at(conditions: Conditions, degc: float | None) -> Conditions:
    """The same at one temperature all along."""
    if degc is None:
        return conditions
    return replace(conditions, temperature_degc=np.full(len(conditions.day), degc))


def _tilts(trajectory: Trajectory, asked: Sequence[_Asked]) -> Array:
    """(3, F) φ per SI unit of every term of some errors: none for a gyro's."""
    begun, found = conditions_of(trajectory, 0, 1), []
    for e, degc in asked:
        x = catalog.effects()[e.effect].regressors(e.sensor, _at(begun, degc))[0]  # (3, t)
        found.append(initial_attitude.levelled(trajectory, x if e.sensor == "accelerometer" else 0.0 * x))
    return np.concatenate([np.zeros((3, 0)), *found], axis=1)


def _moments(trajectory: Trajectory, in_run_s: float) -> Array:
    t = trajectory.time_s
    lasts = float(t[-1] - t[0])
    warmed = float(np.abs(np.diff(trajectory.temperature_degc)).sum())
    for_drift = min(int(np.ceil(MOMENTS_IN_TIME * lasts / in_run_s)), MOST_FOR_DRIFT)
    count = max(int(np.ceil(lasts / MOMENT_S)), int(np.ceil(warmed / MOMENT_K)), for_drift, 1)
    return np.linspace(float(t[0]), float(t[-1]), count + 1)


def _boxes(trajectory: Trajectory) -> int:
    turned = float(np.linalg.norm(trajectory.angle_increment, axis=1).sum())
    samples = len(trajectory.angle_increment)
    return max(min(max(BOXES, int(np.ceil(turned / TURN))), MOST_BOXES, samples), 1)


def _instants(trajectory: Trajectory, requirements: Sequence[Requirement]) -> Array:
    end = float(trajectory.time_s[-1])
    wanted = {end, *(float(r.at) for r in requirements if not isinstance(r.at, str))}
    if any(r.at == "any" for r in requirements):
        wanted |= {float(t) for t in np.linspace(0.0, end, INSTANTS + 1)[1:]}
    return np.array(sorted(wanted))


def _propagated(trajectory: Trajectory, instants: Array, forcing: _Errors | _Boxes) -> Array:
    """(m, 9, p) at the instants."""
    found = errors_at(trajectory, forcing, forcing.active, forcing.count, instants.tolist())
    return np.concatenate([found.position, found.velocity, found.attitude], axis=1)


@dataclass(frozen=True)
class _Errors:
    """Forcing of every term at every moment, term by term: its regressors times the moment's hat."""

    trajectory: Trajectory
    moments: Array
    errors: Sequence[_Asked]

    @property
    def count(self) -> int:
        """All columns."""
        terms = sum(len(catalog.effects()[e.effect].terms(e.sensor)) for e, _ in self.errors)
        return len(self.moments) * terms

    def active(self, start: int, stop: int) -> Indices:
        """Columns of the moments about the samples start..stop, term by term."""
        K = len(self.moments)
        about = np.array(self._about(start, stop))
        return np.asarray((np.arange(self.count // K)[:, None] * K + about).ravel(), dtype=np.int64)

    def __call__(self, start: int, stop: int) -> tuple[list[Array], list[Array]]:
        """Active columns of the gyros and of the accelerometers over the samples start..stop."""
        conditions = conditions_of(self.trajectory, start, stop)
        unit = np.eye(len(self.moments))
        middle = _middles(self.trajectory, start, stop)
        hat = np.array([np.interp(middle, self.moments, unit[k]) for k in self._about(start, stop)]).T
        found: dict[str, list[Array]] = {sensor: [] for sensor in SENSORS}
        for e, degc in self.errors:
            x = catalog.effects()[e.effect].regressors(e.sensor, _at(conditions, degc))
            found[e.sensor].append((x[:, :, :, None] * hat[:, None, None, :]).reshape(len(x), 3, -1))
        return found["gyro"], found["accelerometer"]

    def _about(self, start: int, stop: int) -> range:
        """Moments whose hats the samples reach into."""
        ends = _middles(self.trajectory, start, stop)[[0, -1]]
        first = int(np.searchsorted(self.moments, ends[0], side="right")) - 1
        return range(first, min(int(np.searchsorted(self.moments, ends[1])), len(self.moments) - 1) + 1)


@dataclass(frozen=True)
class _Boxes:
    """Forcing of a sensor by one along north, east or down over one box of time."""

    trajectory: Trajectory
    boxes: int

    @property
    def count(self) -> int:
        """All columns: sensor by sensor, axis by axis."""
        return 2 * 3 * self.boxes

    def active(self, start: int, stop: int) -> Indices:
        """Columns of the boxes that the samples start..stop lie in."""
        return np.asarray(
            (np.arange(2 * 3)[:, None] * self.boxes + np.array(self._about(start, stop))).ravel(),
            dtype=np.int64,
        )

    def __call__(self, start: int, stop: int) -> tuple[list[Array], list[Array]]:
        """Active columns of the gyros and of the accelerometers over the samples start..stop."""
        boxes = np.array(self._about(start, stop))
        inside = (self._box(np.arange(start, stop))[:, None] == boxes).astype(float)
        to_body = np.swapaxes(self.trajectory.attitude[start:stop], 1, 2)  # channel, axis
        flat = (to_body[:, :, :, None] * inside[:, None, None, :]).reshape(stop - start, 3, -1)
        return [flat], [flat]

    def _about(self, start: int, stop: int) -> range:
        first, last = self._box(np.array([start, stop - 1])).tolist()
        return range(first, last + 1)

    def _box(self, samples: Indices) -> Indices:
        return (samples * self.boxes) // len(self.trajectory.angle_increment)


def _middles(trajectory: Trajectory, start: int, stop: int) -> Array:
    t = trajectory.time_s
    return np.asarray((t[start:stop] + t[start + 1 : stop + 1]) / 2.0)
