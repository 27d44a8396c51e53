"""Nonlinear flights a second: runs with sensor errors for Monte Carlo, against python-ins in a loop.

Run as `python benchmarks/bench_strapdown.py`. Asserted before the time: the errors that both programs find
for the same erroneous readings agree to 0.1 %. Numba's compilation is not counted.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from bench_sensitivities import flight, python_ins_run
from pyins import transform

from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from planner.physics.perturbed import navigate_with_errors
from planner.physics.strapdown import NavigationState, integrate

LEAST_RATIO = 100.0
CALIBRATED = np.repeat([5e-5, 3e-4, 0.02, 3e-4], 3)  # 0.003 deg/s, 0.03 %, 2 mg, 0.03 %


def columns(trajectory: Trajectory, start: int, stop: int) -> tuple[list[Array], list[Array]]:
    """Bias and scale factor of both sensors."""
    step = trajectory.time_s[1]
    drives = (x[start:stop] / step for x in (trajectory.angle_increment, trajectory.velocity_increment))
    gyro, accelerometer = (
        [np.broadcast_to(np.eye(3), (stop - start, 3, 3)), drive[:, :, None] * np.eye(3)] for drive in drives
    )
    return gyro, accelerometer


def readings(trajectory: Trajectory, coefficients: Array) -> tuple[Array, Array]:
    """Erroneous increments of every run, (B, n, 3)."""
    step = trajectory.time_s[1]
    gyro = trajectory.angle_increment * (1.0 + coefficients[:, None, 3:6]) + step * coefficients[:, None, :3]
    force = (
        trajectory.velocity_increment * (1.0 + coefficients[:, None, 9:]) + step * coefficients[:, None, 6:9]
    )
    return gyro, force


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    start = time.perf_counter()
    result = work()
    return time.perf_counter() - start, result


def main() -> int:
    trajectory = flight("small_uav_2", 60.0)
    rng = np.random.default_rng(1)
    coefficients = CALIBRATED * rng.normal(size=(5000, 12))
    forcing = partial(columns, trajectory)

    few = readings(trajectory, coefficients[:20])
    reference = python_ins_run(trajectory, trajectory.angle_increment, trajectory.velocity_increment)
    spent, ends = timed(lambda: [python_ins_run(trajectory, *pair) for pair in zip(*few, strict=True)])
    theirs = spent / len(ends)
    differences = [transform.compute_state_difference(end, reference) for end in ends]
    expected = np.array([[d["north"], d["east"], -d["down"]] for d in differences])

    navigate_with_errors(trajectory, forcing, coefficients[:20])
    spent, history = timed(lambda: navigate_with_errors(trajectory, forcing, coefficients))
    ours = spent / len(coefficients)
    off = np.linalg.norm(history.position[0, :, :20].T - expected, axis=1) / np.linalg.norm(expected, axis=1)
    assert off.max() < 1e-3, f"errors differ by {off.max():.1e}"

    state = (
        trajectory.latitude,
        trajectory.longitude,
        trajectory.altitude,
        trajectory.velocity,
        trajectory.attitude,
    )
    many = readings(trajectory, coefficients[:200])
    spent, _ = timed(lambda: integrate(NavigationState(*(x[0] for x in state)), *many, trajectory.time_s[1]))
    every_sample = spent / len(many[0])
    print(f"60 s at 100 Hz, errors agree to {off.max():.1e}; ms a flight, ratio to python-ins in a loop")
    for name, each in (
        ("python-ins in a loop", theirs),
        ("navigate_with_errors, 5000 flights", ours),
        ("integrate, 200 flights of own readings", every_sample),
    ):
        print(f"{name:40}{1e3 * each:9.3f} {theirs / each:7.1f}")
    return 0 if theirs / ours >= LEAST_RATIO else 1


if __name__ == "__main__":
    sys.exit(main())
