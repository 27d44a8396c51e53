"""Simulated bench campaigns per second, of the shipped small UAV.

Asserts the answer first: same seed, same bytes; without noise the measurement equation to the last digits.

OMP_NUM_THREADS=1 python benchmarks/bench_simulate.py
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # the campaigns are the tests' own

from planner.campaign.design import Design
from planner.simulate.campaign import Unit, prepared, simulate
from planner.simulate.hidden import HiddenEffect, hidden_effect
from tests.simulate.benches import campaign_of, noiseless

SIZES = ((1, 3), (5, 5), (15, 15))
SECONDS = 2.0


def main() -> None:
    """Print a line for each size."""
    check()
    hidden = [hidden_effect("g_sensitivity=0.01deg/s/g"), hidden_effect("warm_up=0.01 deg/s")]
    print(f"{'records':>8} {'campaigns/s':>12} {'records/s':>12} {'with two hidden':>16}")
    for temperatures, repeats in SIZES:
        spec, plan = campaign_of(temperatures, repeats)
        unit = prepared(spec)
        plain, more = (_rate(plan, unit, h) for h in ([], hidden))
        print(f"{len(plan):8d} {plain:12.1f} {plain * len(plan):12.0f} {more:16.1f}")


def check() -> None:
    """The same seed twice, and the equation of one channel."""
    spec, plan = campaign_of(1, 3)
    unit = prepared(spec)
    a, b = (simulate(plan, unit, 4)[0] for _ in range(2))
    assert a.gyro is not None
    assert b.gyro is not None
    assert a.gyro.tobytes() == b.gyro.tobytes()
    table, truth = simulate(plan, unit, 3, settings=noiseless())

    def of(effect: str, term: str) -> float:
        return truth.at(f"gyro.{effect}", term, float(table.temperature_degc[0]))

    u = table.ref_rate
    v = u[:, 0] + of("misalignment", "xy") * u[:, 1] + of("misalignment", "xz") * u[:, 2]
    np.testing.assert_allclose(
        table.gyro[:, 0], (1.0 + of("scale_factor", "x")) * v + of("bias", "x"), atol=1e-12
    )


def _rate(plan: Design, unit: Unit, hidden: Sequence[HiddenEffect]) -> float:
    """Campaigns per second."""
    simulate(plan, unit, 0, hidden=hidden)
    start, done = time.perf_counter(), 0
    while time.perf_counter() - start < SECONDS:
        done += 1
        simulate(plan, unit, done, hidden=hidden)
    return done / (time.perf_counter() - start)


if __name__ == "__main__":
    main()
