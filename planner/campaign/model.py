"""A campaign as one linear model: power-ons, columns, covariance, and the information that they hold.

    M = Λ + Σ_k n_k A_kᵀ V_k⁻¹ A_k,   cov(x | campaign) = M⁻¹

x: the coefficients of the declared errors (flat prior: a unit far outside its data sheet is still calibrated
rightly), then the unknowns that the power-ons share (prior Λ: planner.campaign.prior); A_k, V_k: columns and
covariance of the k-th kind of power-on, which is made n_k times. Columns depend on the records alone, what is
white on the variances too: each is worked out once and handed on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.campaign.channel_model import channel_model
from planner.campaign.estimate import Estimate, Robust
from planner.campaign.noise import Noise, noise_model, spec_variances
from planner.campaign.power_ons import PowerOns
from planner.campaign.prior import Prior, prior_of
from planner.campaign.triad import ALL, fit_triad
from planner.measurement import ChannelModel, Column, Parts, evaluate, jacobian
from planner.nouns.array import Array
from planner.protocols import SENSORS, Sensor
from planner.solvers.random_effects import covariance
from planner.solvers.reml import Variances
from planner.spec.model import Spec

DEGENERATE = 1e-9  # share of the largest singular value at which a combination of columns is not seen


@dataclass(frozen=True)
class Known:
    """What a campaign tells of the coefficients of one channel.

    columns: which they are (p,); sigma: (p,) standard deviation, infinite where it is unobservable
    covariance: (p, p) of what is observable; undetermined: (p,) in a combination that no record sees
    whole: (p + q, p + q) covariance of the shared unknowns as well
    """

    columns: tuple[Column, ...]
    sigma: Array
    covariance: Array
    undetermined: NDArray[np.bool_]
    whole: Array


@dataclass(frozen=True)
class ChannelCampaign:
    """One channel of a campaign. variances: those of the spec unless others are given."""

    model: ChannelModel
    runs: PowerOns
    spec: Spec
    given: Variances | None = None

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
        return noise_model(self.model, self.parts, self.runs, self.spec.unit, every, sizes_known=True)

    # ------------------------------------------------------------ what depends on the variances too

    @cached_property
    def variances(self) -> Variances:
        """Their sizes."""
        if self.given is not None:
            return self.given
        shared = float(np.sum(np.mean(self.prior.columns**2, axis=0) * self.prior.sigma**2))
        return spec_variances(self.noise, self.spec.unit, shared=shared)

    @cached_property
    def white(self) -> Array:
        """(n, p + q) columns and shared unknowns with the noise made white, power-on by power-on."""
        return self.whiten(np.column_stack([self.columns, self.prior.columns]))

    @cached_property
    def per_run(self) -> Array:
        """(g, p + q, p + q) A_kᵀ V_k⁻¹ A_k: what one of each kind of power-on tells."""
        products = np.einsum("na,nb->nab", self.white, self.white)
        return np.asarray(np.add.reduceat(products, self.runs.starts, axis=0))

    # ------------------------------------------------------------ questions

    def information(self, counts: Array | None = None) -> Array:
        """(p + q, p + q) M for counts (g,), those of the campaign by default."""
        n = self.runs.counts if counts is None else counts
        return np.asarray(np.diag(self._prior_precision) + np.einsum("g,gab->ab", n, self.per_run))

    @property
    def _prior_precision(self) -> Array:
        return np.concatenate([np.zeros(self.model.linear), self.prior.sigma**-2.0])

    def known(self, counts: Array | None = None) -> Known:
        """What the campaign, made as `counts` (g,) say, tells of every coefficient."""
        p = self.model.linear
        return _known(self.model.columns()[:p], self.rows(counts), p)

    def rows(self, counts: Array | None = None) -> Array:
        """(n + q, p + q) A with the noise made white: M = AᵀA; the prior is q pseudo-records below."""
        n = self.runs.counts if counts is None else np.asarray(counts, dtype=np.float64)
        rows = np.sqrt(np.repeat(n, self.runs.sizes))[:, None] * self.white
        p, q = self.model.linear, len(self.prior.sigma)
        pseudo = np.hstack([np.zeros((q, p)), np.diag(1.0 / self.prior.sigma)]) if q else np.empty((0, p))
        return np.vstack([rows, pseudo])

    def whiten(self, rows: Array) -> Array:
        """W r for rows (n, m), W V Wᵀ = I."""
        v = covariance(self.noise.effects, self.variances.theta)
        return np.asarray(v.whiten(rows))

    def revised(self, *, variances: Variances | None = None, counts: Array | None = None) -> ChannelCampaign:
        """The same with other variances or counts; what does not depend on them is handed on."""
        new = replace(
            self,
            given=self.given if variances is None else variances,
            runs=self.runs if counts is None else self.runs.counted(counts),
        )
        for name in ("parts", "columns", "noise", *(("prior",) if counts is None else ())):
            if name in vars(self):
                vars(new)[name] = vars(self)[name]
        if variances is None and counts is not None and len(self.prior.sigma) == 0:
            for name in ("variances", "white", "per_run", "prior"):
                if name in vars(self):
                    vars(new)[name] = vars(self)[name]
        return new


def _known(columns: tuple[Column, ...], rows: Array, p: int) -> Known:
    from planner.solvers.least_squares import factors

    found = factors(rows, DEGENERATE)
    undetermined = found.undetermined()[:p]
    C = found.to_coefficients @ found.to_coefficients.T
    sigma = np.where(undetermined, np.inf, np.sqrt(np.maximum(np.diag(C)[:p], 0.0)))
    return Known(columns, sigma, C[:p, :p], undetermined, C)


@dataclass(frozen=True)
class Campaign:
    """The campaign of one unit: its power-ons under a spec, with the declared effects as unknowns."""

    spec: Spec
    runs: PowerOns
    effects: tuple[str, ...]

    @cached_property
    def channels(self) -> dict[tuple[Sensor, int], ChannelCampaign]:
        """Every channel that has anything to tell."""
        found = {}
        for sensor in SENSORS:
            for channel in range(3):
                model = channel_model(sensor, channel, self.runs.conditions, self.effects)
                if model.carried:
                    found[sensor, channel] = ChannelCampaign(model, self.runs, self.spec)
        return found

    def estimate(
        self, sensor: Sensor, readings: Array, robust: Robust = "no", channels: Sequence[int] = ALL
    ) -> list[Estimate]:
        """The coefficients of a sensor's channels from readings (n, 3). Raises TooFewRecords for too few.

        channels: which are asked for; all three come where they have a coefficient in common
        """
        return fit_triad(sensor, readings, self.runs, self.spec, self.effects, robust, channels)


def campaign(spec: Spec, runs: PowerOns, effects: Sequence[str] | None = None) -> Campaign:
    """The campaign of a spec with its declared effects, unless others are named."""
    return Campaign(spec, runs, tuple(spec.effects if effects is None else effects))
