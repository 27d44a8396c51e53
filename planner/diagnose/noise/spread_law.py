"""How an estimated variance scatters: the law of Satterthwaite, shifted by what it is told from.

A variance between power-ons comes out of a larger one, that of their means, from which the noise of the
records has gone: of g power-ons with m records each (θ̂ + σ²/m) / (θ + σ²/m) is χ² over its g − 1 degrees of
freedom. In general, with the standard error of θ̂ a straight line in θ,

    sd(θ) = (θ + s) √(2 / f),   (θ̂ + s) / (θ + s) ~ χ²_f / f,

f and s from the information at θ̂ and where it is half of that. Without the shift an estimate of one and a
half standard errors would refuse a tenth of itself at 95 %, which it does not.
Source: F. E. Satterthwaite, Biometrics Bulletin 2 (1946) 110, for s = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.diagnose.noise.channel_noise import SETTLED, ChannelNoise, covariance_of_free
from planner.nouns.array import Array
from planner.solvers.distributions import chi_square_quantile, chi_square_tail
from planner.solvers.reml import reml_together
from planner.solvers.restricted_likelihood import reml_information, restricted_loglik

NORMAL = 1e5  # degrees of freedom, from which the law is normal


@dataclass(frozen=True)
class SpreadLaw:
    """Of an estimate θ̂ of a variance: freedom f and shift s."""

    theta: float
    freedom: float
    shift: float

    def tail(self, theta: float) -> float:
        """Chance of an estimate as large where the variance is θ."""
        return float(chi_square_tail(self.freedom * self._over(theta), self.freedom))

    def _over(self, theta: float) -> float:
        return (self.theta + self.shift) / max(theta + self.shift, 1e-300)

    def end(self, p: float) -> float:
        """The variance whose estimates are as large as this with chance p; never a negative one."""
        over = self.freedom / float(chi_square_quantile(1.0 - p, self.freedom))
        return max((self.theta + self.shift) * over - self.shift, 0.0)


def spread_law(theta: float, error: float, half: float) -> SpreadLaw:
    """Of an estimate, its standard error there and where the variance is half of it (same unit as theta)."""
    growth = max(error - half, 0.0)
    freedom = min(0.5 * (theta / growth) ** 2, NORMAL) if growth > 0.0 else NORMAL
    return SpreadLaw(theta, freedom, max(error * np.sqrt(freedom / 2.0) - theta, 0.0))


def errors(noise: ChannelNoise, here: Sequence[int]) -> tuple[float, float]:
    """Standard error of the sum of some variances: at the estimate, and where each of them is half of it."""
    theta = noise.variances.theta.copy()
    theta[list(here)] /= 2.0
    half = reml_information(noise.sample, theta)
    return _error(noise, noise.information, here), _error(noise, half, here)


def _error(noise: ChannelNoise, information: Array, here: Sequence[int]) -> float:
    covariance = covariance_of_free(information, noise.variances.free)
    return float(np.sqrt(max(covariance[np.ix_(here, here)].sum(), 0.0)))


def refused(noises: Sequence[ChannelNoise], here: Sequence[int], theta: float) -> float:
    """Chance of rows that speak as much for a larger variance of some components than θ: half a χ²_1.

    2 (Σ log L at what they told − Σ log L at θ), restricted likelihoods of the channels with all their other
    variances at their best: noise of the records that came out too small may take up what moves among them.
    """
    gain = 0.0
    for noise in noises:
        told = noise.variances.theta[list(here)]
        if told.sum() <= theta:
            return 1.0
        share = told / told.sum()
        try:
            gain += 2.0 * (_best(noise, here, told) - _best(noise, here, theta * share))
        except ValueError:  # rows that leave no noise refuse nothing
            return 1.0
    return 0.5 * float(chi_square_tail(gain, 1)) if gain > 0.0 else 1.0


def _best(noise: ChannelNoise, here: Sequence[int], held: Array) -> float:
    """Restricted log-likelihood with some of the variances held (k,) and the others at their best."""
    e = noise.sample.effects
    size = np.ones(e.count)
    size[list(here)] = np.maximum(held, 1e-300)
    sample = replace(noise.sample, effects=replace(e.scaled(size), known=tuple(here)))
    start = np.where(np.isin(np.arange(e.count), here), 1.0, noise.variances.theta)
    return restricted_loglik(sample, reml_together([sample], start, SETTLED).theta)
