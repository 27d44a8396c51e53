"""One unit on a bench: readings, references with their faults, the dwell table that comes out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner.nouns.dwell_table import DwellTable
from tests.diagnose.labs.bench import Array, Bench, G, bench
from tests.diagnose.labs.shapes import LIBRARY, MIMICS, MORE, NAMELESS, Hidden

SENSORS = ("gyro", "acc")


@dataclass(frozen=True)
class Noise:
    """One sigma: white of a 60 s record, level of a power-on, share of the input, scale factor of a power-on.

    tails: degrees of freedom of Student's law, 0 for a normal one; struck: share of rows that are off by 25
    """

    white: float
    level: float
    share: float
    scale: float
    tails: float = 0.0
    struck: float = 0.0


@dataclass(frozen=True)
class Truth:
    """What was hidden, and by how much on the channel, in deg/s or g of its shape."""

    hidden: Hidden | None
    fault: str | None
    size: float


def noise_of(seed: int, sensor: str, tails: float = 0.0, struck: float = 0.0) -> Noise:
    """Noise of the seed's sensors."""
    rng = np.random.default_rng([seed, 12, SENSORS.index(sensor)])
    if sensor == "gyro":
        white, level = 10 ** rng.uniform(-3.6, -2.8), 10 ** rng.uniform(-3.2, -2.6)
    else:
        white, level = 10 ** rng.uniform(-4.6, -3.9), 10 ** rng.uniform(-3.6, -3.0)
    return Noise(white, level, 10 ** rng.uniform(-5.2, -4.7), 10 ** rng.uniform(-5.3, -4.8), tails, struck)


def campaign(
    seed: int,
    hidden: Hidden | None = None,
    fault: str | None = None,
    *,
    strength: float = 1.0,
    centrifuge: bool = True,
    tails: float = 0.0,
    struck: float = 0.0,
) -> tuple[DwellTable, Truth]:
    """One unit's table and what is true of it; the seed makes bench, unit and noise."""
    b = bench(seed, centrifuge)
    readings, size = {}, 0.0
    felt = _felt(b, fault, strength, seed)
    for sensor in SENSORS:
        noise = noise_of(seed, sensor, tails, struck)
        u = felt.rate if sensor == "gyro" else felt.force
        rng = np.random.default_rng([seed, 13, SENSORS.index(sensor)])
        y = _read(felt, u, sensor, rng)
        if fault == "mixed_units":
            other = _read(felt, u, sensor, np.random.default_rng([seed, 14, SENSORS.index(sensor)]))
            y = np.where((b.run >= np.quantile(np.unique(b.run), 0.55))[:, None], other, y)
        y = y + _noise(b, u, noise, rng)
        if hidden is not None and hidden.channel.startswith(sensor):
            c = "xyz".index(hidden.channel[-1])
            shape = _shape(hidden.name)(b, u, c, np.random.default_rng([seed, 15]))
            size = hidden.t / strength_of(b, u, c, noise, shape)
            y[:, c] += size * shape
        readings[sensor] = y
    return _table(b, readings, fault, strength, seed), Truth(hidden, fault, size)


def _shape(name: str):  # type: ignore[no-untyped-def]  # one of three tables
    unnamed = {k: v[1] for k, v in (NAMELESS | MIMICS).items()}
    return {**{k: v[1] for k, v in (LIBRARY | MORE).items()}, **unnamed}[name]


# ---------------------------------------------------------------- what the unit reads


def _curve(x: Array, size: float, rng: np.random.Generator) -> Array:
    """(n, 3) a cubic over temperature of each channel."""
    k = rng.normal(size=(4, 3)) * size * np.array([1.0, 0.7, 0.4, 0.2])[:, None]
    return k[0] + x[:, None] * k[1] + (x**2)[:, None] * k[2] + (x**3)[:, None] * k[3]


def _read(b: Bench, u: Array, sensor: str, rng: np.random.Generator) -> Array:
    x = b.temperature / 60.0
    lean = np.eye(3) + np.radians(rng.uniform(-0.25, 0.25, (3, 3))) * (1.0 - np.eye(3))
    bias = _curve(x, 0.02 if sensor == "gyro" else 8e-3, rng)
    kappa = _curve(x, 1.5e-3 if sensor == "gyro" else 1e-3, rng)
    return np.asarray((1.0 + kappa) * (u @ lean.T) + bias)


def _noise(b: Bench, u: Array, noise: Noise, rng: np.random.Generator) -> Array:
    n = len(b)
    e = rng.normal(size=(n, 3))
    if noise.tails:
        e = rng.standard_t(noise.tails, size=(n, 3)) / (np.sqrt(noise.tails / (noise.tails - 2.0)))
    e = e + 25.0 * rng.choice([-1.0, 1.0], size=(n, 3)) * (rng.random((n, 3)) < noise.struck)
    scale = np.hypot((noise.white * np.sqrt(60.0 / b.duration))[:, None], noise.share * np.abs(u))
    which = np.unique(b.run, return_inverse=True)[1]
    runs = which.max() + 1
    level = noise.level * rng.normal(size=(runs, 3))[which]
    turn_on = noise.scale * rng.normal(size=(runs, 3))[which] * u
    return np.asarray(scale * e + level + turn_on)


# ---------------------------------------------------------------- faults of the bench and its records


def _turned(v: Array, angle: Array) -> Array:
    """(n, 3) v turned by small angles (3,) or (n, 3), rad."""
    return np.asarray(v + np.cross(np.broadcast_to(angle, v.shape), v))


def _felt(b: Bench, fault: str | None, strength: float, seed: int) -> Bench:
    """What the unit is truly exposed to; the table goes on saying what b says."""
    rng = np.random.default_rng([seed, 16])
    sign = float(rng.choice([-1.0, 1.0]))
    if fault == "base_tilt":
        a = rng.uniform(0, 2 * np.pi)
        east = np.cross(b.north, b.up)
        lean = np.radians(0.15) * strength * (np.cos(a) * b.north + np.sin(a) * east)
        lean = np.where((b.place == "rate_table")[:, None], lean, 0.0)
        return replace(b, up=b.up + lean)
    if fault == "local_gravity":
        rest = (b.place == "rate_table")[:, None]
        return replace(b, up=np.where(rest, b.up * (1.0 + sign * 1e-3 * strength), b.up))
    if fault == "table_rate":
        least = float(rng.choice([0.0, 150.0, 250.0]))
        fast = (np.linalg.norm(b.turn, axis=1) > least) & (b.place == "rate_table")
        return replace(b, turn=np.where(fast[:, None], b.turn * (1.0 + sign * 5e-4 * strength), b.turn))
    if fault == "azimuth":
        angle = np.radians(rng.uniform(20.0, 60.0)) * sign * strength
        return replace(b, north=np.cos(angle) * b.north + np.sin(angle) * np.cross(b.up, b.north))
    if fault == "mounting":
        angle = np.radians(0.15) * strength * rng.choice([-1.0, 1.0], 3) * rng.uniform(0.4, 1.0, 3)
        place = str(rng.choice(["centrifuge", "rate_table"]))
        here = (b.place == place)[:, None]
        keys = ("up", "north", "turn", "load")
        return replace(b, **{k: np.where(here, _turned(getattr(b, k), angle), getattr(b, k)) for k in keys})
    if fault == "thermometer_lag":
        return replace(b, temperature=b.temperature - b.ramp * 5.0 * strength)
    if fault == "arm_bending":
        load = np.linalg.norm(b.load, axis=1)
        axis = np.cross(b.up, b.load) / np.maximum(load, 1e-9)[:, None]
        angle = np.radians(0.2) * strength * (load / 50.0)[:, None] * axis
        return replace(b, up=_turned(b.up, angle), load=_turned(b.load, angle), turn=_turned(b.turn, angle))
    return b


def _table(b: Bench, readings: dict[str, Array], fault: str | None, strength: float, seed: int) -> DwellTable:
    rng = np.random.default_rng([seed, 17])
    rate, force = b.rate.copy(), b.force.copy()
    if fault == "no_earth":
        rate = rate - b.earth
    if fault in ("wrong_label", "wrong_run"):
        rest = ~b.turns & (b.ramp == 0)
        run = int(rng.choice(np.unique(b.run[rest])))
        rows = np.flatnonzero(rest & (b.run == run))
        if fault == "wrong_label":
            rows = rng.choice(rows, 1)
            force[rows] = -force[rows]
            rate[rows] = -rate[rows]
        else:
            force[rows], rate[rows] = np.roll(force[rows], 1, axis=1), np.roll(rate[rows], 1, axis=1)
    n = len(b)
    return DwellTable(
        unit=np.full(n, "lab"),
        run=b.run,
        day=b.day,
        time_on=b.time_on,
        duration=b.duration,
        temperature_degc=b.temperature + _straying(b, seed),
        temperature_rate=b.ramp / 60.0,
        ref_rate=np.radians(rate),
        ref_acc=force * G,
        gyro=np.radians(readings["gyro"]),
        acc=readings["acc"] * G,
        bench=b.place if rng.random() < 0.7 else None,
        source=f"lab {seed}",
    )


def _straying(b: Bench, seed: int) -> Array:
    """(n,) K by which readings of the thermometer stray from the unit: 0.05 in every other campaign."""
    rng = np.random.default_rng([seed, 18])
    return np.asarray(0.05 * (seed % 2) * rng.normal(size=len(b)))


# ---------------------------------------------------------------- how strong it is


def strength_of(b: Bench, u: Array, c: int, noise: Noise, shape: Array) -> float:
    """Whitened length of a shape that bias and scale factor at every temperature and misalignment leave."""
    nodes = _nodes(b.temperature[(b.ramp == 0)])
    hats = np.array([np.interp(b.temperature, nodes, row) for row in np.eye(len(nodes))]).T
    others = np.delete(u, c, axis=1)
    X = np.column_stack([shape, hats, hats * u[:, [c]], others])
    white = np.empty_like(X)
    scale = np.hypot(noise.white * np.sqrt(60.0 / b.duration), noise.share * np.abs(u[:, c]))
    for run in np.unique(b.run):
        i = b.run == run
        Z = np.column_stack([np.full(int(i.sum()), noise.level), noise.scale * u[i, c]])
        white[i] = np.linalg.solve(np.linalg.cholesky(np.diag(scale[i] ** 2) + Z @ Z.T), X[i])
    length = np.linalg.norm(white[:, 1:], axis=0)
    left, values, _ = np.linalg.svd(white[:, 1:][:, length > 0] / length[length > 0], full_matrices=False)
    basis = left[:, values > 1e-9 * values[0]]
    return float(np.linalg.norm(white[:, 0] - basis @ (basis.T @ white[:, 0])))


def _nodes(temperature: Array) -> Array:
    t = np.sort(temperature)
    return np.array([part.mean() for part in np.split(t, np.flatnonzero(np.diff(t) > 4.0) + 1)])
