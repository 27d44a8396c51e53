"""Allan deviation of a rest, the noise terms in it, and the averaging time that it recommends.

σ²(τ) = 3Q²/τ² + N²/τ + B²(2 ln 2)/π + K²τ/3 + R²τ²/2        (IEEE Std 952, annex C)

Q quantisation, N random walk (white noise), B bias instability, K rate random walk, R rate ramp.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.records import Array

TERMS = ("quantisation", "white_noise", "bias_instability", "random_walk", "ramp")
LEAST_SAMPLES = 64
NORMAL_95 = 1.959964


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
    best_time: s, where the fitted deviation is least; at_end: the least lies at the longest τ, so the best time
        is at least this and the recording cannot tell
    """

    channel: str
    tau: Array
    deviation: Array
    low: Array
    high: Array
    terms: tuple[NoiseTerm, ...]
    best_time: float
    at_end: bool


def allan(values: Array, rate: float, channel: str = "") -> AllanResult:
    """Overlapping Allan deviation of (n,) readings at `rate` Hz in octaves up to a fifth of the length.

    Intervals: chi square with the equivalent degrees of freedom (Greenhall, NIST SP 1065). Raises ValueError
    for less than 64 readings.
    """
    import allantools

    if len(values) < LEAST_SAMPLES:
        raise ValueError(f"{len(values)} readings are too few for an Allan deviation; {LEAST_SAMPLES} are needed")
    steps = 2 ** np.arange(0, int(math.log2(len(values) / 5)) + 1)
    tau, deviation, _, number = allantools.oadev(
        np.asarray(values), rate=rate, data_type="freq", taus=steps / rate
    )
    freedom = degrees_of_freedom(np.rint(tau * rate), len(values))
    low, high = _interval(deviation, freedom)
    terms = fit_terms(tau, deviation, freedom)
    best, at_end = best_averaging_time(tau, deviation, terms)
    return AllanResult(channel, tau, deviation, low, high, terms, best, at_end)


def degrees_of_freedom(steps: Array, length: int) -> Array:
    """(m,) equivalent degrees of freedom of the overlapping deviation at m averaging factors, white noise.

    edf = [3(N − 1)/(2m) − 2(N − 2)/N] · 4m²/(4m² + 5)      (NIST SP 1065, table 5, white frequency noise)
    """
    m, n = steps, float(length)
    edf = (3 * (n - 1) / (2 * m) - 2 * (n - 2) / n) * 4 * m**2 / (4 * m**2 + 5)
    return np.asarray(np.maximum(edf, 1.0))


def _interval(deviation: Array, freedom: Array) -> tuple[Array, Array]:
    from scipy.stats import chi2

    low = deviation * np.sqrt(freedom / chi2.ppf(0.84134, freedom))
    high = deviation * np.sqrt(freedom / chi2.ppf(0.15866, freedom))
    return low, high


def shapes(tau: Array) -> Array:
    """(m, 5) variance at τ for one unit of each squared coefficient, in the order of TERMS."""
    one = np.ones_like(tau)
    return np.column_stack([3 / tau**2, 1 / tau, 2 * math.log(2) / math.pi * one, tau / 3, tau**2 / 2])


def fit_terms(tau: Array, deviation: Array, freedom: Array) -> tuple[NoiseTerm, ...]:
    """The five terms by non-negative least squares on σ²(τ), each point weighted by its own σ.

    σ of σ² is σ²·√(2/edf). Points of the overlapping deviation are correlated, so the intervals, which take
    them as independent, are widened by √2, the overlap of neighbouring octaves.
    """
    from scipy.optimize import nnls

    variance = deviation**2
    known = variance > 0
    if not known.any():
        return tuple(NoiseTerm(name, 0.0, 0.0, 0.0, False) for name in TERMS)
    sigma = variance[known] * np.sqrt(2 / freedom[known])
    design = shapes(tau[known]) / sigma[:, None]
    size = np.linalg.norm(design, axis=0)
    squares, _ = nnls(design / size, variance[known] / sigma)
    squares = squares / size
    spread = math.sqrt(2.0) * _standard_errors(design, squares > 0)
    return tuple(_term(*item) for item in zip(TERMS, squares.tolist(), spread.tolist(), strict=True))


def _standard_errors(design: Array, active: NDArray[np.bool_]) -> Array:
    """(5,) σ of the squares; of a term at zero: its σ beside those that are not."""
    errors = np.zeros(design.shape[1])
    for index in range(design.shape[1]):
        chosen = active.copy()
        chosen[index] = True
        part = design[:, chosen]
        size = np.linalg.norm(part, axis=0)
        covariance = np.linalg.pinv((part / size).T @ (part / size))
        place = int(chosen[:index].sum())
        errors[index] = math.sqrt(max(covariance[place, place], 0.0)) / size[place]
    return errors


def _term(name: str, square: float, sigma: float) -> NoiseTerm:
    low, high = (math.sqrt(max(square + sign * NORMAL_95 * sigma, 0.0)) for sign in (-1, 1))
    return NoiseTerm(name, math.sqrt(square), low, high, low > 0)


def best_averaging_time(tau: Array, deviation: Array, terms: tuple[NoiseTerm, ...]) -> tuple[float, bool]:
    """τ at which the fitted deviation is least, between the shortest and the longest τ, and whether at the end.

    Only a rising end tells: where the fit has no rising term the longest τ is a lower bound.
    """
    fine = np.geomspace(tau[0], tau[-1], 400)
    squares = np.array([term.value for term in terms]) ** 2
    fitted = shapes(fine) @ squares
    if not fitted.any():
        return float(tau[-1]), True
    least = float(fitted.min())
    place = int(np.flatnonzero(fitted <= least * 1.0001)[0])  # a flat bottom: its beginning, no need to wait
    rising = fitted[-1] > 1.02 * least
    return float(fine[place]), not rising and place == len(fine) - 1
