"""A hall with one table: every power-on holds six attitudes and turns, or a ramp of the chamber; plain NumPy.

Days go on within a power-on, as clocks do. Noise: white, a level and a scale factor of each power-on, and
what stays correlated within it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable

G, EARTH, LATITUDE = 9.80665, 7.292e-5, 0.85
FACES = [(axis, sign) for axis in range(3) for sign in (1.0, -1.0)]
RATES = (-180.0, -45.0, 45.0, 180.0)
QUICK = (-120.0, -40.0, 40.0, 120.0)  # deg/s: whole turns in 30 s, ten and three and a third


@dataclass(frozen=True)
class Hall:
    """Conditions of n records: deg/s, g, degC, K/min, s, days; up, north and turn (n, 3) in body axes."""

    run: Array
    day: Array
    time_on: Array
    temperature: Array
    ramp: Array
    up: Array
    north: Array
    turn: Array

    @property
    def rate(self) -> Array:
        """deg/s, the Earth's included; a turn averages its level part out."""
        earth = np.sin(LATITUDE) * self.up + np.cos(LATITUDE) * self.north * ~self.turns[:, None]
        return self.turn + np.degrees(EARTH) * earth

    @property
    def turns(self) -> Array:
        return np.asarray(np.linalg.norm(self.turn, axis=1) > 0.0)


@dataclass(frozen=True)
class Noise:
    """One sigma, deg/s or g: white, level and scale factor of a power-on; within: correlated over 100 s."""

    white: float
    level: float
    scale: float = 5e-6
    within: float = 0.0


GYRO, ACC = Noise(4e-4, 1e-3), Noise(5e-5, 6e-4)


@dataclass
class Log:
    rows: list[list[float]] = field(default_factory=list)
    run: int = 0
    day: float = 0.0
    t: float = 0.0

    def on(self, wait: float) -> None:
        self.run, self.t = self.run + 1, wait

    def record(
        self, axis: int, sign: float, temperature: float, ramp: float = 0.0, turn: float = 0.0
    ) -> None:
        up, north = sign * np.eye(3)[axis], np.eye(3)[(axis + 1) % 3]
        self.t += 30.0
        day = self.day + self.t / 86400.0
        self.rows.append([self.run, day, self.t, temperature, ramp, *up, *north, *(turn * np.eye(3)[axis])])
        self.t += 25.0

    def on_the_table(self, rng: np.random.Generator, degc: float) -> None:
        """Rests on six faces in any order, then every rate about each axis upright."""
        for i in rng.permutation(6):
            self.record(*FACES[i], degc)
        for axis in range(3):
            for turn in RATES:
                self.record(axis, 1.0, degc, turn=turn)

    def hall(self) -> Hall:
        x = np.array(self.rows)
        return Hall(x[:, 0].astype(int), *x[:, 1:5].T, x[:, 5:8], x[:, 8:11], x[:, 11:14])


def days(seed: int, power_ons: int = 36) -> Hall:
    """A power-on a day at one of five temperatures, rests first and turns after them."""
    rng, log = np.random.default_rng([seed, 1]), Log()
    for k in range(power_ons):
        log.on(rng.uniform(5.0, 20.0))
        degc = [-45.0, -15.0, 20.0, 40.0, 60.0][k if k < 5 else rng.integers(5)] + 0.3 * rng.normal()
        log.on_the_table(rng, degc)
        log.day += 1.0 + rng.uniform(-0.2, 0.2)
    return log.hall()


def axes_apart(seed: int, visits: int = 2, turns: tuple[float, ...] = (-300.0, -75.0, 75.0, 300.0)) -> Hall:
    """Three temperatures; rests and the turns about every axis have a power-on of their own at each."""
    rng, log = np.random.default_rng([seed, 2]), Log()
    for _ in range(visits):
        for degc in rng.permutation([-40.0, 20.0, 60.0]):
            log.on(rng.uniform(8.0, 50.0))
            for i in rng.permutation(6):
                log.record(*FACES[i], degc)
            log.day += 0.02
            for axis in range(3):
                log.on(rng.uniform(8.0, 50.0))
                for turn in turns:
                    log.record(axis, 1.0, degc, turn=turn)
                log.day += 0.05
            log.day += 0.5
    return log.hall()


def sweeps(seed: int, visits: int = 3) -> Hall:
    """Slow ramps up and down with the attitudes in turn, and soaks 16 K apart with turns."""
    rng, log = np.random.default_rng([seed, 3]), Log()
    speed = rng.uniform(0.6, 1.4)
    for _ in range(visits):
        for way in (1.0, -1.0):
            degc, k = (-48.0 if way > 0.0 else 62.0) + rng.uniform(-4.0, 4.0), 0
            while -53.0 < degc < 67.0:
                log.on(rng.uniform(8.0, 50.0))
                start, begins = degc, log.t
                for _ in range(6):
                    log.record(
                        *FACES[k % 6], start + way * speed * (log.t + 30.0 - begins) / 60.0, way * speed
                    )
                    k += 1
                degc = start + way * (speed * (log.t - begins) / 60.0 + 5.0)
                log.day += 0.02
        for degc in np.arange(-48.0, 66.0, 16.0):
            log.on(rng.uniform(8.0, 50.0))
            for i in rng.permutation(6):
                log.record(*FACES[i], degc)
            for axis in range(3):
                for turn in (-200.0, 200.0):
                    log.record(axis, 1.0, degc, turn=turn)
            log.day += 0.05
        log.day += 1.0
    return log.hall()


def short_ramps(seed: int, ramps: int = 3) -> Hall:
    """Few power-ons: soaks at four temperatures with turns, and ramps over all of them in twelve records."""
    rng, log = np.random.default_rng([seed, 4]), Log()
    for degc in rng.permutation([-40.0, -8.0, 25.0, 58.0]):
        log.on(rng.uniform(8.0, 50.0))
        log.on_the_table(rng, degc)
        log.day += 0.3
    for k in range(ramps):
        log.on(rng.uniform(8.0, 50.0))
        way, begins, speed = (1.0, -1.0)[k % 2], log.t, rng.uniform(7.0, 8.0)  # K/min
        for i in rng.integers(6, size=12):
            degc = (-42.0, 60.0)[k % 2] + way * speed * (log.t + 30.0 - begins) / 60.0
            log.record(*FACES[i], degc, way * speed)
        log.day += 0.4
    return log.hall()


def chamber(seed: int, power_ons: int = 7) -> Hall:
    """Every power-on goes up or down through four temperatures, with faces and turns at each."""
    rng, log = np.random.default_rng([seed, 7]), Log()
    for k in range(power_ons):
        log.on(rng.uniform(8.0, 50.0))
        for degc in [-42.0, -8.0, 25.0, 58.0][:: 1 if k % 2 == 0 else -1]:
            log.t += 1500.0
            at = degc + 0.3 * rng.normal()
            log.on_the_table(rng, at)
        log.day += 0.7
    return log.hall()


def tumbles(seed: int, visits: int = 3, azimuth: float = 0.4) -> Hall:
    """Three temperatures; a dividing head goes around each axis in eight to twelve steps; turns apart.

    azimuth: of the head's level axis, rad
    """
    rng, log = np.random.default_rng([seed, 6]), Log()
    steps = int(rng.integers(8, 13))
    for _ in range(visits):
        for degc in rng.permutation([-40.0, 20.0, 60.0]):
            for a in range(3):
                log.on(rng.uniform(8.0, 50.0))
                first = rng.integers(steps)
                for k in range(steps):
                    log.record(a, 1.0, degc)
                    angle = 2.0 * np.pi * (k + first) / steps
                    up = np.cos(angle) * np.eye(3)[(a + 1) % 3] + np.sin(angle) * np.eye(3)[(a + 2) % 3]
                    across = np.cross(np.eye(3)[a], up)
                    north = np.cos(azimuth) * np.eye(3)[a] + np.sin(azimuth) * across
                    log.rows[-1][5:11] = [*up, *north]
                log.day += 0.05
            for axis in range(3):
                log.on(rng.uniform(8.0, 50.0))
                for turn in RATES:
                    log.record(axis, 1.0, degc, turn=turn)
                log.day += 0.04
        log.day += 1.0
    return log.hall()


def anywhere(seed: int, visits: int = 3) -> Hall:
    """Four temperatures on a table of two axes: rests in any attitude, turns about any axis of the body."""
    rng, log = np.random.default_rng([seed, 8]), Log()
    for _ in range(visits):
        for degc in rng.permutation([-40.0, -5.0, 25.0, 60.0]):
            log.on(rng.uniform(8.0, 50.0))
            for k in range(26):
                log.record(0, 1.0, degc)
                up, other = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
                turn = RATES[k % 4] * up if k >= 10 else np.zeros(3)
                log.rows[-1][5:14] = [*up, *other, *turn]
            log.day += rng.uniform(0.1, 0.6)
    return log.hall()


def two_axes(seed: int, visits: int = 3) -> Hall:
    """Three temperatures; rests around two axes, turns about the upright and about level axes, mixed."""
    rng, log = np.random.default_rng([seed, 41]), Log()
    tilts = 2.0 * np.pi * rng.choice(12, size=5, replace=False) / 12.0
    for _ in range(visits):
        for degc in rng.permutation([-40.0, 10.0, 60.0]):
            log.on(rng.uniform(8.0, 50.0))
            for k in rng.permutation(34):
                if k < 10:
                    log.record(0, 1.0, degc)
                    c, s = np.cos(tilts[k % 5]), np.sin(tilts[k % 5])
                    log.rows[-1][5:11] = [0.0, s, c, 1.0, 0.0, 0.0] if k < 5 else [s, 0.0, c, 0.0, 1.0, 0.0]
                elif k < 22:
                    log.record(2, 1.0, degc, turn=QUICK[k % 4])
                else:
                    log.record(k % 3, 1.0, degc, turn=QUICK[k % 4])
                    log.rows[-1][5:11] = [0.0] * 6
            log.day += rng.uniform(0.2, 1.0)
    return log.hall()


def read(hall: Hall, seed: int, gyro: Noise = GYRO, acc: Noise = ACC, felt: Hall | None = None) -> DwellTable:
    """The table of one unit; felt: what it is exposed to where the references do not say it."""
    readings = []
    for k, noise in enumerate((gyro, acc)):
        rng, truth = np.random.default_rng([seed, 10 + k]), felt or hall
        u = truth.rate if k == 0 else truth.up
        x = truth.temperature / 60.0
        lean = np.eye(3) + np.radians(rng.uniform(-0.25, 0.25, (3, 3))) * (1.0 - np.eye(3))
        bias, scale = _curves(x, (0.01, 4e-3)[k], rng), _curves(x, 1e-3, rng)
        y = (1.0 + scale) * (u @ lean.T) + bias
        readings.append(y + _noise(hall, u, noise, rng))
    n = len(hall.run)
    return DwellTable(
        unit=np.full(n, "hall"), run=hall.run, day=hall.day, time_on=hall.time_on, duration=np.full(n, 30.0),
        temperature_degc=hall.temperature, temperature_rate=hall.ramp / 60.0,
        ref_rate=np.radians(hall.rate), ref_acc=G * hall.up,
        gyro=np.radians(readings[0]), acc=G * readings[1], source=f"hall {seed}",
    )  # fmt: skip


def hidden(table: DwellTable, sensor: str, axis: int, shape: Array) -> DwellTable:
    """The table with a shape (n,), deg/s or g, on one channel."""
    if sensor == "gyro":
        assert table.gyro is not None
        return replace(table, gyro=table.gyro + np.radians(shape)[:, None] * np.eye(3)[axis])
    assert table.acc is not None
    return replace(table, acc=table.acc + G * shape[:, None] * np.eye(3)[axis])


def wander(hall: Hall, seed: int, tau: float = 2000.0) -> Array:
    """(n,) a first-order Gauss-Markov process in every power-on, of one sigma."""
    rng, x = np.random.default_rng([seed, 31]), np.zeros(len(hall.run))
    for run in np.unique(hall.run):
        t = hall.time_on[hall.run == run]
        V = np.exp(-np.abs(t[:, None] - t) / tau) + 1e-9 * np.eye(len(t))
        x[hall.run == run] = np.linalg.cholesky(V) @ rng.normal(size=len(t))
    return x


def _curves(x: Array, size: float, rng: np.random.Generator) -> Array:
    """(n, 3) a cubic of each channel."""
    k = size * rng.normal(size=(4, 3)) * np.array([1.0, 0.7, 0.3, 0.15])[:, None]
    return np.asarray(sum(x[:, None] ** i * k[i] for i in range(4)))


def _noise(hall: Hall, u: Array, noise: Noise, rng: np.random.Generator) -> Array:
    which = np.unique(hall.run, return_inverse=True)[1]
    runs = which.max() + 1
    e = noise.white * rng.normal(size=u.shape) + noise.level * rng.normal(size=(runs, 3))[which]
    e += noise.scale * rng.normal(size=(runs, 3))[which] * u
    x = np.zeros(3)
    for i in range(len(u)):
        first = i == 0 or which[i] != which[i - 1]
        kept = 0.0 if first else np.exp(-(hall.time_on[i] - hall.time_on[i - 1]) / 100.0)
        x = kept * x + np.sqrt(1.0 - kept**2) * rng.normal(size=3)
        e[i] += noise.within * x
    return e
