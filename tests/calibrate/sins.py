"""A strapdown system on a bench, navigating by the readings of sensors whose errors are known.

Axes of planner (forward-right-down, north-east-down). The readings are a few lines here. Two systems make
navigation of them, python-ins and planner's own in the inertial frame; neither shares a line with what turns
the navigation equations round, which are of the local frame.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from pyins import strapdown
from pyins.util import ACCEL_COLS, GYRO_COLS, TRAJECTORY_COLS
from scipy.spatial.transform import Rotation

from planner.physics.attitude import rph_from_dcm
from planner.physics.strapdown import NavigationState, integrate

U, G0 = 7.292115e-5, 9.80665
LATITUDE, ALTITUDE = np.radians(55.75), 150.0
E_RATE = U * np.array([np.cos(LATITUDE), 0.0, -np.sin(LATITUDE)])


def gravity() -> float:
    """Somigliana's formula with the free-air gradient 2 h/a, as python-ins has it."""
    s = np.sin(LATITUDE) ** 2
    surface = 9.7803253359 * (1 + 0.00193185265241 * s) / np.sqrt(1 - 0.00669437999014 * s)
    return float(surface * (1 - 2 * ALTITUDE / 6378137.0))


@dataclass(frozen=True)
class Errors:
    """True coefficients, SI: b (3,), M (3, 3) of y = diag(1 + κ) M u + b, gyros first."""

    bias: np.ndarray
    matrix: np.ndarray


GYRO = Errors(
    np.radians([0.05, -0.03, 0.08]),
    np.diag([1.004, 0.997, 1.006]) @ np.array([[1, 2e-3, -1e-3], [1.5e-3, 1, 3e-3], [-2e-3, 1e-3, 1]]),
)
ACCELEROMETER = Errors(
    np.array([0.005, -0.008, 0.003]) * G0,
    np.diag([1.002, 0.996, 0.999]) @ np.array([[1, -1e-3, 2e-3], [1e-3, 1, -2e-3], [3e-3, 1e-3, 1]]),
)


@dataclass(frozen=True)
class Record:
    """What the bench does: C_nb at its start, rate over the ground (3,) rad/s, force (3,) m/s²."""

    name: str
    start: np.ndarray
    rate: np.ndarray = field(default_factory=lambda: np.zeros(3))
    force: np.ndarray | None = None
    seconds: float = 30.0
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))


def facing(x: str, y: str) -> np.ndarray:
    """C_nb with body x and y along words: north, east, up and their opposites."""
    axes = {"north": (1, 0, 0), "east": (0, 1, 0), "down": (0, 0, 1)}
    axes |= {n: tuple(-np.array(axes[o])) for n, o in (("south", "north"), ("west", "east"), ("up", "down"))}
    first, second = np.array(axes[x], dtype=float), np.array(axes[y], dtype=float)
    return np.column_stack([first, second, np.cross(first, second)])


# K table 2.6: X up Y east Z north, X down Y east Z south, Y up Z east X north, Y down Z east X south, Z up X
# east Y north, Z down X west Y north
SIX = {
    "x_up": facing("up", "east"),
    "x_down": facing("down", "east"),
    "y_up": facing("north", "up"),
    "y_down": facing("south", "down"),
    "z_up": facing("east", "north"),
    "z_down": facing("west", "north"),
}


def true_increments(record: Record, step: float) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) ∫ω dt and ∫f dt in the turning body, by Simpson's rule in each step."""
    n = round(record.seconds / step)
    t = np.arange(2 * n + 1) * step / 2.0
    turned = Rotation.from_rotvec(t[:, None] * record.rate).as_matrix()
    c = record.start @ turned
    rate = record.rate + np.einsum("kji,j->ki", c, E_RATE)
    up = np.array([0.0, 0.0, -gravity()])
    force = np.einsum("kji,j->ki", c, up) if record.force is None else np.tile(record.force, (len(t), 1))
    return tuple((x[:-2:2] + 4 * x[1:-1:2] + x[2::2]) * step / 6.0 for x in (rate, force))


def read_increments(record: Record, gyro: Errors, accelerometer: Errors, step: float) -> list[np.ndarray]:
    """What the sensors read of them: (n, 3) rad and (n, 3) m/s."""
    true = true_increments(record, step)
    return [x @ e.matrix.T + e.bias * step for x, e in zip(true, (gyro, accelerometer), strict=True)]


def navigated(record: Record, gyro: Errors, accelerometer: Errors, step: float = 0.02) -> pd.DataFrame:
    """What our own strapdown makes of the readings: a row every fifth sample, columns of a navigation log."""
    angle, velocity = read_increments(record, gyro, accelerometer, step)
    every = np.arange(0, len(angle) + 1, 5) * step
    start = NavigationState(LATITUDE, 0.65, ALTITUDE, record.velocity, record.start)
    done = integrate(start, angle, velocity, step, instants=every[1:])
    attitude = np.concatenate([record.start[None], done.attitude])
    speed = np.concatenate([record.velocity[None], done.velocity])
    return _as_log(every, np.degrees(np.column_stack(rph_from_dcm(attitude))), speed)


def by_python_ins(record: Record, gyro: Errors, accelerometer: Errors, step: float = 0.05) -> pd.DataFrame:
    """What python-ins makes of the readings."""
    read = read_increments(record, gyro, accelerometer, step)
    imu = np.hstack([np.vstack([x[:1], x]) for x in read])
    time = np.arange(len(imu)) * step
    imu = pd.DataFrame(imu, index=pd.Index(time, name="time"), columns=GYRO_COLS + ACCEL_COLS)
    angles = [float(np.degrees(x)) for x in rph_from_dcm(record.start)]
    place = [np.degrees(LATITUDE), 37.6, ALTITUDE, *record.velocity, *angles]
    system = strapdown.Integrator(pd.Series(place, index=TRAJECTORY_COLS))
    done = system.integrate(strapdown.compute_increments_from_imu(imu, "increment"))
    return _as_log(
        time, *(done[list(c)].to_numpy() for c in (("roll", "pitch", "heading"), ("VN", "VE", "VD")))
    )


def _as_log(time: np.ndarray, angles: np.ndarray, velocity: np.ndarray) -> pd.DataFrame:
    names = ("time_s", "roll_deg", "pitch_deg", "heading_deg", "v_north_mps", "v_east_mps", "v_down_mps")
    return pd.DataFrame(dict(zip(names, np.column_stack([time, angles, velocity]).T, strict=True)))


def mean_readings(record: Record, gyro: Errors, accelerometer: Errors, step: float = 0.02) -> np.ndarray:
    """(2, 3) the direct outputs: means of what the sensors read, rad/s and m/s²."""
    true = [x.sum(axis=0) / record.seconds for x in true_increments(record, step)]
    return np.array([e.matrix @ u + e.bias for u, e in zip(true, (gyro, accelerometer), strict=True)])


def campaign() -> list[Record]:
    """Rests and turns both ways in the six attitudes of K tables 2.6 and 2.7, a centrifuge of table 2.8."""
    records = [Record(name, c) for name, c in SIX.items()]
    for name, c in SIX.items():
        up = c.T @ np.array([0.0, 0.0, -1.0])
        records += [Record(f"{name}_{dps:+d}", c, np.radians(dps) * up, seconds=7.2) for dps in (100, -100)]
    for name in ("x_up", "y_up", "z_up"):
        up = SIX[name].T @ np.array([0.0, 0.0, -1.0])
        across = np.roll(up, 1)
        load, dps = 8.0 * G0, 300.0
        inward = SIX[name] @ across
        speed = load / np.radians(dps) * np.cross([0.0, 0.0, -1.0], -inward)  # ω × r, r outward
        records.append(
            Record(
                f"{name}_load", SIX[name], np.radians(dps) * up, load * across + gravity() * up, 6.0, speed
            )
        )
    return records


@cache
def log_text() -> str:
    """The whole campaign as a navigation log, rounded to 1e-6 deg and 1e-6 m/s."""
    rows, clock = [], 0.0
    for record in campaign():
        log = navigated(record, GYRO, ACCELEROMETER)
        log["time_s"] += clock
        clock = float(log["time_s"].iloc[-1]) + 30.0
        log.insert(0, "record", record.name)
        for k, axis in enumerate("xyz"):
            log[f"table_rate_{axis}_dps"] = np.degrees(record.rate[k])
            log[f"table_acc_{axis}_g"] = np.nan if record.force is None else record.force[k] / G0
        rows.append(log)
    whole = pd.concat(rows)
    whole.insert(0, "unit", "GIB2")
    whole["alt_m"], whole["lat_deg"], whole["temp_degc"] = ALTITUDE, np.degrees(LATITUDE), 25.0
    return whole.to_csv(index=False, float_format="%.6f", lineterminator="\n")


SPEC = """\
planner: 1
name: GIB
unit:
  gyro:
    bias: {systematic: 0.1 deg/s}
    scale_factor: {systematic: 1 %}
    misalignment: {systematic: 0.3 deg}
  accelerometer:
    bias: {systematic: 20 mg}
    scale_factor: {systematic: 1 %}
    misalignment: {systematic: 0.3 deg}
effects: [bias, scale_factor, misalignment]
"""


def files(folder: Path) -> tuple[Path, Path]:
    """The log and a spec of the sensors."""
    log, spec = folder / "log.csv", folder / "gib.yaml"
    log.write_text(log_text())
    spec.write_text(SPEC)
    return log, spec
