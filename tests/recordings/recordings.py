"""Recordings whose truth is known: a unit at rest in several positions, turned between them, plain NumPy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
G = 9.80665
HEADER = "time_s,gyro_x_dps,gyro_y_dps,gyro_z_dps,acc_x_g,acc_y_g,acc_z_g,temp_degc"
GYRO_BIAS = np.array([0.3, -0.2, 0.1])  # deg/s
ACC_BIAS = np.array([0.01, -0.02, 0.005])  # g
TURNS = (0, 1, 0, 2, 1)  # body axes, 90° about each in turn


@dataclass(frozen=True)
class Recorded:
    """time (n,) s; gyro (n, 3) deg/s and acc (n, 3) g without noise; degc (n,); rests: (first, last) s."""

    rate: float
    time: Array
    gyro: Array
    acc: Array
    degc: Array
    rests: tuple[tuple[float, float], ...]
    up: Array

    def readings(self, gyro_noise: float, acc_noise: float, seed: int) -> Array:
        """(n, 8) columns of HEADER, with white noise in deg/s and g."""
        rng = np.random.default_rng(seed)
        gyro = self.gyro + GYRO_BIAS + gyro_noise * rng.normal(size=self.gyro.shape)
        acc = self.acc + ACC_BIAS + acc_noise * rng.normal(size=self.acc.shape)
        return np.column_stack([self.time, gyro, acc, self.degc])


def tumbled(
    rate: float = 200.0,
    rest: float = 6.0,
    turn: float = 1.0,
    kelvin_per_s: float = 0.0,
    turns: tuple[int, ...] = TURNS,
) -> Recorded:
    """Rests of `rest` s with turns of 90° about body axes between them, rate (π/2)·(1 − cos)/T.

    up: (len(turns) + 1, 3) true specific force of each rest, g. df/dt = −ω × f.
    """
    still, moving = round(rest * rate), round(turn * rate)
    time = np.arange(moving) / rate
    angle = 90.0 * (time / turn - np.sin(2 * np.pi * time / turn) / (2 * np.pi))  # deg
    speed = 90.0 / turn * (1 - np.cos(2 * np.pi * time / turn))
    up = [np.array([0.0, 0.0, 1.0])]
    gyro, acc, rests = [np.zeros((still, 3))], [np.tile(up[0], (still, 1))], [(0.0, rest)]
    for k, axis in enumerate(turns, start=1):
        gyro += [speed[:, None] * np.eye(3)[axis], np.zeros((still, 3))]
        moved = np.array([turned(up[-1], axis, -a) for a in angle])
        up.append(np.round(turned(up[-1], axis, -90.0)))
        acc += [moved, np.tile(up[-1], (still, 1))]
        rests.append((k * (rest + turn), k * (rest + turn) + rest))
    all_gyro = np.vstack(gyro)
    at = np.arange(len(all_gyro)) / rate
    return Recorded(rate, at, all_gyro, np.vstack(acc), 20.0 + kelvin_per_s * at, tuple(rests), np.array(up))


def turned(vector: Array, axis: int, degrees: float) -> Array:
    """A vector turned about a coordinate axis."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    found = vector.copy()
    found[i], found[j] = c * vector[i] - s * vector[j], s * vector[i] + c * vector[j]
    return found


def save(path: Path, values: Array, header: str = HEADER, delimiter: str = ",", fmt: str = "%.9g") -> Path:
    """A text table."""
    np.savetxt(path, values, fmt=fmt, delimiter=delimiter, header=header, comments="")
    return path
