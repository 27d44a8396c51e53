"""What hides on one channel, or is wrong with a bench: from plain NumPy, in deg/s and g."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.diagnose.labs.bench import Array, Bench

Shape = Callable[[Bench, Array, int, np.random.Generator], Array]


def _direction(rng: np.random.Generator) -> Array:
    v = rng.normal(size=3)
    return np.asarray(v / np.abs(v).max())


def _decay(b: Bench, u: Array, c: int, rng: np.random.Generator) -> Array:
    return np.exp(-b.time_on / rng.uniform(120.0, 700.0))


def _step(b: Bench, u: Array, c: int, rng: np.random.Generator) -> Array:
    days = np.unique(b.day)
    return (b.day > rng.uniform(np.quantile(days, 0.3), np.quantile(days, 0.7))).astype(float)


def _lagged(b: Bench, u: Array, c: int, rng: np.random.Generator) -> Array:
    """T − T_lagged of a sensor with a time constant, on a ramp that began with the power-on."""
    tau = rng.uniform(100.0, 400.0)
    return b.ramp / 60.0 * tau * (1.0 - np.exp(-b.time_on / tau))


def _over_temperature(b: Bench, u: Array, c: int, rng: np.random.Generator) -> Array:
    return (b.temperature - 20.0) / 120.0 * u[:, (c + 1) % 3]


def _two(rng: np.random.Generator, c: int) -> tuple[int, int]:
    i, j = rng.choice(3, 2, replace=False)
    return int(i), int(j)


def _product(b: Bench, u: Array, c: int, rng: np.random.Generator) -> Array:
    """Force times force of two axes that the arm loads together with gravity."""
    up = (c + 1) % 3
    return b.force[:, c] * b.force[:, up] + b.force[:, up] * b.force[:, (c + 2) % 3]


# name of the effect in the program -> (sensors on which it is hidden, what it adds)
LIBRARY: dict[str, tuple[tuple[str, ...], Shape]] = {
    "g_sensitivity": (("gyro",), lambda b, u, c, rng: b.force @ _direction(rng)),
    "g_squared_sensitivity": (("gyro",), lambda b, u, c, rng: b.force[:, c] ** 2),
    "scale_factor_nonlinearity": (("gyro", "acc"), lambda b, u, c, rng: (u[:, c] / np.abs(u).max()) ** 3),
    "scale_factor_asymmetry": (("gyro", "acc"), lambda b, u, c, rng: np.abs(u[:, c])),
    "scale_factor_acceleration": (("gyro",), lambda b, u, c, rng: u[:, c] * np.linalg.norm(b.force, axis=1)),
    "temperature_rate": (("gyro", "acc"), lambda b, u, c, rng: b.ramp),
    "warm_up": (("gyro", "acc"), _decay),
    "ageing": (("gyro", "acc"), lambda b, u, c, rng: b.day),
    "bias_step": (("gyro", "acc"), _step),
    "misalignment_temperature": (("gyro",), _over_temperature),
}
MORE: dict[str, tuple[tuple[str, ...], Shape]] = {
    "vibration_rectification": (("gyro", "acc"), lambda b, u, c, rng: np.sum(b.force**2, axis=1)),
    "drift": (("gyro", "acc"), lambda b, u, c, rng: b.time_on),
    "thermal_lag": (("gyro", "acc"), _lagged),
    "hysteresis": (("gyro", "acc"), lambda b, u, c, rng: np.where(b.came_up, 0.5, -0.5)),
    "cross_coupling": (("acc",), _product),
}
# shape -> (sensors, what it adds, variables by which an answer without a name is right)
NAMELESS: dict[str, tuple[tuple[str, ...], Shape, tuple[str, ...]]] = {
    "wave over time": (
        ("gyro", "acc"),
        lambda b, u, c, rng: np.sin(2 * np.pi * b.time_on / rng.uniform(280.0, 420.0)),
        ("time_on",),
    ),
    "weekly wave": (
        ("gyro", "acc"),
        lambda b, u, c, rng: np.sin(2 * np.pi * b.day / rng.uniform(1.2, 3.0)),
        ("day",),
    ),
    "ramp size": (("gyro", "acc"), lambda b, u, c, rng: np.abs(b.ramp), ("temperature_rate",)),
    "resonance": (
        ("gyro",),
        lambda b, u, c, rng: np.exp(-(((np.abs(u[:, c]) - 100.0) / 60.0) ** 2)) * b.turns,
        ("rate",),
    ),
    "saturation": (
        ("acc",),
        lambda b, u, c, rng: -np.sign(u[:, c]) * np.maximum(np.abs(u[:, c]) - 12.0, 0.0) ** 2,
        ("specific_force",),
    ),
    "scale factor after power-on": (
        ("gyro", "acc"),
        lambda b, u, c, rng: u[:, c] * np.exp(-b.time_on / rng.uniform(200.0, 500.0)),
        ("time_on_and_rate", "time_on_and_specific_force"),
    ),
    "asymmetry over temperature": (
        ("gyro",),
        lambda b, u, c, rng: (b.temperature - 20.0) / 60.0 * np.abs(u[:, c]),
        ("temperature_and_rate",),
    ),
    "scale factor from day to day": (
        ("gyro", "acc"),
        lambda b, u, c, rng: u[:, c] * (b.day > np.quantile(np.unique(b.day), 0.5)),
        ("day_and_rate", "day_and_specific_force"),
    ),
    "turning or not": (("gyro",), lambda b, u, c, rng: b.turns.astype(float), ("rate",)),
    "one face": (
        ("gyro", "acc"),
        lambda b, u, c, rng: ((b.up[:, c] < -0.9) & ~b.turns).astype(float),
        ("orientation", "specific_force"),
    ),
}
# as NAMELESS, shapes that an effect of the library follows in most of what they do
MIMICS: dict[str, tuple[tuple[str, ...], Shape, tuple[str, ...]]] = {
    "cubic of another rate": (
        ("gyro",),
        lambda b, u, c, rng: (u[:, (c + 1) % 3] / np.abs(u).max()) ** 3,
        ("rate",),
    ),
    "modulus of a force": (
        ("gyro",),
        lambda b, u, c, rng: np.abs(b.force[:, c]),
        ("specific_force",),
    ),
    "modulus of another rate": (("gyro",), lambda b, u, c, rng: np.abs(u[:, (c + 2) % 3]), ("rate",)),
    "bump of the days": (
        ("gyro", "acc"),
        lambda b, u, c, rng: np.exp(-(((b.day - np.median(b.day)) / (0.15 * b.day.max())) ** 2)),
        ("day",),
    ),
    "misalignment from day to day": (
        ("gyro", "acc"),
        lambda b, u, c, rng: u[:, (c + 1) % 3] * (b.day > np.quantile(np.unique(b.day), 0.5)),
        ("day_and_rate", "day_and_specific_force"),
    ),
    "time of day": (
        ("gyro", "acc"),
        lambda b, u, c, rng: np.sin(2 * np.pi * (b.day + rng.random())),
        ("time_of_day",),
    ),
    "decay over temperature": (
        ("gyro", "acc"),
        lambda b, u, c, rng: (
            ((b.temperature - 20.0) / 60.0) ** 2 * np.exp(-b.time_on / rng.uniform(150.0, 400.0))
        ),
        ("time_on_and_temperature",),
    ),
    "heading at rest": (
        ("gyro",),
        lambda b, u, c, rng: ((b.north[:, (c + 1) % 3] > 0.7) & ~b.turns).astype(float),
        ("orientation",),
    ),
    "step of the temperature in the input": (
        ("gyro", "acc"),
        lambda b, u, c, rng: (b.temperature > np.median(b.temperature)) * u[:, c] * np.abs(u[:, c]),
        ("temperature_and_rate", "rate", "specific_force"),
    ),
}
FAULTS = (
    "base_tilt",
    "local_gravity",
    "table_rate",
    "azimuth",
    "thermometer_lag",
    "mounting",
    "wrong_label",
    "wrong_run",
    "mixed_units",
    "no_earth",
    "arm_bending",
)


@dataclass(frozen=True)
class Hidden:
    """What hides. t: whitened strength, clear of what the declared model can take up."""

    name: str
    channel: str
    t: float
