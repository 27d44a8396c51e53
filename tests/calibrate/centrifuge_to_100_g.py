"""A campaign up to 100 g from plain NumPy: six faces on an arm of 0.4 m, the same rates near its axis, rests.

The gyros' bias follows a profile over load that saturates, of its own on every axis and to either side, as
large as K table 2.5 has it; the arm is longer than it says and bends. Bench units: deg/s, g.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.dwell_table import DwellTable

Array = NDArray[np.float64]
G = 9.80665
DEG = np.pi / 180.0
ARM_M = 0.4
LOADS_G = (1.0, 2.0, 5.0, 10.0, 25.0, 50.0, 75.0, 100.0)  # K table 2.4
# K table 2.5 before calibration, deg/s at 100 g: along +x, −x, +y, −y, +z, −z
AT_100_G = np.array([[0.082, 0.087], [0.113, 0.084], [0.105, 0.091]])


@dataclass(frozen=True)
class Unit:
    """What the unit and the arm are like. profile: whether the bias saturates over load, of that many g

    longer: K_R − 1; droop: rad per g about the tangent; squared: 1/g² of the gyros' scale factor
    """

    saturates_g: float | None = 20.0
    longer: float = 0.0
    droop: float = 0.0
    squared: float = 0.0
    run: float = 0.002
    noise: float = 0.001


def profile(force: Array, unit: Unit) -> Array:
    """(n, 3) deg/s of the gyros' bias over load (n, 3) in g: its own axis in full, the others a fifth."""
    if unit.saturates_g is None:
        return np.zeros_like(force)
    size = np.where(force > 0.0, AT_100_G[:, 0], AT_100_G[:, 1]) / -np.expm1(-100.0 / unit.saturates_g)
    one = size * np.sign(force) * -np.expm1(-np.abs(force) / unit.saturates_g)
    return one @ (0.2 * np.ones((3, 3)) + 0.8 * np.eye(3))


def campaign(seed: int, unit: Unit, loads: tuple[float, ...] = LOADS_G, repeats: int = 2) -> DwellTable:
    """The dwell table of one unit."""
    rng = np.random.default_rng([seed, 100])
    rows: list[tuple[float, ...]] = []
    run = 0
    for _ in range(repeats):
        for axis in range(3):
            for sign in (1.0, -1.0):
                run += 1
                up = (axis + 1) % 3
                for k, load in enumerate(loads):
                    for far in (1.0, 0.0):
                        for way in (1.0, -1.0):
                            force, rate = np.zeros(3), np.zeros(3)
                            force[axis], force[up] = far * sign * load, 1.0
                            rate[up] = way * np.degrees(np.sqrt(load * G / ARM_M))
                            rows.append((run, 60.0 + 80.0 * k + 40.0 * far, *rate, *force, far))
                for face in range(6):
                    force = np.zeros(3)
                    force[face % 3] = 1.0 if face < 3 else -1.0
                    rows.append((run, 900.0 + 30.0 * face, 0.0, 0.0, 0.0, *force, 0.0))
    a = np.array(rows)
    return _measured(a, unit, rng)


def _measured(a: Array, unit: Unit, rng: np.random.Generator) -> DwellTable:
    run, rate, force, far = a[:, 0].astype(np.int64), a[:, 2:5], a[:, 5:8], a[:, 8]
    spin = np.where(np.abs(rate) > 0.0, 1.0, 0.0)
    spun = spin.any(axis=1) & (far > 0.0)
    load = np.where(spun[:, None], force * (1.0 - spin), 0.0)  # all that lies across the axis of the turn
    felt = force + unit.longer * load
    tilt = unit.droop * np.cross(spin * spun[:, None], load)  # about the tangent
    felt, turned = felt + np.cross(tilt, felt), rate + np.cross(tilt, rate)
    modulus = np.linalg.norm(felt, axis=1, keepdims=True)
    n, draws = len(a), rng.normal(size=(run.max() + 1, 6))
    scale, bias = 0.002 * rng.normal(size=6), rng.normal(size=6)
    gyro = turned * (1.0 + scale[:3] + unit.squared * modulus**2) + profile(felt, unit) + 0.01 * bias[:3]
    acc = felt * (1.0 + scale[3:]) + 0.005 * bias[3:]
    gyro += unit.run * draws[run, :3] + unit.noise * rng.normal(size=(n, 3))
    acc += 1e-4 * draws[run, 3:] + 5e-5 * rng.normal(size=(n, 3))
    return DwellTable(
        unit=np.full(n, "u1"),
        run=run,
        day=0.05 * run,
        time_on=a[:, 1],
        duration=np.full(n, 20.0),
        temperature_degc=np.full(n, 20.0),
        temperature_rate=np.zeros(n),
        ref_rate=np.radians(rate),
        ref_acc=force * G,
        gyro=np.radians(gyro),
        acc=acc * G,
    )
