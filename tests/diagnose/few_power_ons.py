"""A bench with few power-ons, each with all of it: six faces, then rates about three axes. Plain NumPy.

Every power-on has rates of its own, so that no other one repeats it.

Degrees per second and g inside; the table that comes out is SI. Run-to-run spreads are several times the
noise of a record, as of most units.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable

G = 9.80665
EARTH_DPS = 15.041067 / 3600.0
TEMPERATURES = (-45.0, 5.0, 55.0)
Hides = Callable[[Array, Array], Array]
WHITE = {"gyro": 1e-3, "acc": 5e-5}  # deg/s, g: of a record of 60 s


def few_power_ons(
    runs: int,
    seed: int,
    level: float = 8.0,
    tails: float = 0.0,
    share: float = 5e-6,
    hidden: Mapping[str, Hides] = MappingProxyType({}),
    lean: float = 0.0,
) -> DwellTable:
    """One unit. level: spread from power-on to power-on, of the noise; share: of the input that is noise

    tails: degrees of freedom of Student's t of the noise, scaled to its variance; 0 is Gaussian
    hidden: `gyro_x` … -> what its reading has beside, of inputs (n, 3) and temperature (n,)
    lean: of every face, rad about each axis, one sigma, which the table says
    """
    rng = np.random.default_rng([seed, runs, 77])
    rows = [row for run in range(runs) for row in _power_on(run, rng)]
    a = np.array(rows)
    run, day, time_on, duration, t = a[:, 0].astype(np.int64), a[:, 1], a[:, 2], a[:, 3], a[:, 4]
    rate, force = a[:, 5:8], a[:, 8:11] + np.random.default_rng(seed).normal(0.0, lean, (len(a), 3))

    def read(u: Array, sensor: str) -> Array:
        """y = (1 + κ)(M u) + b + noise, κ and b curves over temperature, b with a level of every power-on."""
        x, white = t / 60.0, WHITE[sensor]
        powers = np.stack([np.ones(len(x)), x, x**2], axis=1)
        bias = powers @ rng.normal(0.0, 10.0 * white, (3, 3)) + rng.normal(0.0, level * white, (99, 3))[run]
        kappa = powers @ rng.normal(0.0, 1e-3, (3, 3)) + rng.normal(0.0, 1e-5, (99, 3))[run]
        lean = np.eye(3) + np.radians(rng.uniform(-0.3, 0.3, (3, 3))) * (1.0 - np.eye(3))
        e = (
            rng.standard_t(tails, u.shape) / np.sqrt(tails / (tails - 2.0))
            if tails
            else rng.normal(size=u.shape)
        )
        size = np.hypot(white * np.sqrt(60.0 / duration)[:, None], share * np.abs(u))
        y = (1.0 + kappa) * (u @ lean.T) + bias + size * e
        for axis, name in enumerate("xyz"):
            if f"{sensor}_{name}" in hidden:
                y[:, axis] += hidden[f"{sensor}_{name}"](u, t)
        return np.asarray(y)

    return DwellTable(
        unit=np.full(len(a), "few"),
        run=run,
        day=day,
        time_on=time_on,
        duration=duration,
        temperature_degc=t,
        temperature_rate=rng.normal(0.0, 1e-4, len(a)),
        ref_rate=np.radians(rate),
        ref_acc=force * G,
        gyro=np.radians(read(rate, "gyro")),
        acc=read(force, "acc") * G,
        source=f"few {seed}",
    )


def _power_on(run: int, rng: np.random.Generator) -> list[tuple[float, ...]]:
    rows: list[tuple[float, ...]] = []
    t = TEMPERATURES[run % len(TEMPERATURES)] + rng.normal(0.0, 0.2)
    time, eye = rng.uniform(10.0, 60.0), np.eye(3)
    for k in rng.permutation(6):
        up, north = (1.0 if k % 2 else -1.0) * eye[k // 2], eye[(k // 2 + 1) % 3]
        rows.append((run, run, time, 60.0, t + rng.normal(0.0, 0.03), *_earth(up, north), *up))
        time += 60.0 + rng.uniform(10.0, 100.0)
    sizes = rng.uniform((5.0, 40.0, 150.0), (20.0, 100.0, 250.0))
    for axis in range(3):
        for rate in rng.permutation([*sizes, *-sizes]):
            turning = rate * eye[axis] + _earth(eye[axis], np.zeros(3))
            rows.append((run, run, time, 20.0, t + rng.normal(0.0, 0.03), *turning, *eye[axis]))
            time += 30.0
    return rows


def _earth(up: Array, north: Array) -> Array:
    return np.asarray(EARTH_DPS * (np.sin(0.9) * up + np.cos(0.9) * north))
