"""The quantile of a requirement with the curves themselves, not only their second moments.

    d = m + G + Σ_e Σ_t w_e(t) f_e(t),   G ~ N(0, Σ_rest)

m is what curves have in common that were measured on several units; all f_e have mean zero. Given its curves
a flight's error is Gaussian; over the curves it need not be: those that a table scales to their largest
residual have long tails, and where few nodes and few errors count these do not average out. So the curves of
the errors that matter are drawn, the rest goes by its covariance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from planner.information.curve_weights import CurveWeights, Error
from planner.information.in_flight import Asked
from planner.information.whole_flights import AT_ONCE, Flights, length_of_share
from planner.nouns.array import Array
from planner.solvers.length_share import length_within, variances_along

DRAWS = 60_000  # of flights: a 95 % quantile is then known to 0.2 ... 0.4 %, by the tails of its curves
ROUGH = 15_000  # for what is only shown: 0.4 ... 0.8 %
ANY = 2  # times as many where all of a flight is drawn
BEYOND = 150  # flights at least that are left out by a requirement's share: they make its quantile
LEAST = 30  # th part of them at each temperature
NOTABLE = 0.01  # of the mean square: what smaller parts lack of a Gaussian goes with the square of this
MOST_KEPT = 250_000  # flights of which it is kept which curves they take: 2 MB a part
SETTLED = 3e-4  # the last step of secants: what it leaves is a hundredth of it
HALVED_TO = 1e-6  # where secants did not end
LEFT_OUT = 1e-7  # of the largest principal variance
TINY = 1e-12
AWAY = 1.01  # times the guess: the second point of the first secant
SECANTS = 12
PILOT = 16  # th part of the flights, by which a quantile is first looked for
SHORTER = 0.9  # times that one: flights which cannot be longer are not looked at
LARGEST = 1e15  # length whose square single precision has: a vertical channel without aiding grows for ever
WORST = 2  # temperatures at which the worst one is looked for by draws


class Drawn(Protocol):
    """What flights are by draws."""

    def quantile(self) -> float:
        """The length within which the requirement's share of them is."""

    def are_within(self, length: float) -> bool:
        """Whether the requirement's share of them is: as the quantile says, without looking for it."""


def drawn(
    a: Asked,
    rest: Array,
    parts: Sequence[tuple[CurveWeights, Array]],
    pool: Callable[[Error], NDArray[np.float32]],
    draws: int = DRAWS,
    shift: Array | None = None,
) -> Drawn | None:
    """The flights of a requirement; None at a single instant without curves, of which all is Gaussian.

    rest: (S, ρ, ρ) covariance without curves; parts: with their own (S, ρ, ρ); pool: error -> (N, n) curves
    draws: flights over all temperatures; shift: (S, ρ) of d in every flight; None: none
    """
    assert a.share is not None
    m = np.zeros(rest.shape[:2]) if shift is None else shift
    every = sum((own for _, own in parts), rest + m[..., :, None] * m[..., None, :])
    whole = np.einsum("srr->s", every)
    if (size := float(np.sqrt(whole.max()))) > LARGEST:
        least = [(part.times(1.0 / size), own / size**2) for part, own in parts]
        smaller = drawn(a, rest / size**2, least, pool, draws, m / size)
        return None if smaller is None else _Larger(smaller, size)
    notable = list[CurveWeights]()
    for part, own in parts:
        if np.any(np.einsum("srr->s", own) > NOTABLE * whole):
            notable.append(part)
        else:
            rest = rest + own
    if not notable and not m.any() and a.response.shape[1] == 1:
        return None
    curves = {error: pool(error) for error in dict.fromkeys(p.error for p in notable)}
    looked_at = _looked_at(a, whole)
    weights = None if a.weights is None else a.weights[looked_at]
    draws = max(draws, int(BEYOND / max(1.0 - a.share, 1e-5)))
    if a.response.shape[1] > 1:
        return _at_any(a, rest, m, notable, curves, looked_at, weights, ANY * draws)
    near, here = nearly(a, every), [p.on(looked_at) for p in notable]
    return _at_one(a, rest[looked_at], m[looked_at], here, curves, weights, near, draws)


@dataclass(frozen=True)
class _Larger:
    """Flights that are drawn a size smaller, in numbers of single precision."""

    smaller: Drawn
    size: float

    def quantile(self) -> float:
        return self.size * self.smaller.quantile()

    def are_within(self, length: float) -> bool:
        return self.smaller.are_within(length / self.size)


def nearly(a: Asked, S: Array) -> float:
    """The quantile of |d| at one instant, as if all were Gaussian; S: (S, c, c)."""
    along, c = variances_along(S)
    assert a.share is not None
    return float(length_within(along, c, a.share, a.weights))


def _looked_at(a: Asked, whole: Array) -> NDArray[np.intp]:
    """All temperatures, or where only the worst counts the few that are worst by mean square.

    Of neighbours only one: far from it tails may be longer.
    """
    if a.weights is not None:
        return np.arange(len(whole))
    around = np.concatenate([[-np.inf], whole, [-np.inf]])
    peaks = np.flatnonzero((whole >= around[:-2]) & (whole >= around[2:]))
    return np.asarray(peaks[np.argsort(-whole[peaks], kind="stable")][:WORST])


# ---------------------------------------------------------------- at one instant


@dataclass(frozen=True)
class _AtOne:
    """Flights at one instant, of which the largest principal component of what is Gaussian is not drawn:

        P(|d| <= r) = ⟨ ½ erf((h + b)/√2σ) + ½ erf((h − b)/√2σ) ⟩,   h² = r² − |the other components|²

    sigma: (s, 1) √2 σ of that component; beside: (s, n) squares of the others; along: (s, n) b
    near: about the quantile
    """

    share: float
    weights: Array | None
    sigma: NDArray[np.float32]
    beside: NDArray[np.float32]
    along: NDArray[np.float32]
    near: float

    def missing(self, length: float) -> float:
        """What the share within a length lacks of the one that is asked."""
        from scipy.special import erf

        h = np.sqrt(np.maximum(np.float32(length**2) - self.beside, 0.0))
        both = erf((h + self.along) / self.sigma) + erf((h - self.along) / self.sigma)
        inside = 0.5 * both.mean(axis=1, dtype=np.float64)
        return float(self.share - (inside.min() if self.weights is None else inside @ self.weights))

    def quantile(self) -> float:
        return _root(self.missing, self.near)

    def are_within(self, length: float) -> bool:
        return self.missing(length) <= 0.0


def _at_one(
    a: Asked,
    rest: Array,
    shift: Array,
    parts: Sequence[CurveWeights],
    curves: Mapping[Error, NDArray[np.float32]],
    weights: Array | None,
    near: float,
    draws: int,
) -> _AtOne:
    assert a.share is not None
    value, axes = np.linalg.eigh(rest)
    sigma = np.sqrt(2.0 * np.maximum(value[:, -1:], TINY * value[:, -1:].max())).astype(np.float32)
    d = _normals(*_size(rest, draws)) * np.sqrt(np.maximum(value, 0.0)).astype(np.float32)[:, :, None]
    d[:, -1] = 0.0
    d += (np.swapaxes(axes, 1, 2) @ shift[:, :, None]).astype(np.float32)
    _add(d, [p.along(axes) for p in parts], curves, 0)
    return _AtOne(a.share, weights, sigma, np.einsum("scn,scn->sn", d[:, :-1], d[:, :-1]), d[:, -1], near)


def _root(missing: Callable[[float], float], near: float) -> float:
    """Where a falling function is zero: by secants from a guess that is seldom 3 % off, else by halving."""
    from scipy.optimize import brentq

    first, length = near, near * AWAY
    lacked, lacks = missing(first), missing(length)
    for _ in range(SECANTS):
        if lacks == lacked:
            break
        step = lacks * (length - first) / (lacks - lacked)
        first, lacked = length, lacks
        length = float(np.clip(length - step, 0.8 * length, 1.25 * length))
        if abs(length - first) <= SETTLED * length:
            return length
        lacks = missing(length)
    low, high = 0.97 * near, 1.03 * near
    while missing(low) < 0.0:
        low *= 0.9
    while missing(high) > 0.0:
        high *= 1.1
    return float(brentq(missing, low, high, rtol=HALVED_TO))


# ---------------------------------------------------------------- at any moment


@dataclass(frozen=True)
class _AtAny:
    """Whole flights: the instants of one go together.

    Along the principal axes a flight is one place x, and its largest |d| at most |x| times what any instant
    makes of a unit of it. Only flights that may be beyond a length somewhat shorter than the quantile are
    looked at instant by instant; that all others are shorter is all that the quantile asks of them.

    n: flights at each temperature; longest: (s, n) of so many the largest |d|, where it may exceed another
    """

    share: float
    weights: Array | None
    n: int
    longest: Callable[[int, float], NDArray[np.float32]]

    def quantile(self) -> float:
        pilot = self.longest(-(-self.n // PILOT), 0.0)
        least = SHORTER * length_of_share(pilot, self.share, self.weights)
        found = length_of_share(self.longest(self.n, least), self.share, self.weights)
        whole = found > least
        return found if whole else length_of_share(self.longest(self.n, 0.0), self.share, self.weights)

    def are_within(self, length: float) -> bool:
        beyond = np.mean(self.longest(self.n, length) > length, axis=1)
        return bool((beyond.max() if self.weights is None else beyond @ self.weights) <= 1.0 - self.share)


def _at_any(
    a: Asked,
    rest: Array,
    shift: Array,
    parts: Sequence[CurveWeights],
    curves: Mapping[Error, NDArray[np.float32]],
    looked_at: NDArray[np.intp],
    weights: Array | None,
    draws: int,
) -> _AtAny:
    assert a.share is not None
    basis, c = _basis(rest, parts), a.response.shape[2]
    axes, m = basis.astype(np.float32), shift[looked_at].astype(np.float32)
    along = [p.on(looked_at).along(np.broadcast_to(basis, (len(m), *basis.shape))) for p in parts]
    value, vector = np.linalg.eigh(basis.T @ rest[looked_at] @ basis)
    root = (vector * np.sqrt(np.maximum(value, 0.0))[:, None, :]).astype(np.float32)

    def longest(n: int, least: float) -> NDArray[np.float32]:
        at_once, found = max(AT_ONCE // (n * basis.shape[1]), 1), []
        for start in range(0, len(m), at_once):
            some = np.arange(start, min(start + at_once, len(m)))
            x = root[some] @ _normals(len(some), n, basis.shape[1])
            _add(x, [p.on(some) for p in along], curves, start)
            found.append(Flights(axes, x, m[some], c).beyond(least))
        return np.concatenate(found)

    return _AtAny(a.share, weights, _each(len(m), draws), longest)


def _basis(rest: Array, parts: Sequence[CurveWeights]) -> Array:
    """(ρ, k) principal axes of everything that flights do: instants of one flight differ by little."""
    spread = [rest.sum(axis=0)]
    for part in parts:
        flat = np.swapaxes(part.weights, 0, 1).reshape(rest.shape[-1], -1)
        spread.append(flat @ flat.T)
    total = sum(x / max(float(np.trace(x)), TINY) for x in spread)
    value, vector = np.linalg.eigh(total)
    return np.asarray(vector[:, value > LEFT_OUT * value[-1]])


# ---------------------------------------------------------------- draws


def _size(rest: Array, draws: int) -> tuple[int, int, int]:
    """Temperatures, flights at each of them, rows; rest: (s, ρ, ρ)."""
    return len(rest), _each(len(rest), draws), rest.shape[-1]


def _each(temperatures: int, draws: int) -> int:
    """Flights at each temperature."""
    return max(draws // temperatures, draws // LEAST)


def _add(
    d: NDArray[np.float32],
    parts: Sequence[CurveWeights],
    curves: Mapping[Error, NDArray[np.float32]],
    seed: int,
) -> None:
    """Curves to flights d (s, ρ, n), others at every temperature; one is as likely as its opposite."""
    flights, pools = d.shape[0] * d.shape[2], tuple(curves[part.error].shape[1] for part in parts)
    for part, (which, sign) in zip(parts, _taken(flights, seed, pools), strict=True):
        part.add_to(d, curves[part.error], which.reshape(len(d), -1), sign.reshape(len(d), -1))


Taken = tuple[NDArray[np.int32], NDArray[np.float32]]


def _taken(flights: int, seed: int, pools: tuple[int, ...]) -> Iterable[Taken]:
    """(flights,) which of so many curves each flight takes of a part, and (flights,) its sign.

    The same for every campaign and family; those of many flights are not kept.
    """
    return _kept(flights, seed, pools) if flights <= MOST_KEPT else _drawn(flights, seed, pools)


@lru_cache(maxsize=16)
def _kept(flights: int, seed: int, pools: tuple[int, ...]) -> tuple[Taken, ...]:
    return tuple(_drawn(flights, seed, pools))


def _drawn(flights: int, seed: int, pools: tuple[int, ...]) -> Iterator[Taken]:
    rng = np.random.default_rng(seed)
    for curves in pools:
        which = rng.permutation(flights) % (2 * curves)  # every curve as often as any other
        opposite = which >= curves
        sign = np.where(opposite, np.float32(-1.0), np.float32(1.0))
        yield (which - curves * opposite).astype(np.int32), sign


@cache
def _normals(s: int, n: int, rows: int) -> NDArray[np.float32]:
    """(s, rows, n), the same for every campaign, so that campaigns are told apart by what they are.

    Richtmyer's points, the fractions of k √p_i + u_i for the primes p_i (Niederreiter, Bulletin of the AMS
    84, 1978, 957), √2 for the last row, the largest component: quantiles scatter by a quarter less than over
    independent draws. scipy.stats with its Sobol points, almost half, takes a quarter of a second to import.
    """
    from scipy.special import ndtri

    primes = [p for p in range(2, 40 + 12 * rows) if all(p % q for q in range(2, math.isqrt(p) + 1))][:rows]
    begin = np.random.default_rng(0).random(rows)
    even = (np.sqrt(primes)[::-1, None] * np.arange(1, s * n + 1) + begin[:, None]) % 1.0
    drawn = ndtri(np.clip(even, 0.5**31, 1.0 - 0.5**31)).astype(np.float32)
    return np.ascontiguousarray(np.swapaxes(drawn.reshape(rows, s, n), 0, 1))
