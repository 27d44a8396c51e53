"""Built-in flights with parameters at random, to hold linear and nonlinear navigation side by side."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from planner.nouns.trajectory import Trajectory
from planner.plan.spec_to_trajectory import trajectory_of

NAMES = ("level", "turn", "helicopter", "small_uav_1", "small_uav_2")


def random_flight(seed: int) -> Trajectory:
    """A built-in flight with parameters at random."""
    rng = np.random.default_rng([seed, 77])
    name = NAMES[seed % len(NAMES)]
    settings = {
        "name": name,
        "latitude": f"{rng.uniform(-70, 70):.3f} deg",
        "longitude": f"{rng.uniform(-180, 180):.3f} deg",
        "heading": f"{rng.uniform(0, 360):.3f} deg",
        "sampling_rate": "50 Hz",
    }
    if name in ("level", "turn"):
        settings |= {"duration": f"{rng.uniform(30, 90):.1f} s", "speed": f"{rng.uniform(20, 250):.1f} m/s"}
    if name == "small_uav_1":
        settings |= {"elevation": f"{rng.uniform(45, 70):.1f} deg", "duration": "50 s"}
    return trajectory_of(settings, Path())
