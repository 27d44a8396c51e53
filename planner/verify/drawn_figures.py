"""The quantile of a requirement with the curves themselves, not only their second moments.

Given its curves a flight's error is Gaussian; over the curves it need not be: those that are scaled to the
largest residual have long tails, and where few nodes and few errors count these do not average out. So the
curves are drawn, the rest by its covariance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from planner.nouns.array import Array
from planner.verify.asked import Navigation, weighed_quantile
from planner.verify.curves import Curves, between
from planner.verify.draws import generator
from planner.verify.foreseen import Seen
from planner.verify.second_moments import Error, Moment

DRAWS = 60_000  # of flights: a 95 % quantile is then known to 0.4 %
POOL = 4_000  # curves of every error, from which all of them take theirs
NOTHING = 1e-12  # of the largest principal variance


@dataclass(frozen=True)
class Pool:
    """Curves of one error to take from. grid: (G,) degC; values: (POOL, G)."""

    grid: Array
    values: Array

    def at(self, degc: Array) -> Array:
        """(POOL, k) at temperatures (k,), the end segments going on beyond the grid."""
        left, share = between(self.grid, degc)
        return np.asarray(self.values[:, left] * (1.0 - share) + self.values[:, left + 1] * share)


def pools_of(curves: Mapping[Error, Curves]) -> dict[Error, Pool]:
    """Of the curves of every error."""
    return {
        error: Pool(one.grid, one.drawn(POOL, generator(0, 0, "pool", *error)))
        for error, one in curves.items()
    }


def drawn_quantile(
    n: Navigation,
    flights: Sequence[Seen],
    shares: Array,
    pools: Mapping[Error, Pool],
    moments: Mapping[Error, Moment],
    p: float,
) -> float:
    """Of the largest |d| over the requirement's instants; flights at S temperatures in shares (S,)."""
    rng = generator(0, 0, "drawn quantile")
    each = DRAWS // len(flights)
    longest = []
    # records of one temperature see one value of a curve: some ten places instead of hundreds
    asked = [np.concatenate([seen.foresight.estimates.degc, seen.degc]) for seen in flights]
    degc, place = np.unique(np.concatenate(asked), return_inverse=True)
    places = np.split(place, np.cumsum([len(one) for one in asked])[:-1])
    curves = {error: pool.at(degc).astype(np.float32) for error, pool in pools.items()}
    for seen, own in zip(flights, places, strict=True):
        value, vector = np.linalg.eigh(seen.rest + seen.misread(moments) + n.beside)
        notable = value > NOTHING * value[-1]
        root = (vector[:, notable] * np.sqrt(value[notable])).astype(np.float32)
        d = rng.standard_normal((each, root.shape[1]), dtype=np.float32) @ root.T
        there, column = np.unique(own, return_inverse=True)
        for error, weights in seen.of_curves().items():
            if error in curves:
                for term in np.moveaxis(weights, 1, 0):
                    whole = np.zeros((len(there), len(term)), dtype=np.float32)
                    np.add.at(whole, column, term.T)
                    d += curves[error][np.ix_(rng.integers(POOL, size=each), there)] @ whole
        longest.append(np.linalg.norm(d.reshape(each, n.instants, -1), axis=2).max(axis=1))
    return weighed_quantile(np.concatenate(longest), np.repeat(shares / each, each), p)
