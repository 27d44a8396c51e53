"""Do the intervals of a diagnosis cover as often as they say? One process, many simulated campaigns.

Every campaign (tests/calibrate/world.py, plain NumPy) hides one effect of 15 to 30 sigma; the 95 % intervals
of its coefficients, the nonlinear ones included, are compared with what was put in. Campaigns in which the
effect was not named are counted apart: there is no interval then.

    python benchmarks/study_intervals.py [campaigns an effect] [effect …]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from planner.solvers.distributions import binomial_interval
from tests.diagnose.coverage import EFFECTS, hidden_campaign

STATED = 0.95
CAMPAIGNS = 30


def main(campaigns: int, effects: tuple[str, ...]) -> None:
    """A line for every coefficient: share of the intervals that hold the truth, and what is known of it."""
    hits, tries, started = 0, 0, time.perf_counter()
    print(f"{'effect':28}{'term':16}{'named':>8}{'covered':>9}{'share':>8}   95 % of that share")
    for effect in effects:
        found = [hidden_campaign(effect, seed).covered for seed in range(campaigns)]
        named = [f for f in found if f is not None]
        for term in sorted({t for f in named for t in f}):
            inside = [f[term] for f in named if term in f]
            k, n = sum(inside), len(inside)
            low, high = binomial_interval(k, n, 0.025)
            counts = f"{f'{len(named)}/{campaigns}':>8}{f'{k}/{n}':>9}{k / n:8.3f}"
            print(f"{effect:28}{term:16}{counts}   {low:.3f} … {high:.3f}", flush=True)
            hits, tries = hits + k, tries + n
    spent = time.perf_counter() - started
    print(f"all: {hits} of {tries} intervals cover, {hits / tries:.3f} for a stated {STATED}; {spent:.0f} s")


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else CAMPAIGNS
    main(count, tuple(sys.argv[2:]) or tuple(EFFECTS))
