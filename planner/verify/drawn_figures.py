"""The quantile of a requirement with the curves themselves, not only their second moments.

Given its curves a flight's error is Gaussian; over the curves it need not be: those that are scaled to the
largest residual have long tails, and where few nodes and few errors count these do not average out. So the
curves are drawn, the rest by its covariance.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.verify.asked import Navigation, weighed_quantile
from planner.verify.curves import Curves, Family, between
from planner.verify.draws import generator
from planner.verify.foreseen import Seen
from planner.verify.second_moments import Error, Moment

DRAWS = 60_000  # of flights: a 95 % quantile is then known to 0.4 %
POOL = 12_000, 24_000  # curves of every error, from which all of them take theirs; of 4000 figures err by 2 %
BEYOND = 200  # of them beyond the promised share: they are what its quantile is made of
AT_ONCE = 2_000  # of them that are drawn
EVERY = 4  # points of a grid that are kept, of curves without fast waves
LEAST = 0.5**31
GROUPS = 8  # of flights, each with curves of its own: what their quantiles differ by is what one may err
MOST_KEPT = 64_000_000  # bytes of pools that a process remembers
MOST_NORMALS = 128_000_000  # of normals: two sequences of 240 rows, four of a hundred
NOTHING = 1e-12  # of the largest principal variance
BLOCK = 2_000  # flights of 240 rows in 2 MB: what fits a cache is not fetched again


@dataclass(frozen=True)
class Pool:
    """Curves of one error to take from. grid: (G,) degC; values: (n, G)."""

    grid: Array
    values: NDArray[np.float32]

    def at(self, degc: Array) -> NDArray[np.float32]:
        """(n, k) at temperatures (k,), the end segments going on beyond the grid."""
        left, further = between(self.grid, degc)
        share = further.astype(np.float32)
        return np.asarray(self.values[:, left] * (1 - share) + self.values[:, left + 1] * share)


def pools_of(curves: Mapping[Error, Curves], share: float) -> dict[Error, Pool]:
    """Of the curves of every error, for quantiles of a share of the flights."""
    count = AT_ONCE * round(float(np.clip(BEYOND / max(1.0 - share, 1e-9), *POOL)) / AT_ONCE)
    return {error: _remembered(error, one, count) for error, one in curves.items()}


def _remembered(error: Error, curves: Curves, count: int) -> Pool:
    """The pool of an error's curves; another plan of the same unit asks for the same ones again."""
    key = (*error, count, type(curves), *map(_value, vars(curves).values()))
    if key not in _POOLS:
        _POOLS[key] = _pool(curves, count, generator(0, 0, "pool", *error))
        while sum(pool.values.nbytes for pool in _POOLS.values()) > MOST_KEPT and len(_POOLS) > 1:
            _POOLS.pop(next(iter(_POOLS)))
    return _POOLS[key]


def _value(field: object) -> Hashable:
    """Equal for equal fields of curves."""
    return (field.shape, field.tobytes()) if isinstance(field, np.ndarray) else repr(field)


_POOLS: dict[Hashable, Pool] = {}


def _pool(curves: Curves, count: int, rng: np.random.Generator) -> Pool:
    fast = not isinstance(curves, Family) or curves.shape == "cosines"
    kept = slice(None, None, 1 if fast else EVERY)
    drawn = [curves.drawn(AT_ONCE, rng)[:, kept].astype(np.float32) for _ in range(count // AT_ONCE)]
    return Pool(curves.grid[kept], np.concatenate(drawn))


class Quantile(NamedTuple):
    """Within which a share of drawn flights lies, and one sigma of what their number lets it err."""

    value: float
    sigma: float


def drawn_quantile(
    n: Navigation,
    flights: Sequence[Seen],
    shares: Array,
    pools: Mapping[Error, Pool],
    moments: Mapping[Error, Moment],
    p: float,
) -> Quantile:
    """Of the largest |d| over the requirement's instants; flights at S temperatures in shares (S,)."""
    rng = generator(0, 0, "drawn quantile")
    each = DRAWS // len(flights) // GROUPS * GROUPS
    longest: list[NDArray[np.float32]] = []
    # records of one temperature see one value of a curve: some ten places instead of hundreds
    asked = [np.concatenate([seen.foresight.estimates.degc, seen.degc]) for seen in flights]
    degc, place = np.unique(np.concatenate(asked), return_inverse=True)
    places = np.split(place, np.cumsum([len(one) for one in asked])[:-1])
    curves = {error: pool.at(degc) for error, pool in pools.items()}
    for i, (seen, own) in enumerate(zip(flights, places, strict=True)):
        value, vector = np.linalg.eigh(seen.rest + seen.misread(moments) + n.beside)
        notable = value > NOTHING * value[-1]
        root = (vector[:, notable] * np.sqrt(value[notable])).astype(np.float32)
        z = _remembered_normals(max(i - 1, 0), each, root.shape[1])  # figures are of the first net twice
        longest.append(_longest(z, root.T, [*_taken(seen, own, curves, each, rng)], n.instants))
    return _quantile(np.array(longest, dtype=float), shares, p)


def _quantile(longest: Array, shares: Array, p: float) -> Quantile:
    """longest: (S, each), group after group."""
    each = np.broadcast_to((shares / longest.shape[1])[:, None], longest.shape)
    groups = [
        weighed_quantile(own.ravel(), GROUPS * weights.ravel(), p)
        for own, weights in zip(np.split(longest, GROUPS, 1), np.split(each, GROUPS, 1), strict=True)
    ]
    value = weighed_quantile(longest.ravel(), each.ravel(), p)
    return Quantile(value, float(np.std(groups, ddof=1) / np.sqrt(GROUPS)))


Taken = tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32]]


def _normals(net: int, each: int, count: int) -> NDArray[np.float32]:
    """(each, count) even in their law, most so in the last columns, which are the largest components.

    A scrambled net: Owen, Scrambled net variance for integrals of smooth functions, 1997.
    """
    from scipy.special import ndtri
    from scipy.stats.qmc import Sobol

    rng = generator(0, 0, "drawn quantile")
    rng.spawn(net)  # a net spawns the next generator, and scrambles by that
    drawn = Sobol(max(count, 1), seed=rng).random_base2(int(np.ceil(np.log2(each))))[:each, :count]
    return np.asarray(ndtri(np.clip(drawn, LEAST, 1.0 - LEAST))[:, ::-1], dtype=np.float32)


def _remembered_normals(net: int, each: int, count: int) -> NDArray[np.float32]:
    """The same, kept: campaigns and families ask for the same nets, flight by flight."""
    key = net, each, count
    if key not in _NORMALS:
        _NORMALS[key] = _normals(*key)
        _NORMALS[key].flags.writeable = False
        while sum(z.nbytes for z in _NORMALS.values()) > MOST_NORMALS and len(_NORMALS) > 1:
            _NORMALS.pop(next(iter(_NORMALS)))
    _NORMALS[key] = _NORMALS.pop(key)  # what was asked for last goes last
    return _NORMALS[key]


_NORMALS: dict[tuple[int, int, int], NDArray[np.float32]] = {}


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
                yield _drawn_from(len(values), each, rng), values, whole


def _drawn_from(pool: int, each: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """(each,) which curve every flight takes: those of one group of flights are of one part of the pool."""
    part, flights = pool // GROUPS, each // GROUPS
    return np.concatenate([g * part + rng.permutation(flights) % part for g in range(GROUPS)])


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
