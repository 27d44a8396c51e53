"""A bench campaign from plain NumPy: the estimator's world, made without the estimator's own effects.

The design follows how inertial units are calibrated: static runs in six attitudes at several temperatures,
on several days, records at rest while the chamber ramps, rates about each axis, a centrifuge. Degrees per
second and g inside, as on the bench; the table that comes out is SI.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from planner.nouns.dwell_table import DwellTable

Array = NDArray[np.float64]
G = 9.80665
EARTH_DPS = 15.041067 / 3600.0
LATITUDE = np.radians(55.75)
TEMPERATURES = (-60.0, -40.0, -20.0, 0.0, 20.0, 40.0, 60.0)
RATES = (10.0, 50.0, 100.0, 300.0, 500.0)
LOADS = (1.0, 5.0, 10.0, 25.0, 50.0)
ARM_M = 0.4


@dataclass(frozen=True)
class Layout:
    """What the bench does. later: days after the first campaign on which the statics come again."""

    temperatures: tuple[float, ...] = TEMPERATURES
    static_repeats: int = 3
    later: tuple[float, ...] = (30.0, 60.0)
    ramps: bool = True
    rate_repeats: int = 3
    rate_temperatures: tuple[float, ...] = (-60.0, -20.0, 0.0, 20.0, 60.0)
    centrifuge: bool = True


@dataclass(frozen=True)
class Noise:
    """Sizes of one sigma, gyro in deg/s and accelerometer in g; per root of a 60 s record.

    rate: share of the input by which a reading strays (thermometer, table); scale_run: from run to run
    kind: `normal`, `student` (4 degrees of freedom), `grows` (five times the rate), `correlated` (in a run)
    """

    gyro: float = 1.1e-3
    acc: float = 5e-5
    gyro_run: float = 2e-3
    acc_run: float = 8e-4
    scale_run: float = 1e-5
    rate: float = 1.5e-5
    kind: str = "normal"
    outliers: float = 0.0
    thermometer: float = 0.0


@dataclass
class Bench:
    """The conditions of every row, bench units: rates deg/s, loads g, temperatures degC, K/min."""

    run: NDArray[np.int64]
    day: Array
    time_on: Array
    duration: Array
    temperature: Array
    ramp: Array
    rate: Array
    force: Array
    earth: Array
    load: Array  # (n,) g of a centrifuge, 0 elsewhere
    radial: NDArray[np.int64]  # (n,) body axis that points along the arm, -1 elsewhere
    spin: NDArray[np.int64]  # (n,) body axis of the bench's rotation, -1 at rest


@dataclass
class _Rows:
    rows: list[tuple[float, ...]] = field(default_factory=list)
    run: int = 0

    def add(self, day: float, t: float, duration: float, T: float, ramp: float, rate: Array, force: Array,
            earth: Array, load: float = 0.0, radial: int = -1, spin: int = -1) -> None:  # fmt: skip
        self.rows.append((self.run, day, t, duration, T, ramp, *rate, *force, *earth, load, radial, spin))


def _attitude(axis: int, sign: float) -> tuple[Array, Array]:
    """(force, earth): the body axis up or down, the next axis north."""
    force, earth = np.zeros(3), np.zeros(3)
    force[axis] = sign
    earth[axis] = sign * EARTH_DPS * np.sin(LATITUDE)
    earth[(axis + 1) % 3] = EARTH_DPS * np.cos(LATITUDE)
    return force, earth


def bench(layout: Layout, rng: np.random.Generator) -> Bench:
    """Every record of the campaign, power-on by power-on."""
    rows = _Rows()
    for k, T in enumerate(layout.temperatures):
        for day in [0.05 * r for r in range(layout.static_repeats)] + list(layout.later):
            rows.run += 1
            t = 10.0
            for axis in range(3):
                for sign in (1.0, -1.0):
                    force, earth = _attitude(axis, sign)
                    rows.add(0.5 * k + day, t, 60.0, T, 0.0, np.zeros(3), force, earth)
                    t += rng.uniform(75.0, 250.0)
        for sign in (-1.0, 1.0) if layout.ramps else ():
            for repeat in range(2):
                rows.run += 1
                for axis in range(3):
                    force, earth = _attitude(axis, 1.0)
                    start = 10.0 + 70.0 * axis
                    rows.add(0.5 * k + 0.3 + 0.02 * repeat, start, 60.0, T, 2.0 * sign,
                             np.zeros(3), force, earth)  # fmt: skip
    day = 4.0
    for T in layout.rate_temperatures:
        for _ in range(layout.rate_repeats):
            for axis in range(3):
                rows.run += 1
                _rates(rows, day, T, axis)
            day += 0.1
    for repeat in range(3 if layout.centrifuge else 0):
        for axis in range(3):
            for sign in (1.0, -1.0):
                rows.run += 1
                _spin(rows, 6.0 + 0.1 * repeat, axis, sign)
    return _bench(np.array(rows.rows), rng)


def _rates(rows: _Rows, day: float, T: float, axis: int) -> None:
    force, earth = _attitude(axis, 1.0)
    vertical = np.where(np.arange(3) == axis, earth, 0.0)  # the horizontal part averages out over the turns
    t = 20.0
    for size in RATES:
        for sign in (1.0, -1.0):
            rate = np.zeros(3)
            rate[axis] = sign * size
            rows.add(day, t, 20.0, T, 0.0, rate, force, vertical, spin=axis)
            t += 25.0


def _spin(rows: _Rows, day: float, axis: int, sign: float) -> None:
    up = (axis + 1) % 3
    t = 30.0
    for load in LOADS:
        force, rate, earth = np.zeros(3), np.zeros(3), np.zeros(3)
        force[axis], force[up] = sign * load, 1.0
        rate[up] = np.degrees(np.sqrt(load * G / ARM_M))
        earth[up] = EARTH_DPS * np.sin(LATITUDE)
        rows.add(day, t, 20.0, 20.0, 0.0, rate, force, earth, load, axis, up)
        t += 40.0


def _bench(a: Array, rng: np.random.Generator) -> Bench:
    n = len(a)
    return Bench(
        run=a[:, 0].astype(np.int64),
        day=a[:, 1],
        time_on=a[:, 2],
        duration=a[:, 3],
        temperature=a[:, 4] + 0.05 * rng.normal(size=n),
        ramp=a[:, 5] + 0.01 * rng.normal(size=n),
        rate=a[:, 6:9] + a[:, 12:15],
        force=a[:, 9:12],
        earth=a[:, 12:15],
        load=a[:, 15],
        radial=a[:, 16].astype(np.int64),
        spin=a[:, 17].astype(np.int64),
    )


# ---------------------------------------------------------------- what hides


@dataclass(frozen=True)
class Hidden:
    """An effect that the declared model lacks.

    effect: a name of the interfaces or `unknown_…`; channel: `gyro_x` …; size: in the unit of `SHAPES`
    """

    effect: str
    channel: str
    size: float = 1.0
    tau_s: float = 600.0
    step_day: float = 20.0
    direction: tuple[float, float, float] = (1.0, -0.4, 0.3)


Shape = Callable[[Bench, Hidden, int, Array], Array]


def _bent(b: Bench, u: Array, channel: int) -> Array:
    """What the tilt of the arm's end by 1 deg at 50 g, about the tangent, adds to one channel."""
    out = np.zeros(len(u))
    for i in np.flatnonzero(b.radial >= 0):
        axis = np.zeros(3)
        axis[3 - b.radial[i] - b.spin[i]] = 1.0
        out[i] = np.cross(np.radians(b.load[i] / 50.0) * axis, u[i])[channel]
    return out


K_NODES = np.array([-60.0, -20.0, 0.0, 20.0, 40.0, 60.0])
K_FALLING = np.array([3.0, 2.0, -1.0, 1.0, -2.0, -3.0])  # 0.001 deg/s on top of the steady bias, K table 2.11
K_RISING = np.array([-4.0, -1.0, -2.0, 0.0, 1.0, 2.0])


def _k_table(b: Bench) -> Array:
    """K's table 2.11 over temperature and its rate, 0.001 deg/s per unit of size."""
    sides = [np.interp(b.temperature, K_NODES, side) for side in (K_FALLING, K_RISING)]
    return np.asarray(np.where(b.ramp < 0.0, *sides) * np.abs(b.ramp) / 2.0)


# name -> addition to the channel's reading per unit of size; u: (n, 3) what the sensor senses
SHAPES: dict[str, Shape] = {
    "g_sensitivity": lambda b, h, c, u: b.force @ np.array(h.direction),  # deg/s per g
    "g_squared_sensitivity": lambda b, h, c, u: b.force[:, c] ** 2,
    "scale_factor_nonlinearity": lambda b, h, c, u: 5.0 * (u[:, c] / 500.0) ** 3,  # % at 500 deg/s
    "scale_factor_asymmetry": lambda b, h, c, u: 0.005 * np.abs(u[:, c]),  # % between + and -
    "scale_factor_acceleration": lambda b, h, c, u: 0.01 * u[:, c] * np.linalg.norm(b.force, axis=1) / 50.0,
    "temperature_rate": lambda b, h, c, u: b.ramp,
    "temperature_rate_table": lambda b, h, c, u: _k_table(b),
    "warm_up": lambda b, h, c, u: np.exp(-b.time_on / h.tau_s),
    "ageing": lambda b, h, c, u: b.day,
    "bias_step": lambda b, h, c, u: (b.day >= h.step_day).astype(float),
    "arm_bending": lambda b, h, c, u: _bent(b, u, c),  # deg at 50 g
    "misalignment_temperature": lambda b, h, c, u: (
        np.radians((b.temperature - 20.0) / 120.0) * u[:, (c + 1) % 3]
    ),
    "earth_rate": lambda b, h, c, u: np.zeros(len(u)),  # taken from the reference instead
    "unknown_day": lambda b, h, c, u: np.sin(2.0 * np.pi * b.day / 1.1),
    "unknown_time_on": lambda b, h, c, u: np.sin(2.0 * np.pi * b.time_on / 330.0),
    "unknown_temperature_rate": lambda b, h, c, u: np.abs(b.ramp),
    "unknown_rate": lambda b, h, c, u: np.exp(-np.abs(u[:, c]) / 40.0) * (np.abs(u[:, c]) > 1.0),
    "unknown_orientation": lambda b, h, c, u: (b.force[:, 0] > 0.5) * (b.force[:, 0] < 1.5) * 1.0,
}


def contribution(b: Bench, h: Hidden) -> Array:
    """(n,) what the hidden effect adds to its channel's reading, deg/s or g, per unit of size."""
    sensor, axis = h.channel.split("_")
    return SHAPES[h.effect](b, h, "xyz".index(axis), b.rate if sensor == "gyro" else b.force)


# ---------------------------------------------------------------- the unit and its readings


def campaign(
    seed: int,
    hidden: Sequence[Hidden] = (),
    layout: Layout | None = None,
    noise: Noise | None = None,
) -> DwellTable:
    """The dwell table of one unit; the same seed and layout give the same unit whatever hides in it."""
    layout, noise = layout or Layout(), noise or Noise()
    b = bench(layout, np.random.default_rng([seed, 1]))
    gyro = _readings(b, b.rate, "gyro", hidden, noise, np.random.default_rng([seed, 2]))
    acc = _readings(b, b.force, "acc", hidden, noise, np.random.default_rng([seed, 3]))
    missing = any(h.effect == "earth_rate" for h in hidden)
    shown = b.temperature + noise.thermometer * np.random.default_rng([seed, 4]).normal(size=len(b.day))
    n = len(b.day)
    return DwellTable(
        unit=np.full(n, "u1"),
        run=b.run,
        day=b.day,
        time_on=b.time_on,
        duration=b.duration,
        temperature_degc=shown,
        temperature_rate=b.ramp / 60.0,
        ref_rate=np.radians(b.rate - b.earth if missing else b.rate),
        ref_acc=b.force * G,
        gyro=np.radians(gyro),
        acc=acc * G,
        source=f"world {seed}",
    )


def _readings(
    b: Bench, u: Array, sensor: str, hidden: Sequence[Hidden], noise: Noise, rng: np.random.Generator
) -> Array:
    """y = (1 + κ)(M u) + b + noise, and what hides."""
    gyro = sensor == "gyro"
    x = b.temperature / 60.0
    bias, kappa = (
        _curve(x, rng, 0.03 if gyro else 0.01),
        _curve(x, rng, 0.002 if gyro else 1e-3),
    )
    lean = np.eye(3) + np.radians(rng.uniform(-0.3, 0.3, (3, 3))) * (1.0 - np.eye(3))
    groups = np.unique(b.run, return_inverse=True)[1]
    runs = groups.max() + 1
    bias = bias + (noise.gyro_run if gyro else noise.acc_run) * rng.normal(size=(runs, 3))[groups]
    kappa = kappa + noise.scale_run * rng.normal(size=(runs, 3))[groups]
    y = (1.0 + kappa) * (u @ lean.T) + bias + _noise(b, u, noise, noise.gyro if gyro else noise.acc, rng)
    for h in hidden:
        name, axis = h.channel.split("_")
        if name == sensor:
            y[:, "xyz".index(axis)] += h.size * contribution(b, h)
    return np.asarray(y)


def _curve(x: Array, rng: np.random.Generator, size: float) -> Array:
    """(n, 3) smooth over temperature, x = T/60: constant, slope, bend and a wave."""
    c = size * rng.uniform(-1.0, 1.0, (4, 3))
    wave = np.sin(2.0 * x[:, None] + rng.uniform(0, 6, 3))
    return np.asarray(c[0] + c[1] * x[:, None] + 0.5 * c[2] * x[:, None] ** 2 + 0.3 * c[3] * wave)


def _scale(b: Bench, u: Array, noise: Noise, size: float) -> Array:
    """(n, 3) one sigma of every reading."""
    white = size * np.sqrt(60.0 / b.duration)[:, None]
    share = noise.rate * (5.0 if noise.kind == "grows" else 1.0)
    return np.asarray(np.sqrt(white**2 + (share * u) ** 2))


def _noise(b: Bench, u: Array, noise: Noise, size: float, rng: np.random.Generator) -> Array:
    n = len(b.day)
    e = rng.normal(size=(n, 3))
    if noise.kind == "student":
        e = rng.standard_t(4, size=(n, 3)) / np.sqrt(2.0)
    if noise.kind == "correlated":
        for i in range(1, n):
            if b.run[i] == b.run[i - 1]:
                rho = np.exp(-abs(b.time_on[i] - b.time_on[i - 1]) / 200.0)
                e[i] = rho * e[i - 1] + np.sqrt(1.0 - rho**2) * e[i]
    e = e * (scale := _scale(b, u, noise, size))
    struck = rng.uniform(size=e.shape) < noise.outliers
    return np.asarray(e + struck * 40.0 * scale * rng.choice([-1.0, 1.0], size=e.shape))


# ---------------------------------------------------------------- how strong it is


def sized(h: Hidden, t: float, seed: int, layout: Layout | None = None, noise: Noise | None = None) -> Hidden:
    """The hidden effect at whitened strength t = √(gᵀ Q g), Q clear of the declared model.

    Noise as it truly is (run-to-run bias and scale factor, white), declared model: bias and scale factor at
    every temperature of the layout, misalignments.
    """
    layout, noise = layout or Layout(), noise or Noise()
    b = bench(layout, np.random.default_rng([seed, 1]))
    sensor, axis = h.channel.split("_")
    u = b.rate if sensor == "gyro" else b.force
    c = "xyz".index(axis)
    white = _whitener(b, u[:, c], noise, sensor == "gyro")
    g = white(contribution(b, h)[:, None])[:, 0]
    basis = np.linalg.qr(white(_declared(b, u, c, layout)))[0]
    clear = g - basis @ (basis.T @ g)
    return Hidden(h.effect, h.channel, t / float(np.linalg.norm(clear)), h.tau_s, h.step_day, h.direction)


def _declared(b: Bench, u: Array, c: int, layout: Layout) -> Array:
    nodes = np.array(layout.temperatures)
    hats = np.array([np.interp(b.temperature, nodes, row) for row in np.eye(len(nodes))]).T
    driven = np.array([np.interp(b.temperature, nodes, row) for row in np.eye(len(nodes))]).T * u[:, [c]]
    others = u[:, [k for k in range(3) if k != c]]
    X = np.column_stack([hats, driven, others])
    X = X / np.maximum(np.linalg.norm(X, axis=0), 1e-300)
    left, values, _ = np.linalg.svd(X, full_matrices=False)
    return np.asarray(left[:, values > 1e-9 * values[0]])


def _whitener(b: Bench, u: Array, noise: Noise, gyro: bool) -> Callable[[Array], Array]:
    """V^(−1/2) applied run by run."""
    scale = _scale(b, u[:, None], noise, noise.gyro if gyro else noise.acc)[:, 0]
    size = noise.gyro_run if gyro else noise.acc_run
    roots = []
    for run in np.unique(b.run):
        i = np.flatnonzero(b.run == run)
        Z = np.column_stack([np.full(len(i), size), noise.scale_run * u[i]])
        V = np.diag(scale[i] ** 2) + Z @ Z.T
        roots.append((i, np.linalg.inv(np.linalg.cholesky(V))))

    def apply(A: Array) -> Array:
        out = np.empty_like(A)
        for i, root in roots:
            out[i] = root @ A[i]
        return out

    return apply
