"""Study: the search against all campaigns that there are, over random small specs.

    python benchmarks/study_shortest.py [--cases 1000] [--first 0]

Every case (tests/information/cases.py) gets the limits that one of its campaigns, drawn at random, just
keeps; then all campaigns are counted out. Those that cost less than the plan and come within 2 % of keeping
the limits by the quick figures are asked by the exact ones. Printed: how often the plan was longer than the
shortest campaign and by how much, how often it was proved, and every fault: a bound above the optimum, a
`proved` plan that is none, a plan that breaks its limits, a refusal of limits that can be kept.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # the cases are the tests' own

from planner.errors import PlannerError
from planner.information.choose import campaign_found
from planner.nouns.array import Array
from tests.information import cases

LARGEST = 2_500  # campaigns of a case that are counted out
MARGIN = 1.02  # of a limit by quick figures; the exact ones are some 1 % smaller at most
USELESS = 1e6  # m: no spec may ask for as little
ROOM = 1.005  # between a campaign's figure and the limit that it keeps


@dataclass(frozen=True)
class Judged:
    """One case. cost, bound, best: s of the plan, of its bound, of the shortest campaign that there is."""

    seed: int
    campaigns: int
    cost: float
    bound: float
    best: float
    proved: bool
    fault: str = ""

    @property
    def longer(self) -> float:
        """By which share the plan is longer than the shortest campaign."""
        return self.cost / self.best - 1.0


def judged(seed: int, largest: int = LARGEST, *, thorough: bool = False) -> Judged | None:
    """The plan of one case against all its campaigns; None where it has too many, or none that does."""
    made = cases.tree(seed)
    every = cases.Everything(cases.flight(made))
    if not 2 <= every.size <= largest:
        return None
    counts = every.counts()
    quick = every.quick(counts)
    good = np.flatnonzero(np.all(np.isfinite(quick), axis=1))
    if not len(good):
        return None
    chosen = counts[np.random.default_rng(seed).choice(good)]
    limits = np.array(every.exact(chosen).largest) * ROOM
    if limits.max() > USELESS:
        return None
    asked = cases.flight(cases.limited(made, limits))
    return _against(seed, cases.Everything(asked), counts, quick / limits, limits, thorough)


def _against(
    seed: int, every: cases.Everything, counts: Array, loads: Array, limits: Array, thorough: bool
) -> Judged:
    try:
        found = campaign_found(every.flight, effort="thorough" if thorough else "usual")
    except PlannerError as error:
        return Judged(seed, len(counts), np.inf, 0.0, np.inf, False, f"refused: {error}")
    shorter = next(every.shorter(counts, found.cost, loads.max(axis=1), MARGIN), None)
    best = found.cost if shorter is None else float(every.offers.cost(shorter[None])[0])
    fault = []
    if np.any(np.array(every.exact(found.counts).largest) > limits * (1.0 + 1e-5)):
        fault.append("breaks its limits")
    if found.bound > best + 1e-3:
        fault.append(f"bound {found.bound:.3f} above the optimum {best:.3f}")
    if found.proved and found.cost > best + 1e-3:
        fault.append(f"proved, and {found.cost - best:.3f} s longer than the shortest")
    if abs(every.hours(found.counts) - found.cost) > 1e-3:
        fault.append("its steps take another time than it costs")
    return Judged(seed, len(counts), found.cost, found.bound, best, found.proved, "; ".join(fault))


def report(made: list[Judged]) -> None:
    """What the cases come to."""
    kept = [j for j in made if np.isfinite(j.cost)]
    longer = [j.longer for j in kept if j.longer > 1e-9]
    gaps = [1.0 - j.bound / j.cost for j in kept]
    print(f"{len(made)} cases, {sum(j.campaigns for j in made)} campaigns")
    print(
        f"proved: {sum(j.proved for j in kept)}; gap: median {np.median(gaps):.1%}, largest {max(gaps):.1%}"
    )
    print(f"longer than the shortest campaign: {len(longer)}, by at most {max(longer, default=0.0):.2%}")
    for j in made:
        if j.fault:
            print(f"fault, case {j.seed}: {j.fault}")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    made: list[Judged] = []
    seed = options.first
    while len(made) < options.cases:
        one = judged(seed)
        seed += 1
        if one is None:
            continue
        made.append(one)
        if one.fault or one.longer > 1e-9:
            print(f"{one} longer by {one.longer:.2%}", flush=True)
        if len(made) % 50 == 0:
            print(f"{len(made)} cases", flush=True)
    report(made)


if __name__ == "__main__":
    main()
