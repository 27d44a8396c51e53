"""Calibrate 1 000, 10 000 and 100 000 dwells: seconds, and how they grow.

Asserts the answer first: biases and scale factors of the gyros lie where the unit was drawn.

OMP_NUM_THREADS=1 python benchmarks/bench_calibrate.py
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # the campaigns are the tests' own

from planner.calibrate.dwells_to_fit import calibrate
from planner.nouns.calibration import Calibration
from tests.calibrate import world
from tests.calibrate.truths import EFFECTS, WorldTruth, any_spec

REPEATS = (9, 93, 926)  # of everything at three temperatures: about 1 000, 10 000, 100 000 dwells


def main() -> None:
    """Print a line for each size."""
    spec = any_spec().model_copy(update={"effects": EFFECTS})
    print(f"{'dwells':>8} {'s':>8} {'µs/dwell':>9} {'growth':>7}")
    before: tuple[int, float] | None = None
    for repeats in REPEATS:
        layout = world.Layout(
            temperatures=(0.0, 20.0, 40.0),
            static_repeats=repeats,
            later=(),
            ramps=False,
            rate_repeats=repeats,
            rate_temperatures=(0.0, 20.0, 40.0),
            centrifuge=False,
        )
        table = world.campaign(7, layout=layout)
        start = time.perf_counter()
        (found,) = calibrate(table, spec)
        seconds = time.perf_counter() - start
        check(found)
        power = "" if before is None else f"n^{math.log(seconds / before[1], len(table) / before[0]):.2f}"
        print(f"{len(table):8d} {seconds:8.2f} {1e6 * seconds / len(table):9.1f} {power:>7}")
        before = len(table), seconds


def check(found: Calibration) -> None:
    """All coefficients within five standard errors of the truth, most within their interval."""
    inside = []
    for sensor in found.sensors:
        truth = WorldTruth(7, sensor.sensor)
        for c in sensor.coefficients:
            assert abs(c.value - truth.of(c)) < 5.0 * c.standard_error, c
            inside.append(c.low <= truth.of(c) <= c.high)
    assert np.mean(inside) > 0.85, np.mean(inside)


if __name__ == "__main__":
    main()
