"""Allan deviation of a rest, the noise terms in it, and the averaging time that it recommends.

σ²(τ) = 3Q²/τ² + N²/τ + B²(2 ln 2)/π + K²τ/3 + R²τ²/2        (IEEE Std 952, annex C)

Q quantisation, N random walk (white noise), B bias instability, K rate random walk, R rate ramp.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.solvers.distributions import chi_square_quantile

TERMS = ("quantisation", "white_noise", "bias_instability", "random_walk", "ramp")
RISING = ("random_walk", "ramp")
LEAST_SAMPLES = 64
CHI_SQUARE_95 = 3.841459
ROUNDS = 6
# octaves of the overlapping deviation share what they tell: with 3.5 the 95 % intervals of white noise and
# random walk hold in 92 … 99 % of 1200 simulated recordings, with 2 in 83 … 95 %
OVERLAP = 3.5


@dataclass(frozen=True)
class NoiseTerm:
    """One coefficient in SI with its 95 % interval; `seen`: its interval does not reach zero."""

    name: str
    value: float
    low: float
    high: float
    seen: bool


@dataclass(frozen=True)
class AllanResult:
    """Overlapping Allan deviation of one channel.

    tau: (m,) s; deviation: (m,) in the channel's SI unit; low, high: (m,) 68 % interval by chi square
    best_time: s, where the fitted deviation is least; at_end: the least lies at the longest τ, so the best
        time is at least this and the recording cannot tell
    """

    channel: str
    tau: Array
    deviation: Array
    low: Array
    high: Array
    terms: tuple[NoiseTerm, ...]
    best_time: float
    at_end: bool


@dataclass(frozen=True)
class NoiseFit:
    """The five terms; freedom: (m,) degrees of freedom of each τ; rises: whether a rising term is needed."""

    terms: tuple[NoiseTerm, ...]
    freedom: Array
    rises: bool


def allan(values: Array, rate: float, channel: str = "") -> AllanResult:
    """Overlapping Allan deviation of (n,) readings at `rate` Hz in octaves up to a fifth of the length.

    Intervals: chi square with the equivalent degrees of freedom (Greenhall, NIST SP 1065). Raises ValueError
    for less than 64 readings.
    """
    import allantools

    if len(values) < LEAST_SAMPLES:
        raise ValueError(
            f"{len(values)} readings are too few for an Allan deviation; {LEAST_SAMPLES} are needed"
        )
    steps = 2 ** np.arange(0, int(math.log2(len(values) / 5)) + 1)
    tau, deviation, _, _ = allantools.oadev(
        np.asarray(values), rate=rate, data_type="freq", taus=steps / rate
    )
    kinds = degrees_of_freedom(np.rint(tau * rate), len(values))
    fit = fit_noise(tau, deviation, kinds)
    low, high = _interval(deviation, fit.freedom)
    best, at_end = best_averaging_time(tau, fit)
    return AllanResult(channel, tau, deviation, low, high, fit.terms, best, at_end)


def degrees_of_freedom(steps: Array, length: int) -> Array:
    """(m, 5) equivalent degrees of freedom of the overlapping deviation, for each kind of noise in TERMS.

    NIST SP 1065, table 5, N readings, averaging factor m:
    white phase (quantisation)      (N + 1)(N − 2m) / (2(N − m))
    white frequency                 [3(N − 1)/(2m) − 2(N − 2)/N] · 4m²/(4m² + 5)
    flicker frequency               2(N − 2)²/(2.3N − 4.9) at m = 1, else 5N²/(4m(N + 3m))
    random walk frequency, ramp     (N − 2)/m · [(N − 1)² − 3m(N − 1) + 4m²]/(N − 3)²
    """
    m, n = steps, float(length)
    phase = (n + 1) * (n - 2 * m) / (2 * (n - m))
    white = (3 * (n - 1) / (2 * m) - 2 * (n - 2) / n) * 4 * m**2 / (4 * m**2 + 5)
    flicker = np.where(m == 1, 2 * (n - 2) ** 2 / (2.3 * n - 4.9), 5 * n**2 / (4 * m * (n + 3 * m)))
    walk = (n - 2) / m * ((n - 1) ** 2 - 3 * m * (n - 1) + 4 * m**2) / (n - 3) ** 2
    return np.asarray(np.maximum(np.column_stack([phase, white, flicker, walk, walk]), 1.0))


def _interval(deviation: Array, freedom: Array) -> tuple[Array, Array]:
    low = deviation * np.sqrt(freedom / chi_square_quantile(0.84134, freedom))
    high = deviation * np.sqrt(freedom / chi_square_quantile(0.15866, freedom))
    return low, high


def shapes(tau: Array) -> Array:
    """(m, 5) variance at τ for one unit of each squared coefficient, in the order of TERMS."""
    one = np.ones_like(tau)
    return np.column_stack([3 / tau**2, 1 / tau, 2 * math.log(2) / math.pi * one, tau / 3, tau**2 / 2])


# ---------------------------------------------------------------- terms


@dataclass(frozen=True)
class _Problem:
    """Least squares of the squared coefficients: design (m, 5), target (m,), each row over its own σ."""

    design: Array
    target: Array

    def best(self, free: NDArray[np.bool_] | None = None) -> tuple[Array, float]:
        """(5,) squares >= 0, zero where not free, and χ²."""
        from scipy.optimize import nnls

        chosen = np.ones(len(TERMS), dtype=bool) if free is None else free
        size = np.linalg.norm(self.design, axis=0)
        squares = np.zeros(len(TERMS))
        squares[chosen] = nnls(self.design[:, chosen] / size[chosen], self.target)[0] / size[chosen]
        return squares, float(((self.target - self.design @ squares) ** 2).sum())

    def least(self, index: int, square: float) -> float:
        """χ² when one square is held and the others follow."""
        others = np.arange(len(TERMS)) != index
        held = _Problem(self.design, self.target - self.design[:, index] * square)
        return held.best(others)[1]


def fit_noise(tau: Array, deviation: Array, kinds: Array) -> NoiseFit:
    """The five terms by non-negative least squares on σ²(τ), each point weighted by its own σ.

    kinds: (m, 5) degrees of freedom. σ of σ² is σ²·√(2/edf), with the fitted σ², else points that fell low by
    chance would weigh most. The intervals are profiles: every value that leaves χ² within 3.84 of its least
    while the other terms follow, so that terms which the data cannot tell apart are both wide. Neighbouring
    octaves overlap, so χ² is divided by 3.5.
    """
    known = deviation > 0
    if not known.any():
        nothing = tuple(NoiseTerm(name, 0.0, 0.0, 0.0, False) for name in TERMS)
        return NoiseFit(nothing, kinds[:, 1], False)
    variance, bare = deviation[known] ** 2, shapes(tau[known])
    model, share = variance, np.full(bare.shape, 1.0 / len(TERMS))
    for _ in range(ROUNDS):
        freedom = 1.0 / (share / kinds[known]).sum(axis=1)  # of a mixture, by the share of each kind
        sigma = model * np.sqrt(2 * OVERLAP / freedom)
        problem = _Problem(bare / sigma[:, None], variance / sigma)
        squares, chi_square = problem.best()
        parts = bare * squares
        model = np.maximum(parts.sum(axis=1), 1e-6 * variance)
        share = parts / model[:, None] + 1e-9
        share /= share.sum(axis=1, keepdims=True)
    level = problem.best(np.array([name not in RISING for name in TERMS]))[1]
    terms = tuple(_profile(problem, i, float(squares[i]), chi_square) for i in range(len(TERMS)))
    whole = kinds[:, 1].copy()
    whole[known] = freedom
    return NoiseFit(terms, whole, level - chi_square > CHI_SQUARE_95)


def _profile(problem: _Problem, index: int, square: float, chi_square: float) -> NoiseTerm:
    """The term with its interval: where χ² has risen by 3.84."""
    limit = chi_square + CHI_SQUARE_95
    step = 1.0 / float(np.linalg.norm(problem.design[:, index]))  # its σ if all else were known
    high = square + step
    while problem.least(index, high) < limit:
        high = square + 2 * (high - square)
    upper = _crossing(problem, index, square, high, limit)
    lower = 0.0 if problem.least(index, 0.0) < limit else _crossing(problem, index, square, 0.0, limit)
    value, low, high = (math.sqrt(x) for x in (square, lower, upper))
    return NoiseTerm(TERMS[index], value, low, high, low > 0)


def _crossing(problem: _Problem, index: int, inside: float, outside: float, limit: float) -> float:
    """The square at which χ² reaches the limit, to a thousandth of the way."""
    for _ in range(12):
        middle = (inside + outside) / 2
        if problem.least(index, middle) < limit:
            inside = middle
        else:
            outside = middle
    return (inside + outside) / 2


def best_averaging_time(tau: Array, fit: NoiseFit) -> tuple[float, bool]:
    """τ at which the fitted deviation is least, from the shortest to the longest τ, and whether at the end.

    Only a rise that is seen tells: without one the longest τ is a lower bound, since a longer rest may show
    that averaging goes on to help. White noise N and random walk K have the least at τ = √3 N/K.
    """
    fine = np.geomspace(tau[0], tau[-1], 400)
    fitted = shapes(fine) @ np.array([term.value for term in fit.terms]) ** 2
    place = int(np.argmin(fitted))
    if not fit.rises or place == len(fine) - 1:
        return float(tau[-1]), True
    return float(fine[place]), False
