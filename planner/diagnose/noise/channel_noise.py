"""The noise of one channel and its whitening: white, growing with the input, and drawn anew every power-on.

    cov(e) = σ_w² diag(1/T) + σ_c² I + σ_r² diag(u²) + σ_x² diag(|ω|² − u²) + Σ_runs (σ_u² 1 1ᵀ + σ_s² u uᵀ),

variances by REML under a full model (declared effects, every candidate, every generic alternative), so that
what hides does not inflate them; where that is too many columns, under those that the likelihood asks for
(`hidden_columns`). With fewer than 8 power-ons their level is a fixed effect of each: a spread cannot be told
from so few, and effects between power-ons are then untestable. How well each variance is known, of a dozen
power-ons by a few degrees of freedom, is in every test (Satterthwaite).

What moves within power-ons, where the rows show that something does (`wander`), is one more of them,

    σ_m² exp(−|Δt| / τ) in every power-on

and so are misalignments and other coefficients of the declared model that differ from power-on to power-on,
where they show that (`shown_noise`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.channels.unseen_runs import cells_of
from planner.diagnose.noise.components import (
    drawn_of_power_ons,
    finest,
    indicators,
    is_level,
    own_of_rows,
    random_effects,
)
from planner.nouns.array import Array
from planner.solvers.block_covariance import BlockCovariance
from planner.solvers.group_batches import sums_of_groups
from planner.solvers.least_squares import factors
from planner.solvers.random_effects import Covariance, Drift, RandomEffects, covariance
from planner.solvers.reml import Variances, reml_and_information
from planner.solvers.reml_beside import Rough, reml_roughly
from planner.solvers.restricted_likelihood import Sample, reml_information, restricted_loglik

LEAST_RUNS = 8  # power-ons, from which their spread is a variance: a triad then tells it by 15 degrees
ROUGHLY = 1.0  # of the log-likelihood where columns are weighed, which must gain five times as much
SETTLED = 1e-3  # of the log-likelihood: a decision needs no variance to less than 5 % of its error
MOST_ROWS = 1000  # for the variances; more rows tell nothing that a campaign's decision needs
ROUNDING = 1e-9  # of the largest reading: data without any noise still have this much
TOLD = 1e-5  # of a column's length that must be left beside a model, or it says nothing new
TOLD_APART = 1e-9  # of the information, each variance in its own units: less is rounding
MEDIAN = 0.67  # sigma: what a variance estimated as zero may well be, the middle of half a normal law


@dataclass(frozen=True)
class ChannelNoise:
    """What whitens a channel. fixed_runs: (n, g − 1) indicators of the runs when their level is fixed.

    components: names of the variances in the order of `variances.theta`; sample: rows and columns they are
        judged from; drawn: as in Readings
    known: (n, k) whitened columns of coefficients that are known beforehand, each times its sigma
    rows: the noise as the rows alone say, where a budget was asked beside them
    """

    covariance: Covariance | BlockCovariance
    variances: Variances
    components: tuple[str, ...]
    fixed_runs: Array
    starts: NDArray[np.int64]
    sample: Sample
    drawn: tuple[str, ...] = ()
    known: Array | None = None
    rows: ChannelNoise | None = None

    @property
    def by_rows(self) -> ChannelNoise:
        """The noise as the rows alone say: what is held against a budget has none of the budget in it."""
        return self.rows or self

    def whiten(self, columns: Array) -> Array:
        """V^(−1/2) (n, m); (I + K Kᵀ)^(−1/2) V^(−1/2) with what is known beforehand, K = U s Wᵀ."""
        return self._beside_known(self.covariance.whiten(columns))

    def _beside_known(self, white: Array) -> Array:
        if self._known is None:
            return white
        U, s = self._known
        return np.asarray(white - (U * (1.0 - 1.0 / np.sqrt(1.0 + s**2))) @ (U.T @ white))

    def levels(self, white: Array) -> tuple[Array, Array]:
        """(g, g) LᵀL and (g, m) Lᵀ white (n, m), L the white levels of the power-ons, by sums over these."""
        own = self.covariance.whiten(np.ones((len(white), 1)))[:, 0]
        gram = np.diag(np.add.reduceat(own**2, self.starts))
        if self._known is not None:
            U, s = self._known
            along = sums_of_groups(U, self.starts, own)
            gram = gram - (along * (s**2 / (1.0 + s**2))) @ along.T
        return gram, sums_of_groups(self._beside_known(white), self.starts, own)

    @cached_property
    def _known(self) -> tuple[Array, Array] | None:
        if self.known is None:
            return None
        U, s, _ = np.linalg.svd(self.known, full_matrices=False)
        return U, s

    @property
    def spread(self) -> Array:
        """(n,) one sigma of a row about its run."""
        return np.asarray(np.sqrt(self.covariance.diagonal))

    @property
    def with_power_on(self) -> Array:
        """(n,) one sigma of what a row shares with all rows of its power-on: √Σ σ_k² z_k²."""
        effects = self.covariance.effects
        first = len(effects.diagonals)
        return np.asarray(
            np.sqrt(self.variances.theta[first : first + len(effects.slopes)] @ effects.slopes**2)
        )

    def without_drifts(self) -> ChannelNoise:
        """What whitens the channel where nothing moves within power-ons."""
        effects = replace(self.covariance.effects, drifts=())
        return replace(self, covariance=covariance(effects, self.variances.theta[: effects.count]))

    @cached_property
    def information(self) -> Array:
        """(K, K) expected information on the variances at their estimates, of all of them."""
        return reml_information(self.sample, self.variances.theta)

    @cached_property
    def relative_error(self) -> Array:
        """(K, K) covariance of the variances' estimates, relative to them; 0 for a variance that is zero."""
        size = np.outer(self.variances.theta, self.variances.theta)
        return np.divide(self.variances.error, size, out=np.zeros_like(size), where=size > 0)


@dataclass(frozen=True)
class Readings:
    """What the noise of one channel is judged from: rows run by run from `starts`.

    blocks: (n, k) columns of each candidate; weights: (n,) 1, or near 0 for a row that is an outlier
    least_runs: power-ons from which their spread is a variance; with fewer each has a level of its own
    moves: (q,) columns of the declared model that can move the rows at all; None: all of them
    drifts: processes within power-ons that the rows show, by the names of their variances
    drawn: effects of which they show that their coefficients differ from power-on to power-on
    """

    channel: Channel
    starts: NDArray[np.int64]
    duration: Array
    blocks: tuple[Array, ...]
    weights: Array
    least_runs: int = LEAST_RUNS
    moves: NDArray[np.bool_] | None = None
    drifts: Mapping[str, Drift] = field(default_factory=dict)
    drawn: tuple[str, ...] = ()

    @property
    def candidates(self) -> Array:
        """(n, k) columns of all candidates."""
        return np.column_stack([np.empty((len(self.channel.r), 0)), *self.blocks])

    @property
    def declared(self) -> Array:
        """(n, q') columns of the declared model under which the variances are told."""
        J = self.channel.J
        return J if self.moves is None else J[:, self.moves]

    @property
    def fixed(self) -> Array:
        """(n, g − 1) indicators of the runs where these are few: their level is then fixed."""
        few, n = len(self.starts) < self.least_runs, len(self.channel.r)
        return indicators(self.starts, n) if few else np.empty((n, 0))

    @property
    def conditions(self) -> Array:
        """(n, k) indicators of the conditions: what no model of the channel leaves is scatter within one."""
        cells = cells_of(self.channel.model.conditions)
        return np.eye(int(cells.max(initial=-1)) + 1)[cells]

    @cached_property
    def spanned(self) -> Array:
        """(m, r) orthonormal columns of the full model, at the rows that tell the variances.

        Of a level of every condition where these are too few for the full, beside the declared one where
        they are enough for that: what it leaves of rows made alike is scatter without it too. Of the declared
        one where no conditions come again either.
        """
        rows, firsts = judged_rows(self.starts, len(self.channel.r))
        declared, *blocks, fixed = (x[rows] for x in (self.declared, *self.blocks, self.fixed))
        most = len(rows) - least_freedom(firsts)
        full = factors(np.column_stack([declared, *blocks, fixed]), TOLD).basis
        if blocks and full.shape[1] > most:
            conditions = np.column_stack([self.conditions[rows], fixed])
            full = factors(np.column_stack([declared, conditions]), TOLD).basis
            full = full if full.shape[1] <= most else factors(conditions, TOLD).basis
        return full if full.shape[1] <= most else factors(np.column_stack([declared, fixed]), 1e-7).basis

    @cached_property
    def judged(self) -> Judged:
        """What is estimated from them: asked when columns are weighed, and again for the variances."""
        return _judged(self)

    def with_noise(self, **changes: Any) -> Readings:
        """The same with other `drifts`, `drawn` or `weights`; what the columns span is handed on."""
        other = replace(self, **changes)
        other.__dict__["spanned"] = self.spanned
        return other


def plain_spread(c: Channel, starts: NDArray[np.int64], duration: Array, weights: Array) -> Array:
    """(n,) one sigma of each row, of its weight, about its power-on under the declared model alone."""
    return channel_noise(plain_readings(c, starts, duration, weights)).spread


def plain_readings(c: Channel, starts: NDArray[np.int64], duration: Array, weights: Array) -> Readings:
    """What the noise of a channel is judged from under the declared model alone."""
    return Readings(c, starts, duration, (), weights)


def channel_noise(readings: Readings) -> ChannelNoise:
    """The noise of one channel by itself."""
    judged = readings.judged
    return noise_of(judged, *without_zeros([judged.own]))


def noise_of(j: Judged, v: Variances) -> ChannelNoise:
    """The noise of a channel with these variances."""
    return ChannelNoise(covariance(j.effects, v.theta), v, j.components, j.fixed, j.starts, j.sample, j.drawn)


@dataclass(frozen=True)
class Judged:
    """A channel's variances to be estimated. sample: rows and fixed effects; effects: of all rows

    least: (K,) below which nothing is believed; drawn: as in Readings
    """

    sample: Sample
    effects: RandomEffects
    components: tuple[str, ...]
    fixed: Array
    starts: NDArray[np.int64]
    least: Array
    drawn: tuple[str, ...] = ()

    @cached_property
    def rough(self) -> Rough:
        """By itself, to ROUGHLY: where columns are weighed, and where `own` begins."""
        effects = self.sample.effects
        even = max(float(np.var(self.sample.left)), self.least[0]) / effects.count / effects.mean_sizes()
        return reml_roughly(self.sample, np.maximum(even, self.least), ROUGHLY)

    @cached_property
    def own(self) -> Variances:
        """By itself: asked when the triad is looked at, and beside what hides in another channel."""
        return own_variances(self)


def _judged(given: Readings) -> Judged:
    c, starts, fixed = given.channel, given.starts, given.fixed
    few = len(starts) < given.least_runs
    alone = len(starts) == len(c.r)  # one row a run: its spread is the noise
    diagonals = own_of_rows(c, given.duration, given.weights)
    drawn = {} if alone else drawn_of_power_ons(c, given.drawn, len(starts))
    slopes = {name: z for name, z in drawn.items() if not (few and is_level(z, starts))}
    effects = replace(random_effects(starts, diagonals, slopes), drifts=tuple(given.drifts.values()))
    rows, firsts = judged_rows(starts, len(c.r))
    within = tuple(d.at(rows) for d in effects.drifts)
    part = RandomEffects(firsts, effects.diagonals[:, rows], effects.slopes[:, rows], within)
    least = np.zeros(effects.count)
    least[0] = max(ROUNDING * float(np.abs(c.y).max(initial=1e-30)), finest(c)) ** 2
    return Judged(
        Sample(c.r[rows], given.spanned, part, True),
        effects,
        (*diagonals, *slopes, *given.drifts),
        fixed,
        starts,
        least,
        given.drawn,
    )


def least_freedom(starts: NDArray[np.int64]) -> int:
    """Rows beside a model's columns, with fewer of which no variance is told."""
    return max(10, len(starts) // 4)


def own_variances(j: Judged) -> Variances:
    """REML of one channel; all its noise is white where the rows allow no more."""
    theta = np.zeros(j.effects.count)
    theta[0] = max(float(np.var(j.sample.y)), 1e-30)
    try:
        found, information = reml_and_information([j.sample], _start(j), SETTLED)
        if found.theta[: len(j.effects.diagonals)].any():
            if np.all(found.theta >= j.least):
                error = found.error if found.free.all() else inverse_of(information)
                return replace(found, error=error, free=found.theta > 0, converged=True)
            theta = found.theta
    except ValueError:
        pass
    theta = np.maximum(theta, j.least)
    error = inverse_of(reml_information(j.sample, theta))
    return Variances(theta, error, theta > 0, restricted_loglik(j.sample, theta), True)


def _start(j: Judged) -> Array | None:
    """(K,) where the search for a channel's variances begins; None where nothing is left of the rows."""
    if len(j.sample.y) <= j.sample.basis.shape[1]:
        return None
    return j.rough.theta if np.isfinite(j.rough.loglik) else None


def without_zeros(found: Sequence[Variances], some: NDArray[np.bool_] | None = None) -> list[Variances]:
    """A variance that comes out as zero is set to what it may well be; some: (K,) of which, None: all.

    With six runs on a centrifuge it often does, and every curve over the load would then be significant.
    """
    out = []
    for v in found:
        least = MEDIAN * np.sqrt(np.maximum(np.diag(v.error), 0.0))
        kept = (v.theta > 0) if some is None else (v.theta > 0) | ~some
        out.append(replace(v, theta=np.asarray(np.where(kept, v.theta, least), dtype=float)))
    return out


def inverse_of(information: Array) -> Array:
    """Covariance (K, K) of what the rows tell; every variance in its own units, and never a negative one.

    Where every power-on has one record at a rate, noise that goes with the rate and a scale factor that
    changes between power-ons are one and the same variance: what rounding leaves of their difference is
    no information.
    """
    unit = np.sqrt(np.maximum(np.diag(information), 0.0))  # rounding of what few rows tell
    unit = np.where(unit > 0, unit, 1.0)
    inverse = np.linalg.pinv(information / np.outer(unit, unit), rcond=TOLD_APART, hermitian=True)
    return np.asarray(inverse / np.outer(unit, unit), dtype=float)


def covariance_of_free(information: Array, free: NDArray[np.bool_]) -> Array:
    """The same (K, K) where some came out as zero and are held there: 0 for these. free: (K,) the others."""
    covariance = np.zeros_like(information)
    covariance[np.ix_(free, free)] = inverse_of(information[np.ix_(free, free)])
    return covariance


def judged_rows(starts: NDArray[np.int64], n: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows of evenly chosen whole runs, about MOST_ROWS of them, and where each run starts among them."""
    sizes = np.diff(np.append(starts, n))
    runs = np.arange(len(starts))
    if n > MOST_ROWS and len(starts) > 4 * LEAST_RUNS:
        keep = max(4 * LEAST_RUNS, int(len(starts) * MOST_ROWS / n))
        runs = np.unique(np.linspace(0, len(starts) - 1, keep).astype(int))
    rows = np.concatenate([np.arange(starts[i], starts[i] + sizes[i]) for i in runs])
    return rows, np.concatenate([[0], np.cumsum(sizes[runs])[:-1]])
