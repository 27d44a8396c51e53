"""A campaign as one linear model: power-ons, columns, covariance, and the information that they hold.

    M = Λ + Σ_k n_k A_kᵀ V_k⁻¹ A_k,   cov(x | campaign) = M⁻¹

x: the coefficients of the declared errors (flat prior: a unit far outside its data sheet is still calibrated
rightly), then the unknowns that the power-ons share (prior Λ: planner.campaign.prior); A_k, V_k: columns and
covariance of the k-th kind of power-on, which is made n_k times. Columns depend on the records alone, what is
white on the variances too: each is worked out once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.campaign.channel_model import channel_model
from planner.campaign.estimate import Estimate, Robust
from planner.campaign.noise import Noise, Slopes, noise_model, spec_variances, with_stray
from planner.campaign.power_ons import PowerOns
from planner.campaign.prior import Prior, prior_of
from planner.campaign.triad import ALL, fit_triad
from planner.measurement import ChannelModel, Parts, evaluate, jacobian
from planner.nouns.array import Array
from planner.protocols import SENSORS, Sensor
from planner.solvers.random_effects import covariance
from planner.solvers.reml import Variances
from planner.spec.model import Spec

DEGENERATE = 1e-9  # share of the largest singular value at which a combination of columns is not seen


@dataclass(frozen=True)
class ChannelCampaign:
    """One channel of a campaign, with the variances of the spec."""

    model: ChannelModel
    runs: PowerOns
    spec: Spec
    slopes: Slopes = dict

    # ------------------------------------------------------------ what depends on the records alone

    @cached_property
    def parts(self) -> Parts:
        """The measurement equation at no error at all."""
        return evaluate(self.model, self.model.start())

    @cached_property
    def columns(self) -> Array:
        """(n, p) slope of the response at zero error by every linear coefficient."""
        return jacobian(self.model, self.model.start(), self.parts)[:, : self.model.linear]

    @cached_property
    def prior(self) -> Prior:
        """The unknowns that the power-ons share."""
        return prior_of(self.model, self.model.start(), self.parts, self.runs, self.spec)

    @cached_property
    def noise(self) -> Noise:
        """Which variances the records have."""
        every = np.ones(len(self.runs))
        unit = self.spec.unit
        found = noise_model(self.model, self.parts, self.runs, unit, every, sizes_known=True)
        return with_stray(found, self.model, self.parts, unit, every, self.slopes)

    # ------------------------------------------------------------ what depends on the variances too

    @cached_property
    def variances(self) -> Variances:
        """Their sizes."""
        shared = float(np.sum(np.mean(self.prior.columns**2, axis=0) * self.prior.sigma**2))
        return spec_variances(self.noise, self.spec.unit, shared=shared)

    def rows(self) -> Array:
        """(n + q, p + q) A with the noise made white: M = AᵀA; the prior is q pseudo-records below."""
        white = self.whiten(np.column_stack([self.columns, self.prior.columns]))
        rows = np.sqrt(np.repeat(self.runs.counts, self.runs.sizes))[:, None] * white
        p, q = self.model.linear, len(self.prior.sigma)
        pseudo = np.hstack([np.zeros((q, p)), np.diag(1.0 / self.prior.sigma)]) if q else np.empty((0, p))
        return np.vstack([rows, pseudo])

    def sigma(self) -> Array:
        """(p,) standard error of every linear coefficient, infinite where no record sees it by itself."""
        from planner.solvers.least_squares import factors

        found = factors(self.rows(), DEGENERATE)
        variance = np.diag(found.to_coefficients @ found.to_coefficients.T)
        return np.where(found.undetermined(), np.inf, np.sqrt(variance))[: self.model.linear]

    def solved(self, rows: Array) -> Array:
        """V⁻¹ r for rows (n, m)."""
        return np.asarray(covariance(self.noise.effects, self.variances.theta).solve(rows))

    def whiten(self, rows: Array) -> Array:
        """W r for rows (n, m), W V Wᵀ = I."""
        v = covariance(self.noise.effects, self.variances.theta)
        return np.asarray(v.whiten(rows))


@dataclass(frozen=True)
class Campaign:
    """The campaign of one unit: its power-ons under a spec, with the declared effects as unknowns."""

    spec: Spec
    runs: PowerOns
    effects: tuple[str, ...]
    slopes: Slopes = dict

    @cached_property
    def channels(self) -> dict[tuple[Sensor, int], ChannelCampaign]:
        """Every channel that has anything to tell."""
        found = {}
        for sensor in SENSORS:
            for channel in range(3):
                model = channel_model(sensor, channel, self.runs.conditions, self.effects)
                if model.carried:
                    found[sensor, channel] = ChannelCampaign(model, self.runs, self.spec, self.slopes)
        return found

    def estimate(
        self, sensor: Sensor, readings: Array, robust: Robust = "no", channels: Sequence[int] = ALL
    ) -> list[Estimate]:
        """The coefficients of a sensor's channels from readings (n, 3). Raises TooFewRecords for too few.

        channels: which are asked for; all three come where they have a coefficient in common
        """
        return fit_triad(sensor, readings, self.runs, self.spec, self.effects, robust, channels, self.slopes)


def campaign(
    spec: Spec,
    runs: PowerOns,
    effects: Sequence[str] | None = None,
    slopes: Slopes = dict,
) -> Campaign:
    """The campaign of a spec with its declared effects, unless others are named."""
    return Campaign(spec, runs, tuple(spec.effects if effects is None else effects), slopes)
