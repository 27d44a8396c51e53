"""How many times cheaper it is to ask what a wander would gain than to search for it four times over.

First the answer: where a bias wanders within power-ons both say so, where none does neither; and a search
gains what was promised within a factor of four. Then the ratio of processor seconds of the two in one run.

Run: OMP_NUM_THREADS=1 python benchmarks/bench_wander_screen.py
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from planner.diagnose.noise.wander import PROMISED, SETTLED_ROUGHLY, TIMES_S, promised_by
from planner.solvers.random_effects import Drift, RandomEffects
from planner.solvers.reml import reml_together
from planner.solvers.reml_beside import reml_roughly
from planner.solvers.restricted_likelihood import Sample, restricted_loglik

POWER_ONS, RECORDS, COLUMNS = 120, 8, 250  # as the 4100 dwells of bench_diagnosis have them
ROUNDS = 5


def campaign(seed: int, sigma: float) -> tuple[Sample, list[Drift]]:
    """White noise, levels, and a bias that wanders by so many sigma; the processes that are asked."""
    rng, n = np.random.default_rng(seed), POWER_ONS * RECORDS
    time_on = np.tile(np.arange(RECORDS) * 120.0, POWER_ONS)
    rho = np.exp(-np.abs(time_on[:RECORDS, None] - time_on[:RECORDS]) / 600.0)
    walk = (np.linalg.cholesky(rho) @ rng.normal(size=(RECORDS, POWER_ONS))).T.ravel()
    y = rng.normal(size=n) + np.repeat(rng.normal(size=POWER_ONS), RECORDS) + sigma * walk
    basis = np.linalg.qr(rng.normal(size=(n, COLUMNS)))[0]
    effects = RandomEffects(np.arange(0, n, RECORDS), np.ones((1, n)), np.ones((1, n)))
    return Sample(y, basis, effects, True), [Drift(np.ones(n), time_on, tau) for tau in TIMES_S]


def searched(sample: Sample, theta: np.ndarray, drifts: list[Drift]) -> np.ndarray:
    """2 log L that each process gains, by a search of its own."""
    moving = [replace(sample, effects=replace(sample.effects, drifts=(d,))) for d in drifts]
    found = [reml_roughly(m, np.append(theta, theta[0]), SETTLED_ROUGHLY).loglik for m in moving]
    return 2.0 * (np.array(found) - restricted_loglik(sample, theta))


def seconds(ask: Callable[..., np.ndarray], *given: object) -> float:
    """Of a processor, for ROUNDS answers."""
    start = time.process_time()
    for _ in range(ROUNDS):
        ask(*given)
    return time.process_time() - start


def main() -> None:
    for sigma in (0.0, 1.0):
        sample, drifts = campaign(3, sigma)
        given = sample, reml_together([sample]).theta, drifts
        promise, gain = float(promised_by(*given).max()), float(searched(*given).max())
        for told in (promise, gain):
            assert (told >= PROMISED) == (sigma > 0.0), (promise, gain)
        assert sigma == 0.0 or 0.25 * gain <= promise <= 4.0 * gain, (promise, gain)
        ratio = seconds(searched, *given) / seconds(promised_by, *given)
        print(
            f"{sigma:.0f} sigma: promised {promise:.1f}, gained {gain:.1f}; {ratio:.1f} times cheaper to ask"
        )


if __name__ == "__main__":
    main()
