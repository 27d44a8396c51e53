"""Exact rates of checks that `accept --plan` plans: all power-ons at once, and looked at as they come.

Units of known load in the region of tests/fleet/fleets.py, measured with the planned power-ons at the planned
temperatures: shares with exact binomial intervals, and the power-ons that were needed beside the fixed check.

    python benchmarks/study_accept.py [units] [load that the check is planned for]
"""

from __future__ import annotations

import sys
import time
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from planner.fleet.acceptance import accepted
from planner.fleet.check_groups import by_temperature
from planner.fleet.check_plan import planned_checks
from planner.fleet.check_residual import check_residuals
from planner.fleet.judge import ErrorRates
from planner.fleet.looks import accepted_as_they_come
from planner.solvers.distributions import binomial_interval
from tests.fleet.fleets import check_table, small_basis
from tests.fleet.test_judge import batch
from tests.specs import loaded, small

RATES = ErrorRates(0.05, 0.05)
RANGE = (-60.0, 60.0)


LOADS = (0.5, 0.7, 0.8, 0.9, 0.95, 1 - 1e-9, 1 + 1e-9, 1.05, 1.1, 1.3, 1.5)


def main(units: int, planned_for: float) -> None:
    """A line for every load: the fixed check, then the one that may stop."""
    basis = small_basis()
    plans = planned_checks(loaded(small()).spec, basis.models, basis.region, planned_for, 0.9, RATES)
    check = next(c for c in plans if len(c.temperatures_degc) == 3)
    fixed = check.power_ons * len(check.tests)
    motions = len(check.tests[0].faces)
    print(f"planned for {planned_for:g}: {fixed} power-ons of {motions} motion(s) at three temperatures,")
    print(f"decides {check.decides:.3f}; with looks up to {check.looks}, {check.expected:.1f} on average")
    for load in LOADS:
        started = time.perf_counter()
        drawn = partial(check_table, *batch(load, units, 31), motions=motions)
        table = drawn(np.random.default_rng(31), power_ons=fixed)
        residuals = check_residuals(table, by_temperature(table), basis.models, basis.region)
        told = accepted(residuals, basis.region, RANGE, RATES)
        table = drawn(np.random.default_rng(32), power_ons=check.looks)
        looked = accepted_as_they_come(table, basis.models, basis.region, RANGE, RATES, check.looks)
        print(f"load {load:.9f}")
        for name, found in (("all at once", told), ("with looks", looked)):
            used = np.mean([u.power_ons for u in found]) / 3
            print(f"  {name:12s} {_shares([u.verdict for u in found])}  power-ons {used:5.1f} a temperature")
        print(f"  {time.perf_counter() - started:.1f} s", flush=True)


def _shares(verdicts: list[str]) -> str:
    found = []
    for verdict in ("accepted", "rejected", "undecided"):
        k = verdicts.count(verdict)
        low, high = binomial_interval(k, len(verdicts), 0.025)
        found.append(f"{verdict} {k:4d} ({100 * low:4.1f} … {100 * high:5.1f} %)")
    return "  ".join(found)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 400, float(sys.argv[2]) if len(sys.argv) > 2 else 0.95)
