"""White and coloured noise of a rest: density, and variance and correlation time of a first-order process.

    S(f) = N² + σ² Δ (1 − a²) / (1 − 2a cos 2πfΔ + a²),   a = exp(−Δ/τ)

two-sided, of samples every Δ s (K 1.3, the shaping filter; K 4.3, "variance of white and coloured noise").
Fitted to the periodogram by Whittle's likelihood Σ (ln S + I/S), which is that of Gaussian noise for many
samples; a straight line is taken off first. K c_W of the shaping filter is a.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.nouns.array import Array

LEAST_SAMPLES = 1024
SURE = 13.8  # of twice the gain in log likelihood by two numbers: one white record in a thousand
_FIRST = 3  # lowest frequencies that the straight line has part of
_BINS = 400


@dataclass(frozen=True)
class NoiseOfSamples:
    """One channel, SI, each with its 95 % interval. white: density N; sigma, time: of the coloured part.

    sigma, time: None where the samples are as well explained by white noise alone
    """

    channel: str
    white: tuple[float, float, float]
    sigma: tuple[float, float, float] | None = None
    time: tuple[float, float, float] | None = None


def noise_of_samples(values: Array, rate: float, channel: str) -> NoiseOfSamples | None:
    """The noise of readings (n,) at rest, `rate` Hz; None for too few, or readings that stand still."""
    n, step = len(values), 1.0 / rate
    if n < LEAST_SAMPLES or np.ptp(values) == 0:
        return None
    t = np.linspace(-1.0, 1.0, n)
    rest = values - np.polynomial.polynomial.polyval(t, np.polynomial.polynomial.polyfit(t, values, 1))
    power = np.abs(np.fft.rfft(rest)[_FIRST : n // 2]) ** 2 * step / n
    f, mean, many = _binned(np.arange(_FIRST, n // 2) / (n * step), power)
    white = float(many @ mean / many.sum())
    alone = float(many @ (np.log(white) + mean / white))
    theta, value = _fitted(f, mean, many, step, white, n)
    if 2.0 * (alone - value) < SURE:
        half = 1.96 * 0.5 / np.sqrt(many.sum())
        return NoiseOfSamples(channel, _ends(0.5 * np.log(white), half))
    slope = _slopes(theta, f, step)
    information = (slope * many[:, None]).T @ slope
    halves = 1.96 * np.sqrt(np.diag(np.linalg.pinv(information)))
    return NoiseOfSamples(
        channel,
        _ends(theta[0] / 2.0, halves[0] / 2.0),
        _ends(theta[1] / 2.0, halves[1] / 2.0),
        _ends(theta[2], halves[2]),
    )


def _ends(logarithm: float, half: float) -> tuple[float, float, float]:
    return float(np.exp(logarithm)), float(np.exp(logarithm - half)), float(np.exp(logarithm + half))


def _binned(f: Array, power: Array) -> tuple[Array, Array, Array]:
    """Frequencies, mean power and how many of them, in even steps of the logarithm."""
    edges = np.unique(np.searchsorted(f, np.geomspace(f[0], f[-1] * 1.0001, _BINS)))
    first, last = edges[:-1], edges[1:]
    many = (last - first).astype(float)
    return np.add.reduceat(f, first) / many, np.add.reduceat(power[: last[-1]], first) / many, many


def _density(theta: Array, f: Array, step: float) -> Array:
    """(m,) S(f); theta: logarithms of N², σ², τ."""
    white, square, time = np.exp(theta)
    a = np.exp(-step / time)
    shape = -np.expm1(-2.0 * step / time) / (1.0 - 2.0 * a * np.cos(2.0 * np.pi * f * step) + a * a)
    return np.asarray(white + square * step * shape)


def _slopes(theta: Array, f: Array, step: float) -> Array:
    """(m, 3) derivative of ln S by theta."""
    moved = 1e-4 * np.eye(3)
    found = [np.log(_density(theta + d, f, step) / _density(theta - d, f, step)) / 2e-4 for d in moved]
    return np.stack(found, axis=1)


def _fitted(f: Array, mean: Array, many: Array, step: float, white: float, count: int) -> tuple[Array, float]:
    """Logarithms of N², σ², τ of the greatest likelihood, and its negative logarithm."""
    from scipy.optimize import minimize

    def unlikely(theta: Array) -> float:
        S = _density(theta, f, step)
        return float(many @ (np.log(S) + mean / S))

    low, high = np.log(2.0 * step), np.log(count * step / 10.0)
    box = [(np.log(white) - 20.0, np.log(white) + 5.0)] * 1 + [(np.log(white) - 30.0, np.log(white) + 30.0)]
    best, least = np.zeros(3), np.inf
    for time in np.linspace(low, high, 6)[1:-1]:
        excess = max(float(mean[:5].mean()) - white, 1e-3 * white)
        start = np.array([np.log(white), np.log(excess / (2.0 * np.exp(time))), time])
        found = minimize(unlikely, start, method="L-BFGS-B", bounds=[*box, (low, high)])
        if found.fun < least:
            best, least = np.asarray(found.x), float(found.fun)
    return best, least
