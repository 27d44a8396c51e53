"""At which starts of a flight a requirement may stand worst."""

from __future__ import annotations

import numpy as np

from planner.nouns.array import Array
from planner.spec.model import PercentileRule
from planner.verify.asked import covariances, figure
from planner.verify.variances import AtStarts, Moments

PEAKS = 2
NEARLY = 0.8  # of the largest: what long tails make of a quantile is less than a quarter


def badness(at: AtStarts, family: str, moments: Moments) -> Array:
    """(S,) how bad each of the starts is, with the curves of a family.

    Over many instants the mean square where an instant is worst, as a length: draws at all starts take long.
    """
    n = at.asked
    if n.instants > 1 or not isinstance(n.wanted.rule, PercentileRule):
        squares = at.variances(family, moments).reshape(len(at.degc), n.instants, -1).sum(axis=2)
        return np.asarray(np.sqrt(squares.max(axis=1)))
    every = covariances(n, at.seen, {family: moments})[family]
    return np.array([figure(n, one[None], np.ones(1)) for one in every])


def peaks(bad: Array) -> list[int]:
    """Places (of S,) where it is worse than beside them and nearly as bad as anywhere, the worst first."""
    around = np.concatenate([[-np.inf], bad, [-np.inf]])
    found = np.flatnonzero((bad >= around[:-2]) & (bad >= around[2:]) & (bad >= NEARLY * bad.max()))
    return [int(i) for i in found[np.argsort(-bad[found], kind="stable")][:PEAKS]]
