"""At which start of a flight a requirement stands worst."""

from __future__ import annotations

import numpy as np

from planner.spec.model import PercentileRule
from planner.verify.asked import covariances, figure
from planner.verify.variances import AtStarts, Moments


def worst_of(at: AtStarts, family: str, moments: Moments) -> int:
    """Which of the starts, with the curves of a family.

    Over many instants the one at which an instant is worst by its mean square, for draws at all starts take
    long.
    """
    n = at.asked
    if n.instants > 1 or not isinstance(n.wanted.rule, PercentileRule):
        squares = at.variances(family, moments).reshape(len(at.degc), n.instants, -1).sum(axis=2)
        return int(np.argmax(squares.max(axis=1)))
    every = covariances(n, at.seen, {family: moments})[family]
    return int(np.argmax([figure(n, one[None], np.ones(1)) for one in every]))
