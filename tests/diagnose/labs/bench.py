"""A bench of plain NumPy, no two alike: what records are exposed to, in deg/s, g, degC, K/min.

Shares nothing with the program's own simulator: no plan, no effect of the library, no strapdown.
Temperatures, repeats, attitudes, rates, loads, ramps and noise are drawn from the seed.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
G = 9.80665
EARTH_DPS = 15.041067 / 3600.0


@dataclass(frozen=True)
class Bench:
    """Conditions of n records as they truly are. place: `rate_table` or `centrifuge`

    up, north: (n, 3) unit vectors in body axes; turn: (n, 3) deg/s of the table or the arm
    load: (n, 3) g of the arm; came_up: (n,) whether the temperature was reached from below
    """

    run: NDArray[np.int64]
    day: Array
    time_on: Array
    duration: Array
    temperature: Array
    ramp: Array
    up: Array
    north: Array
    turn: Array
    load: Array
    place: NDArray[np.str_]
    came_up: NDArray[np.bool_]
    latitude: float

    def __len__(self) -> int:
        return len(self.run)

    @property
    def earth(self) -> Array:
        """(n, 3) the Earth's rate; its horizontal part averages out of a turn."""
        vertical = np.sin(self.latitude) * self.up
        still = ~self.turns[:, None]
        return EARTH_DPS * (vertical + np.where(still, np.cos(self.latitude) * self.north, 0.0))

    @property
    def turns(self) -> NDArray[np.bool_]:
        """(n,) whether the unit turns."""
        return np.asarray(np.linalg.norm(self.turn, axis=1) > 0.5)

    @property
    def rate(self) -> Array:
        """(n, 3) deg/s."""
        return self.turn + self.earth

    @property
    def force(self) -> Array:
        """(n, 3) g."""
        return self.up + self.load


@dataclass
class _Rows:
    latitude: float
    rows: list[tuple[float, ...]] = field(default_factory=list)
    run: int = 0

    def add(self, day: float, t: float, duration: float, T: float, ramp: float, up: Array, north: Array,
            turn: Array, load: Array, place: int, came_up: bool) -> None:  # fmt: skip
        self.rows.append(
            (self.run, day, t, duration, T, ramp, *up, *north, *turn, *load, place, float(came_up))
        )


ZERO = np.zeros(3)


def attitude(axis: int, sign: float, azimuth: float = 0.0, tilt: float = 0.0) -> tuple[Array, Array]:
    """(up, north) in body axes: an axis up or down, leaned by `tilt`, turned about up by `azimuth`, rad."""
    u, a, b = (np.roll(np.eye(3)[0], axis + k) for k in range(3))
    up = sign * (np.cos(tilt) * u) + np.sin(tilt) * b
    north = a - up * (up @ a)
    north = sign * north / np.linalg.norm(north)
    return up, np.cos(azimuth) * north + np.sin(azimuth) * np.cross(up, north)


def bench(seed: int, centrifuge: bool = True) -> Bench:
    """A campaign's records, power-on by power-on."""
    rng = np.random.default_rng([seed, 11])
    rows = _Rows(float(np.radians(rng.uniform(35.0, 65.0))))
    count = int(rng.integers(5, 8))
    points = np.sort(np.linspace(-55.0, 65.0, count) + rng.uniform(-6.0, 6.0, count))
    turned = float(rng.uniform(-np.pi, np.pi)) if rng.random() < 0.5 else 0.0
    repeats = int(rng.integers(3, 6))
    day = 0.0
    for visit in range(repeats):
        order = points if visit % 2 == 0 else points[::-1]
        for T in order:
            rows.run += 1
            _rests(rows, day + rng.uniform(0.0, 0.01), float(T), visit % 2 == 0, turned, rng)
            day += rng.uniform(0.15, 0.4)
        day += float(rng.choice([0.5, 3.0, 10.0]))
    for _ in range(int(rng.integers(2, 4))):
        for slope in (-1.0, 1.0):
            speed = slope * float(rng.choice([1.0, 2.0, 3.0]))
            for T in points[:: 2 if count > 5 else 1]:
                rows.run += 1
                _ramp(rows, day, float(T), speed, turned, rng)
                day += 0.1
    _turning(rows, day, points, rng)
    if centrifuge:
        _arm(rows, day + 3.0, rng)
    return _bench(np.array(rows.rows), rows.latitude, rng)


def _rests(rows: _Rows, day: float, T: float, rising: bool, turned: float, rng: np.random.Generator) -> None:
    t = rng.uniform(10.0, 40.0)
    ways = [(axis, sign, 0.0) for axis in range(3) for sign in (1.0, -1.0)]
    ways += [(int(rng.integers(3)), 1.0, float(rng.uniform(0.3, 1.0)))]
    for axis, sign, tilt in ways:
        up, north = attitude(axis, sign, turned, tilt)
        rows.add(day, t, 60.0, T, 0.0, up, north, ZERO, ZERO, 0, rising)
        t += rng.uniform(70.0, 240.0)


def _ramp(rows: _Rows, day: float, T: float, speed: float, turned: float, rng: np.random.Generator) -> None:
    t = rng.uniform(10.0, 40.0)
    first = t
    for axis in range(3):
        up, north = attitude(axis, float(rng.choice([1.0, -1.0])), turned)
        now = T + speed * (t - first) / 60.0
        rows.add(day, t, 60.0, now, speed, up, north, ZERO, ZERO, 0, speed > 0)
        t += 80.0


def _turning(rows: _Rows, day: float, points: Array, rng: np.random.Generator) -> None:
    rates = np.sort(rng.choice([5.0, 10.0, 20.0, 50.0, 100.0, 150.0, 200.0, 300.0, 400.0], 6, replace=False))
    for T in points[:: 2 if len(points) > 5 else 1]:
        for _ in range(int(rng.integers(2, 4))):
            for axis in range(3):
                rows.run += 1
                up, north = attitude(axis, 1.0)
                t = rng.uniform(15.0, 40.0)
                for size in rates:
                    for sign in (1.0, -1.0):
                        turn = sign * size * np.eye(3)[axis]
                        rows.add(day, t, 20.0, float(T), 0.0, up, north, turn, ZERO, 0, True)
                        t += rng.uniform(22.0, 40.0)
            day += 0.15


def _arm(rows: _Rows, day: float, rng: np.random.Generator) -> None:
    radius = float(rng.uniform(1.0, 4.0))
    loads = np.sort(rng.choice([2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0], 5, replace=False))
    for _ in range(int(rng.integers(3, 5))):
        for axis in range(3):
            for sign in (1.0, -1.0):
                rows.run += 1
                up, north = attitude((axis + 1) % 3, 1.0)
                t = rng.uniform(20.0, 50.0)
                for size in loads:
                    turn = np.degrees(np.sqrt(size * G / radius)) * up
                    rows.add(day, t, 20.0, 21.0, 0.0, up, north, turn, sign * size * np.eye(3)[axis], 1, True)
                    t += rng.uniform(30.0, 50.0)
        day += 0.2


def _came_up(a: Array) -> NDArray[np.bool_]:
    """(n,) whether a power-on's temperature was reached from below, room first; turns always are."""
    last, out, rising = 21.0, np.ones(len(a), dtype=bool), True
    for run in np.unique(a[:, 0]):
        mine = a[:, 0] == run
        first, ramp, end = a[mine, 4][0], a[mine, 5][0], a[mine, 4][-1]
        if abs(first - last) > 4.0:
            rising = first > last
        rising = ramp > 0 if ramp != 0 else rising
        out[mine] = True if np.any(a[mine, 12:15]) else rising
        last = end
    return out


def _bench(a: Array, latitude: float, rng: np.random.Generator) -> Bench:
    n = len(a)
    return Bench(
        run=a[:, 0].astype(np.int64),
        day=a[:, 1],
        time_on=a[:, 2],
        duration=a[:, 3],
        temperature=a[:, 4] + 0.05 * rng.normal(size=n),
        ramp=a[:, 5],
        up=a[:, 6:9],
        north=a[:, 9:12],
        turn=a[:, 12:15],
        load=a[:, 15:18],
        place=np.where(a[:, 18] > 0, "centrifuge", "rate_table"),
        came_up=_came_up(a),
        latitude=latitude,
    )
