"""Bench campaigns unlike the usual ones, from plain NumPy: other orders, temperatures, noises, references.

    y = (1 + κ(T))·(M u) + b(T) + u_run + s_run·u + e + hidden,   degrees, g, seconds and °C throughout

Nothing of the planner is used, and nothing of the other generator of the tests. `strength` is whitened: the
square root of the noncentrality of the hidden column beside the declared model, under the true covariance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
AXES = "xyz"
G = 9.80665
UP, NORTH = 0.00345, 0.00235  # deg/s of the Earth at 56° of latitude
ARM_M = 0.4


@dataclass(frozen=True)
class Bench:
    """What a campaign consists of. Noise: deg/s and g at a record of one second; runs: bias, scale factor."""

    temperatures: tuple[float, ...] = (-60, -40, -20, 0, 20, 40, 60)
    static_runs: int = 4
    late_days: tuple[float, ...] = (30.0, 60.0)
    ramp: float = 2.0  # °C/min, heating and cooling
    rates: tuple[float, ...] = (10, 50, 100, 300, 500)
    rate_temperatures: tuple[float, ...] = (-60, 0, 60)
    repeats: int = 3
    loads: tuple[float, ...] = (1, 5, 10, 25, 50)
    shuffled: bool = False
    record_s: float = 60.0
    noise: Mapping[str, float] | None = None
    run_bias: Mapping[str, float] | None = None
    run_scale: Mapping[str, float] | None = None
    turning_noise: float = 0.0  # of the rate, whichever axis turns
    outliers: float = 0.0  # share of the rows
    quantum: float = 0.0  # step of the gyros' numbers, deg/s


@dataclass(frozen=True)
class Hidden:
    """One effect on one channel (`gyro_x`); strength: whitened; at: τ in s or day of the step."""

    effect: str
    channel: str
    strength: float
    at: float = 300.0


@dataclass(frozen=True)
class Rows:
    """Conditions: run (n,), day, time_s, duration_s, degc, degc_min; rate (n, 3) deg/s; force (n, 3) g."""

    run: NDArray[np.int64]
    day: Array
    time_s: Array
    duration_s: Array
    degc: Array
    degc_min: Array
    rate: Array
    force: Array


@dataclass(frozen=True)
class Campaign:
    """rows, and the readings (n, 3) in deg/s and g."""

    rows: Rows
    gyro: Array
    acc: Array


def campaign(seed: int, bench: Bench, hidden: Sequence[Hidden] = ()) -> Campaign:
    """Measured rows with what is hidden in them."""
    rng = np.random.default_rng([seed, 2027])
    rows = conditions(bench, rng)
    readings = {"gyro": np.empty_like(rows.rate), "acc": np.empty_like(rows.rate)}
    for sensor, y in readings.items():
        u = rows.rate if sensor == "gyro" else rows.force
        big = 1.0 if sensor == "gyro" else 0.7
        M = np.eye(3) + np.radians(0.3) * rng.normal(size=(3, 3)) * (1.0 - np.eye(3))
        powers = np.vander(rows.degc / 60.0, 4, increasing=True)
        bias = powers @ (rng.normal(size=(4, 3)) * big * np.array([[0.01], [0.012], [0.003], [0.002]]))
        scale = powers @ (rng.normal(size=(4, 3)) * np.array([[2e-3], [2.5e-3], [8e-4], [4e-4]]))
        y[:] = (1.0 + scale) * (u @ M.T) + bias
        for axis in range(3):
            covariance = _noise(bench, sensor, rows, u[:, axis])
            y[:, axis] += covariance.draw(rng)
            for h in hidden:
                if h.channel == f"{sensor}_{AXES[axis]}":
                    column = effect_column(h, rows, sensor, axis, rng)
                    length = covariance.length(column, _declared(rows, u, axis))
                    y[:, axis] += h.strength / length * column
    far = rng.random(rows.rate.shape) < bench.outliers
    readings["gyro"] += far * 40.0 * _sizes(bench.noise, "gyro") / np.sqrt(bench.record_s)
    if bench.quantum:
        readings["gyro"] = np.round(readings["gyro"] / bench.quantum) * bench.quantum
    return Campaign(rows, readings["gyro"], readings["acc"])


# ---------------------------------------------------------------- what the bench does


def conditions(bench: Bench, rng: np.random.Generator) -> Rows:
    """Rests on six faces, rests while the chamber heats and cools, rates both ways, a centrifuge."""
    runs = [*_rests(bench, rng), *_turns(bench), *_loads(bench)]
    if bench.shuffled:
        days = rng.permutation(np.linspace(0.0, 70.0, len(runs)).round(2))
        runs = [[(days[i], *row[1:]) for row in run] for i, run in enumerate(runs)]
    number = np.repeat(np.arange(1, len(runs) + 1), [len(run) for run in runs])
    table = np.array([[*row[:5], *row[5], *row[6]] for run in runs for row in run], dtype=float)
    day, time_s, duration_s, degc, degc_min = table[:, :5].T
    degc = degc + 0.04 * rng.normal(size=len(degc))
    return Rows(number, day, time_s, duration_s, degc, degc_min, table[:, 5:8], table[:, 8:])


def _rests(bench: Bench, rng: np.random.Generator) -> list[list[tuple]]:
    runs = []
    for i, degc in enumerate(bench.temperatures):
        for k in range(bench.static_runs):
            late = k - (bench.static_runs - len(bench.late_days))
            day = 0.45 * i + 0.05 * k + (bench.late_days[late] if late >= 0 else 0.0)
            runs.append(_faces(bench, rng, day, degc, 0.0, 6))
        if bench.ramp:
            runs += [_faces(bench, rng, 0.45 * i + 0.3, degc, s * bench.ramp, 3) for s in (-1, 1, -1, 1)]
    return runs


def _faces(
    bench: Bench, rng: np.random.Generator, day: float, degc: float, slope: float, count: int
) -> list[tuple]:
    faces = [(j, s) for s in (1, -1) for j in range(3)][:count]
    if bench.shuffled:
        faces = [faces[k] for k in rng.permutation(count)]
    times = 10.0 + np.cumsum([0.0, *rng.uniform(70.0, 220.0, count - 1)])
    run = []
    for (j, s), t in zip(faces, times, strict=True):
        up = s * np.eye(3)[j]
        earth = UP * up + NORTH * np.eye(3)[(j + 1) % 3]
        run.append((day, t, bench.record_s, degc, slope, earth, up))
    return run


def _turns(bench: Bench) -> list[list[tuple]]:
    runs = []
    for i, degc in enumerate(bench.rate_temperatures if bench.rates else ()):
        for k in range(bench.repeats):
            for e in np.eye(3):
                signed = [s * r for r in bench.rates for s in (1, -1)]
                run = [(4.0 + 0.3 * i + 0.1 * k, 20.0 + 25.0 * n, 20.0, degc, 0.0, (w + UP) * e, e)
                       for n, w in enumerate(signed)]  # fmt: skip
                runs.append(run)
    return runs


def _loads(bench: Bench) -> list[list[tuple]]:
    runs = []
    middle = bench.temperatures[len(bench.temperatures) // 2]
    for k in range(bench.repeats if bench.loads else 0):
        for j, s in [(j, s) for j in range(3) for s in (1, -1)]:
            out, up = s * np.eye(3)[j], np.eye(3)[(j + 1) % 3]
            run = []
            for n, a in enumerate(bench.loads):
                w = np.degrees(np.sqrt(a * G / ARM_M)) + UP
                run.append((6.0 + 0.1 * k, 30.0 + 40.0 * n, 20.0, middle, 0.0, w * up, a * out + up))
            runs.append(run)
    return runs


# ---------------------------------------------------------------- what hides


def effect_column(h: Hidden, rows: Rows, sensor: str, axis: int, rng: np.random.Generator) -> Array:
    """(n,) what one unit of an effect adds to the channel; names from outside the library as well."""
    u = (rows.rate if sensor == "gyro" else rows.force)[:, axis]
    f, t = rows.force, rows.time_s
    size = np.linalg.norm(f, axis=1)
    along = np.argmax(np.abs(f), axis=1)
    face = 2 * along + (f[np.arange(len(f)), along] > 0)
    made = {
        "g_sensitivity": lambda: f @ rng.uniform(0.3, 1.0, 3),
        "g_squared_sensitivity": lambda: f[:, axis] ** 2,
        "scale_factor_nonlinearity": lambda: u**3,
        "scale_factor_asymmetry": lambda: np.abs(u),
        "temperature_rate": lambda: rows.degc_min,
        "warm_up": lambda: np.exp(-t / h.at),
        "ageing": lambda: rows.day,
        "bias_step": lambda: (rows.day >= h.at).astype(float),
        "per face": lambda: np.where(size < 1.3, rng.normal(size=6)[face], 0.0),
        "log of time": lambda: np.log1p(t / 15.0),
        "fourth power of load": lambda: f[:, axis] ** 4,
    }
    return np.asarray(made[h.effect](), dtype=float)


def _declared(rows: Rows, u: Array, axis: int) -> Array:
    powers = np.vander(rows.degc / 60.0, 4, increasing=True)
    others = [u[:, j] for j in range(3) if j != axis]
    return np.column_stack([powers, powers * u[:, [axis]], *others])


# ---------------------------------------------------------------- noise


@dataclass(frozen=True)
class _Noise:
    """starts: first row of each run; white (n,); bias, scale: run-to-run; u (n,): the channel's input."""

    starts: NDArray[np.int64]
    white: Array
    bias: float
    scale: float
    u: Array

    def draw(self, rng: np.random.Generator) -> Array:
        """(n,) one drawing."""
        sizes = np.diff(np.append(self.starts, len(self.u)))
        run = np.repeat(rng.normal(size=(2, len(sizes))), sizes, axis=1)
        return self.white * rng.normal(size=len(self.u)) + self.bias * run[0] + self.scale * run[1] * self.u

    def length(self, column: Array, declared: Array) -> float:
        """Length of a column clear of others, both whitened."""
        white = np.column_stack([column, declared])
        for part in np.split(np.arange(len(column)), self.starts[1:]):
            block = (
                np.diag(self.white[part] ** 2) + self.bias**2 + self.scale**2 * np.outer(*[self.u[part]] * 2)
            )
            white[part] = np.linalg.solve(np.linalg.cholesky(block), white[part])
        Q = np.linalg.qr(white[:, 1:] / np.linalg.norm(white[:, 1:], axis=0))[0]
        return float(np.linalg.norm(white[:, 0] - Q @ (Q.T @ white[:, 0])))


def _noise(bench: Bench, sensor: str, rows: Rows, u: Array) -> _Noise:
    turning = bench.turning_noise * np.abs(rows.rate).max(axis=1) * (sensor == "gyro")
    white = np.hypot(_sizes(bench.noise, sensor) / np.sqrt(rows.duration_s), turning)
    starts = np.flatnonzero(np.diff(rows.run, prepend=0))
    bias = (bench.run_bias or {"gyro": 2e-3, "acc": 9e-4})[sensor]
    scale = (bench.run_scale or {"gyro": 2.5e-5, "acc": 0.0})[sensor]
    return _Noise(starts, white, bias, scale, u)


def _sizes(noise: Mapping[str, float] | None, sensor: str) -> float:
    return (noise or {"gyro": 1e-2, "acc": 4.8e-4})[sensor]
