"""The noise of one channel and its whitening: white, growing with the input, and drawn anew every power-on.

    cov(e) = σ_w² diag(1/T) + σ_c² I + σ_r² diag(u²) + Σ_runs (σ_u² 1 1ᵀ + σ_s² u uᵀ),

variances by REML under a rich model (declared effects, every candidate, every generic alternative), so that
what hides does not inflate them. With fewer than 20 power-ons their level is a fixed effect of each: a spread
cannot be told from so few, and effects between power-ons are then untestable.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.learn.channel_model import EXCITING
from planner.learn.diagnosis.channels import Channel
from planner.records import Array
from planner.solvers.least_squares import factors
from planner.solvers.mixed_model import (
    Covariance,
    RandomEffects,
    Variances,
    covariance,
    reml,
    reml_information,
)

LEAST_RUNS = 20
MOST_ROWS = 4000  # for the variances; more rows tell nothing that a campaign's decision needs
ROUNDING = 1e-9  # of the largest reading: data without any noise still have this much
MEDIAN = 0.67  # sigma: what a variance estimated as zero may well be, the middle of half a normal law


@dataclass(frozen=True)
class ChannelNoise:
    """What whitens a channel. fixed_runs: (n, g − 1) indicators of the runs when their level is fixed.

    components: names of the variances in the order of `variances.theta`
    """

    covariance: Covariance
    variances: Variances
    components: tuple[str, ...]
    fixed_runs: Array
    starts: NDArray[np.int64]

    def whiten(self, columns: Array) -> Array:
        """V^(−1/2) (n, m)."""
        return self.covariance.whiten(columns)

    @property
    def spread(self) -> Array:
        """(n,) one sigma of a row about its run."""
        return np.asarray(np.sqrt(self.covariance.diagonal))

    def shares(self, white: Array) -> list[Array]:
        """What each variance gives to the covariance of whitened columns U (n, m): θ_k UᵀV^(−½)V_kV^(−½)U.

        They add up to UᵀU.
        """
        W = self.covariance.whiten(white)
        effects, theta = self.covariance.effects, self.variances.theta
        return [theta[k] * (W.T @ effects.times(k, W)) for k in range(effects.count)]

    @property
    def relative_error(self) -> Array:
        """(K, K) covariance of the variances' estimates, relative to them."""
        theta = np.maximum(self.variances.theta, 1e-300)
        return np.asarray(self.variances.error / np.outer(theta, theta))


def channel_noise(
    c: Channel, starts: NDArray[np.int64], duration: Array, rich: Array, weights: Array
) -> ChannelNoise:
    """The noise of a channel whose rows stand run by run from `starts`.

    rich: (n, k) columns of all candidates; weights: (n,) 1, or near 0 for a row that is an outlier
    """
    few = len(starts) < LEAST_RUNS
    fixed = _indicators(starts, len(c.r)) if few else np.empty((len(c.r), 0))
    alone = len(starts) == len(c.r)  # one row a run: its spread is the noise
    diagonals = _diagonals(c, duration, weights)
    slopes = {} if few or alone else _slopes(c)
    X = np.column_stack([c.J, rich, fixed])
    effects = _effects(starts, diagonals, slopes)
    rows, firsts = _sample(starts, len(c.r))
    part = RandomEffects(firsts, effects.diagonals[:, rows], effects.slopes[:, rows])
    rounding = ROUNDING * float(np.abs(c.y).max(initial=1e-30))
    found = _reml(c.r[rows], X[rows], c.J[rows], part, rounding)
    return ChannelNoise(covariance(effects, found.theta), found, (*diagonals, *slopes), fixed, starts)


def _reml(r: Array, rich: Array, plain: Array, effects: RandomEffects, least_noise: float) -> Variances:
    """REML under the rich model; under the declared one when the rows are too few for the rich.

    A variance that comes out as zero is set to what it may well be: with six runs on a centrifuge it often
    comes out as zero, and every curve over the load would then be significant.
    """
    basis = factors(rich, 1e-5).basis
    if len(r) - basis.shape[1] < max(10, len(effects.starts) // 4):
        basis = factors(plain, 1e-7).basis
    theta = np.zeros(effects.count)
    theta[0] = max(float(np.var(r)), 1e-30)
    try:
        found = reml(r, basis, effects)
        if found.theta[: len(effects.diagonals)].any():
            theta = found.theta
    except ValueError:
        pass
    theta = np.where(np.arange(len(theta)) == 0, np.maximum(theta, least_noise**2), theta)
    error = np.asarray(np.linalg.pinv(reml_information(basis, effects, theta), hermitian=True), dtype=float)
    least = MEDIAN * np.sqrt(np.maximum(np.diag(error), 0.0))
    theta = np.asarray(np.where(theta > 0, theta, least), dtype=float)
    return Variances(theta, error, theta > 0, 0.0, True)


def _effects(
    starts: NDArray[np.int64], diagonals: dict[str, Array], slopes: dict[str, Array]
) -> RandomEffects:
    n = len(next(iter(diagonals.values())))
    stacked = np.array([*slopes.values()]) if slopes else np.empty((0, n))
    return RandomEffects(starts, np.array([*diagonals.values()]), stacked)


def _diagonals(c: Channel, duration: Array, weights: Array) -> dict[str, Array]:
    duration = np.where(duration > 0, duration, 1.0)
    found = {"white": duration.mean() / duration / weights}
    if duration.max() > 1.5 * duration.min():
        found["constant"] = 1.0 / weights
    if np.abs(c.u).max(initial=0.0) > EXCITING[c.sensor] * (1.0 if c.sensor == "gyro" else 6.0):
        found["rate_noise"] = c.u**2 / weights
    return found


def _slopes(c: Channel) -> dict[str, Array]:
    found = {"run_to_run_bias": np.ones(len(c.r))}
    if np.ptp(np.abs(c.u)) > EXCITING[c.sensor]:
        found["run_to_run_scale_factor"] = c.u
    return found


def _indicators(starts: NDArray[np.int64], n: int) -> Array:
    sizes = np.diff(np.append(starts, n))
    return np.repeat(np.eye(len(starts))[:, 1:], sizes, axis=0)


def _sample(starts: NDArray[np.int64], n: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of evenly chosen whole runs, about MOST_ROWS of them, and where each run starts among them."""
    sizes = np.diff(np.append(starts, n))
    runs = np.arange(len(starts))
    if n > MOST_ROWS and len(starts) > 4 * LEAST_RUNS:
        keep = max(4 * LEAST_RUNS, int(len(starts) * MOST_ROWS / n))
        runs = np.unique(np.linspace(0, len(starts) - 1, keep).astype(int))
    rows = np.concatenate([np.arange(starts[i], starts[i] + sizes[i]) for i in runs])
    return rows, np.concatenate([[0], np.cumsum(sizes[runs])[:-1]])
