"""Exact rates of `accept` with looks after every power-on, and what planned checks decide.

Units of known load in the region of tests/fleet/fleets.py: shares with exact binomial intervals, and the
power-ons that were needed beside the fixed check.

    python benchmarks/study_accept.py [units] [power-ons]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.study_intervals import binomial_interval
from planner.fleet.acceptance import accepted
from planner.fleet.check_groups import by_temperature
from planner.fleet.check_residual import check_residuals
from planner.fleet.judge import ErrorRates
from planner.fleet.looks import accepted_as_they_come
from tests.fleet.fleets import check_table, small_basis
from tests.fleet.test_judge import batch

RATES = ErrorRates(0.05, 0.05)
RANGE = (-60.0, 60.0)


def main(units: int, power_ons: int) -> None:
    """A line for every load: the fixed check, then the one that may stop."""
    basis = small_basis()
    for load in (0.7, 0.8, 0.9, 0.95, 1 - 1e-9, 1 + 1e-9, 1.05, 1.1, 1.2):
        started = time.perf_counter()
        table = check_table(*batch(load, units, 31), np.random.default_rng(31), power_ons=power_ons)
        fixed = accepted(
            check_residuals(table, by_temperature(table), basis.models, basis.region),
            basis.region,
            RANGE,
            RATES,
        )
        looked = accepted_as_they_come(table, basis.models, basis.region, RANGE, RATES, power_ons)
        print(f"load {load:.9f}")
        for name, found in (("all at once", fixed), ("with looks", looked)):
            used = np.mean([u.power_ons for u in found]) / (3 * power_ons)
            print(f"  {name:12s} {_shares([u.verdict for u in found])}  power-ons {used:4.2f} of the planned")
        print(f"  {time.perf_counter() - started:.1f} s", flush=True)


def _shares(verdicts: list[str]) -> str:
    found = []
    for verdict in ("accepted", "rejected", "undecided"):
        k = verdicts.count(verdict)
        low, high = binomial_interval(k, len(verdicts))
        found.append(f"{verdict} {k:4d} ({100 * low:4.1f} … {100 * high:5.1f} %)")
    return "  ".join(found)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 400, int(sys.argv[2]) if len(sys.argv) > 2 else 10)
