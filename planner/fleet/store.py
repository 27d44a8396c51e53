"""What a recalibration in store can renew, and how well: faces on a levelled surface, turns by hand.

Records k of one power-on, averaged over n power-ons:

    y_k = X_k (β + b̄) + Z_k γ + ε_k,    b̄ ~ N(0, D/n),   ε ~ N(0, σ²/(n T)),   γ ~ N(0, Γ)

X are the regressors of the effects, γ what stays the same in all power-ons because nobody knows it better:
the Earth's rate in the room (its direction is not known), the tilt of the surface, the squareness of each
face, and the angle and the axis of each turn. With V = Z Γ Zᵀ + X D Xᵀ/n + σ²/(nT)

    cov β̂ = (S⁻² + Xᵀ V⁻¹ X)⁻¹        S: the whole budget of each error, so that what is not seen stays at S

(K 2.7: six orientations, one turn of 360° per axis each way, 1 to 15 min at rest.) Rests and turns are
repeated by themselves; nothing here changes the temperature, so temperature terms are never renewed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner import catalog
from planner.fleet.allowed_region import AllowedRegion
from planner.nouns.allowances import ErrorModel
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.sensor import ErrorName
from planner.physics.earth import EARTH_RATE_RADPS
from planner.plan.confidence import spread_at
from planner.protocols import SENSORS, Sensor
from planner.simulate.campaign import Settings
from planner.spec.recalibration import Recalibration
from planner.units import STANDARD_GRAVITY_MPS2

ROOM_DEGC = 20.0
TURN = 2 * np.pi


@dataclass(frozen=True)
class StoreRecords:
    """The records of one power-on. conditions: (k,); duration: (k,) s; turning: (k,) flags.

    unknown: sensor -> (k, 3, q) Z times the root of Γ: what one sigma of every unknown adds
    """

    conditions: Conditions
    duration: Array
    turning: Array
    unknown: Mapping[Sensor, Array]


@dataclass(frozen=True)
class Visit:
    """One recalibration: power-ons in which the faces rest, power-ons with turns; seconds in all."""

    rests: int
    turns: int
    time_s: float


def visits(asked: Recalibration, numbers: Sequence[int] | None = None) -> tuple[Visit, ...]:
    """Every visit that the spec allows, the shortest first; rests and turns share power-ons."""
    n = list(range(asked.repeats + 1)) if numbers is None else list(numbers)
    every = [Visit(r, t, visit_time(asked, r, t)) for r in n for t in n if r + t > 0]
    return tuple(sorted(every, key=lambda v: (v.time_s, v.rests, v.turns)))


def visit_time(asked: Recalibration, rests: int, turns: int) -> float:
    """Seconds of a visit: set up, then for every power-on its rests, its turns and its cool-down."""
    faces = 6 * asked.headings * (asked.rest + asked.move)
    spins = 6 * (asked.turns * asked.turn + asked.move)
    powered = max(rests, turns) * (asked.power_on + asked.cool_down)
    return asked.set_up + powered + rests * faces + turns * spins


def attitudes() -> Array:
    """(6, 3, 3) room-to-body rotations that put +x, −x, +y, −y, +z, −z up."""
    found = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            up = sign * np.eye(3)[axis]
            east = np.eye(3)[(axis + 1) % 3]
            found.append(np.stack([east, np.cross(up, east), up], axis=1))
    return np.array(found)


def store_records(asked: Recalibration) -> StoreRecords:
    """The records of one power-on with rests and turns."""
    half = np.diag([-1.0, -1.0, 1.0])  # half a turn about the vertical
    faces = attitudes()
    rests = np.concatenate([faces @ np.linalg.matrix_power(half, h) for h in range(asked.headings)])
    rate = TURN / asked.turn
    spin = np.array([s * rate * np.eye(3)[a] for a in range(3) for s in (1.0, -1.0)])
    up = rests[:, :, 2]
    own = np.array([np.eye(3)[a] for a in range(3) for _ in range(2)])
    k = len(rests) + len(spin)
    conditions = Conditions(
        rate=np.concatenate([np.zeros_like(up), spin]),
        specific_force=STANDARD_GRAVITY_MPS2 * np.concatenate([up, own]),
        temperature_degc=np.full(k, ROOM_DEGC),
        temperature_rate=np.zeros(k),
        time_on=np.full(k, asked.power_on),
        day=np.zeros(k),
    )
    turning = np.concatenate([np.zeros(len(rests)), np.ones(len(spin))])
    duration = np.where(turning > 0, asked.turns * asked.turn, asked.rest)
    unknown: dict[Sensor, Array] = {
        "gyro": _gyro(asked, rests, spin),
        "accelerometer": _acc(asked, rests, len(spin)),
    }
    return StoreRecords(conditions, duration, turning, unknown)


def _gyro(asked: Recalibration, rests: Array, spin: Array) -> Array:
    """(k, 3, q) the Earth's rate in the room (3), angle (1) and axis (2) of each turn."""
    k, turns = len(rests) + len(spin), len(spin)
    Z = np.zeros((k, 3, 3 + 3 * turns))
    Z[: len(rests), :, :3] = EARTH_RATE_RADPS * rests
    for i, w in enumerate(spin):
        axis, row = int(np.argmax(np.abs(w))), len(rests) + i
        Z[row, axis, 2] = EARTH_RATE_RADPS  # over whole turns the horizontal part cancels
        Z[row, axis, 3 + 3 * i] = asked.angle_error / (asked.turns * asked.turn)
        for j in (1, 2):
            Z[row, (axis + j) % 3, 3 + 3 * i + j] = asked.level * np.abs(w[axis])
    return Z


def _acc(asked: Recalibration, rests: Array, turns: int) -> Array:
    """(k, 3, q) tilt of the surface (2), squareness of every face (2 each); turns tell nothing."""
    k, faces = len(rests) + turns, 6
    Z = np.zeros((k, 3, 2 + 2 * faces))
    tilt = STANDARD_GRAVITY_MPS2 * asked.level
    base = rests[:faces]
    for i, C in enumerate(rests):
        Z[i, :, :2] = tilt * C[:, :2]
        face = 2 + 2 * (i % faces)
        Z[i, :, face : face + 2] = tilt * base[i % faces][:, :2]
    return Z


class StoreBench:
    """The store as a bench: what is left of every term after a visit, worked out once for each visit."""

    def __init__(self, asked: Recalibration, models: Sequence[ErrorModel], region: AllowedRegion) -> None:
        self.asked, self.region = asked, region
        self.records = store_records(asked)
        self._sensors = [_Sensor(s, models, self.records) for s in SENSORS]
        self._known: dict[tuple[int, int], Array] = {}

    @cached_property
    def every(self) -> tuple[Visit, ...]:
        """Every visit that the spec allows, the shortest first."""
        return visits(self.asked)

    def left(self, rests: int, turns: int) -> Array:
        """(t,) one sigma of every term after so many power-ons with rests and turns; infinite if unseen."""
        if (rests, turns) not in self._known:
            sigma = np.full(len(self.region.terms), np.inf)
            for sensor in self._sensors:
                for name, value in sensor.left(rests, turns).items():
                    place = self.region.index(*name)
                    if place is not None:
                        sigma[place] = value
            self._known[rests, turns] = sigma
        return self._known[rests, turns]


def sensor_left(
    asked: Recalibration, models: Sequence[ErrorModel], repeats: int
) -> dict[tuple[str, str], float]:
    """(error, term) -> one sigma that so many power-ons with rests and turns leave, SI."""
    records = store_records(asked)
    left: dict[tuple[str, str], float] = {}
    for sensor in SENSORS:
        left |= _Sensor(sensor, models, records).left(repeats, repeats)
    return left


@dataclass(frozen=True)
class _Sensor:
    """One sensor's records and models."""

    sensor: Sensor
    models: Sequence[ErrorModel]
    records: StoreRecords

    def left(self, rests: int, turns: int) -> dict[tuple[str, str], float]:
        """(error, term) -> one sigma that is left; terms that the records do not see are missing."""
        names, X, spread, whole = self._columns
        turning = self.records.turning > 0
        times = np.where(turning, turns, rests)
        if (
            self.sensor == "accelerometer"
        ):  # by hand the unit is not at rest on the axis, so turns tell nothing
            times = np.where(turning, 0, times)
        used = times > 0
        if not names or not used.any():
            return {}
        n = np.repeat(times[used], 3).astype(float)
        rows = X[used].reshape(-1, len(names))
        Z = self.records.unknown[self.sensor][used].reshape(len(rows), -1)
        white = Settings().white[self.sensor] ** 2 / np.repeat(self.records.duration[used], 3)
        V = Z @ Z.T + np.diag(white / n + 1e-30)
        for part in (turning, ~turning):  # each kind of record has power-ons of its own
            own = np.repeat(part[used], 3)
            if own.any():
                here = np.where(own[:, None], rows, 0.0) * spread
                V += here @ here.T / n[own][0]
        information = rows.T @ np.linalg.solve(V, rows) * np.outer(whole, whole)
        posterior = np.linalg.inv(np.eye(len(names)) + information)
        share = np.sqrt(np.diag(posterior))
        return {name: float(share[i] * whole[i]) for i, name in enumerate(names) if share[i] < 1 - 1e-6}

    @cached_property
    def _columns(self) -> tuple[list[tuple[str, str]], Array, Array, Array]:
        """Names, regressors (k, 3, p), run-to-run with in-run (p,), whole size (p,) of every term."""
        names: list[tuple[str, str]] = []
        parts, spread, whole = [], [], []
        for m in self.models:
            sensor, effect = ErrorName(m.name).parts
            if sensor != self.sensor:
                continue
            one = catalog.effects()[effect]
            X = one.regressors(self.sensor, self.records.conditions)
            sigma = float(np.hypot(spread_at(m, [ROOM_DEGC])[0], m.in_run))
            size = max(m.whole_variation, m.storage, sigma, 1e-12)
            for i, term in enumerate(one.terms(self.sensor)):
                names.append((m.name, term.name))
                parts.append(X[:, :, i])
                spread.append(sigma)
                whole.append(size)
        columns = np.stack(parts, axis=2) if parts else np.zeros((len(self.records.duration), 3, 0))
        return names, columns, np.array(spread), np.array(whole)
