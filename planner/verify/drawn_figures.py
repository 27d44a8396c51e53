"""The quantile of a requirement with the curves themselves, not only their second moments.

Given its curves a flight's error is Gaussian; over the curves it need not be: those that are scaled to the
largest residual have long tails, and where few nodes and few errors count these do not average out. So the
curves are drawn, the rest by its covariance.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.verify.asked import Navigation, weighed_quantile
from planner.verify.curves import Curves, between
from planner.verify.draws import generator
from planner.verify.foreseen import Seen
from planner.verify.second_moments import Error, Moment

DRAWS = 60_000  # of flights: a 95 % quantile is then known to 0.4 %
POOL = 4_000  # curves of every error, from which all of them take theirs
NOTHING = 1e-12  # of the largest principal variance
BLOCK = 2_000  # flights of 240 rows in 2 MB: what fits a cache is not fetched again


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
    longest: list[NDArray[np.float32]] = []
    # records of one temperature see one value of a curve: some ten places instead of hundreds
    asked = [np.concatenate([seen.foresight.estimates.degc, seen.degc]) for seen in flights]
    degc, place = np.unique(np.concatenate(asked), return_inverse=True)
    places = np.split(place, np.cumsum([len(one) for one in asked])[:-1])
    curves = {error: pool.at(degc).astype(np.float32) for error, pool in pools.items()}
    for seen, own in zip(flights, places, strict=True):
        value, vector = np.linalg.eigh(seen.rest + seen.misread(moments) + n.beside)
        notable = value > NOTHING * value[-1]
        root = (vector[:, notable] * np.sqrt(value[notable])).astype(np.float32)
        fresh = not longest
        z = _first_of(rng, each, root.shape[1]) if fresh else _normals(rng, each, root.shape[1])
        longest.append(_longest(z, root.T, [*_taken(seen, own, curves, each, rng)], n.instants))
    return weighed_quantile(np.concatenate(longest), np.repeat(shares / each, each), p)


Taken = tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32]]


def _first_of(rng: np.random.Generator, each: int, count: int) -> NDArray[np.float32]:
    """(each, count) that a fresh generator of quantiles draws: the same for every campaign, drawn once."""
    z, rng.bit_generator.state = _first_normals(each, count)
    return z


def _normals(rng: np.random.Generator, each: int, count: int) -> NDArray[np.float32]:
    return rng.standard_normal((each, count), dtype=np.float32)


@lru_cache(maxsize=1)  # 60 MB for 240 rows
def _first_normals(each: int, count: int) -> tuple[NDArray[np.float32], Mapping[str, Any]]:
    rng = generator(0, 0, "drawn quantile")
    z = _normals(rng, each, count)
    z.flags.writeable = False
    return z, rng.bit_generator.state


def _taken(
    seen: Seen,
    own: NDArray[np.intp],
    curves: Mapping[Error, NDArray[np.float32]],
    each: int,
    rng: np.random.Generator,
) -> Iterator[Taken]:
    """Of every term that has curves: which one each flight takes, their values (POOL, k), weights (k, R)."""
    order = np.argsort(own, kind="stable")
    there, starts = np.unique(own[order], return_index=True)
    for error, weights in seen.of_curves().items():
        if error in curves:
            values = curves[error][:, there]
            for term in np.moveaxis(weights, 1, 0):
                whole = np.add.reduceat(term[:, order], starts, axis=1).T.astype(np.float32)
                yield rng.integers(POOL, size=each), values, whole


def _longest(
    z: NDArray[np.float32], root: NDArray[np.float32], taken: Sequence[Taken], instants: int
) -> NDArray[np.float32]:
    """(n,) largest |d| over the instants, d = z root + Σ curves · weights, so many flights at a time."""
    whole = np.concatenate([root[:0], *(weights for _, _, weights in taken)])
    found = np.empty(len(z), dtype=np.float32)
    for first in range(0, len(z), BLOCK):
        at = slice(first, first + BLOCK)
        d = z[at] @ root
        if len(whole):
            d += np.concatenate([values[which[at]] for which, values, _ in taken], axis=1) @ whole
        d *= d
        by_component = d.reshape(len(d), instants, -1)
        squares = by_component[:, :, 0].copy()
        for k in range(1, by_component.shape[2]):
            squares += by_component[:, :, k]
        found[at] = np.sqrt(squares.max(axis=1))
    return found
