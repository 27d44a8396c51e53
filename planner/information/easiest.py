"""The campaign that loads a promise least, whatever it costs: what a refusal names, or where a search begins.

The largest load over families of curves is no less than that of any of them. A step's neighbours, hundreds of
them, are asked for the family that binds so far, and from the least of these on for the others, until no
further one can be less: the least of all, for little more than a family each.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from planner.information.even import MOST_TEMPERATURES, even, most_repeats
from planner.information.neighbours import Neighbours
from planner.information.offers import Offers
from planner.nouns.array import Array
from planner.nouns.deadline import never

MOST_STEPS = 400
EASIER = 1e-6
TOGETHER = 48  # campaigns that are evaluated together: more do not fit a cache
AHEAD = 8  # that are asked for the other families together
EASED = 1e-4  # share of the load that makes a step worth its seconds; limits are named with ten times it

ByFamily = Callable[[Array, Sequence[str]], Array]
"""Campaigns (B, g), families -> (B, families) loads."""


def easiest(
    offers: Offers,
    by_family: ByFamily,
    families: Sequence[str],
    late: Callable[[], bool] = never,
    *,
    enough: float = 0.0,
    known: Sequence[Array] = (),
) -> Array:
    """The campaign that is found to load the promise least, or so little as is enough, whatever it costs.

    From the best of those at even temperatures with the most repeats, and of what is known (g,) to load it
    little, step by step; more records are not always better, because straight lines between other
    temperatures miss another part of the curves. Where steps are too small to come to what is enough in all
    that are left, it is not looked for any further.
    """
    every = np.array([even(offers, N) for N in range(1, MOST_TEMPERATURES + 1)])
    every = np.concatenate(
        [every, np.array([most_repeats(offers, n) for n in every]), *(n[None] for n in known)]
    )
    loads = by_family(every, families)
    first = int(np.argmin(loads.max(axis=1)))
    n, own = every[first], loads[first]
    moves, worth = Neighbours(offers), EASIER if enough > 0.0 else EASED
    for left in range(MOST_STEPS, 0, -1):
        if own.max() <= enough or late():
            break
        near = moves.whatever_they_cost(n)
        if not len(near):  # all is fixed, and as often as the spec allows
            break
        best, loads = _least(near, by_family, families, int(np.argmax(own)))
        if not loads.max() < own.max() * (1.0 - worth):
            break
        hopeless = enough > 0.0 and (own.max() - loads.max()) * left < own.max() - enough
        n, own = near[best], loads
        if hopeless:
            break
    return np.asarray(n)


def _least(near: Array, by_family: ByFamily, families: Sequence[str], binding: int) -> tuple[int, Array]:
    """Which of campaigns (B, g) has the least of its largest loads, and (families,) these."""
    binds = [families[binding]]
    parts = np.array_split(near, -(-len(near) // TOGETHER))
    least = np.concatenate([by_family(part, binds)[:, 0] for part in parts])
    order = np.argsort(least, kind="stable")
    best, found = int(order[0]), np.full(len(families), np.inf)
    for begin in range(0, len(order), AHEAD):
        some = order[begin : begin + AHEAD]
        if found.max() <= least[some[0]]:
            break
        loads = by_family(near[some], families)
        k = int(np.argmin(loads.max(axis=1)))
        if loads[k].max() < found.max():
            best, found = int(some[k]), loads[k]
    return best, found
