"""What the other budgets let differ, as the estimate of a spread sees it.

The noise model V(θ) = Σ θ_k V_k lacks most of what the spec's budgets draw at every power-on and let move
within it: misalignments that differ from power-on to power-on look like noise of the records at six faces,
or like a process where a dozen turns follow each other in one attitude; a bias that moves among them looks
like a scale factor's own spread. With V_e = Σ x xᵀ over the power-ons, x (n,) the column of a term times the
sigma of its budget, or x xᵀ ∘ exp(−|Δt| / τ) of what moves within them, the estimate is to the first order

    E θ̂ = θ + F⁻¹ Σ_e g_e,   F_kl = ½ tr P V_k P V_l,   g_ke = ½ tr P V_k P V_e,

P of the restricted likelihood at θ̂ (MINQUE: Rao, J. Multivariate Analysis 1 (1971) 445).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.diagnose.channels.channel import Channel, usual_columns
from planner.diagnose.noise.channel_noise import ChannelNoise, covariance_of_free, judged_rows
from planner.nouns.array import Array
from planner.solvers.random_effects import Drift, RandomEffects
from planner.solvers.restricted_likelihood import Sample, reml_information
from planner.spec.budget import ErrorBudget

LARGEST = 256  # rows of a power-on; of more as many, evenly chosen, see the same

Part = tuple[str, str]  # error and part of its budget


@dataclass(frozen=True)
class Seen:
    """Of one channel. taken: (K, E) what each of the parts (E,) adds to each θ_k; covariance: (K, K) of θ̂."""

    parts: tuple[Part, ...]
    taken: Array
    covariance: Array

    def of(self, here: Sequence[int], own: Part) -> float:
        """What all parts but its own add to the sum of some components; never less than nothing."""
        others = [e for e, part in enumerate(self.parts) if part != own]
        return max(float(self.taken[np.ix_(here, others)].sum()), 0.0)

    def error(self, here: Sequence[int]) -> float:
        """Variance of the sum of some components."""
        return float(self.covariance[np.ix_(here, here)].sum())


def seen(noise: ChannelNoise, c: Channel, time_on: Array, budgets: Mapping[str, ErrorBudget]) -> Seen:
    """What the budgets of a sensor add to the variances of a channel; time_on: (n,) s since power-on."""
    rows, _ = judged_rows(noise.starts, len(time_on))
    drawn = [(part, x[rows]) for part, x in between(c, budgets)]
    moving = [(part, d.at(rows)) for part, d in _within(c, time_on, budgets)]
    e = noise.sample.effects
    before = len(e.diagonals) + len(e.slopes)
    slopes = np.vstack([e.slopes, *(x[None, :] for _, x in drawn)])
    every = RandomEffects(e.starts, e.diagonals, slopes, (*e.drifts, *(d for _, d in moving)))
    after = before + len(drawn)
    own = np.concatenate([np.arange(before), np.arange(after, after + len(e.drifts))])
    other = np.setdiff1d(np.arange(every.count), own)
    theta = np.zeros(every.count)
    theta[own] = noise.variances.theta
    information = reml_information(thinned(replace(noise.sample, effects=every)), theta)
    covariance = covariance_of_free(information[np.ix_(own, own)], noise.variances.free)
    parts = tuple(part for part, _ in (*drawn, *moving))
    return Seen(parts, covariance @ information[np.ix_(own, other)], covariance)


def between(c: Channel, budgets: Mapping[str, ErrorBudget]) -> Iterator[tuple[Part, Array]]:
    """x (n,) of every term of every error that each power-on draws anew."""
    temperature = c.model.conditions.temperature_degc
    for name, budget in budgets.items():
        if budget.has_run_to_run:
            for x in usual_columns(c, name):
                yield (name, "run_to_run"), x * budget.run_to_run_sigma(temperature)


def _within(c: Channel, time_on: Array, budgets: Mapping[str, ErrorBudget]) -> Iterator[tuple[Part, Drift]]:
    """The process of every term of every error that moves within a power-on."""
    for name, budget in budgets.items():
        if budget.in_run_sigma:
            for x in usual_columns(c, name):
                yield (name, "in_run"), Drift(x * budget.in_run_sigma, time_on, budget.in_run_time)


def thinned(sample: Sample) -> Sample:
    """A sample with no more rows of a power-on than LARGEST."""
    sizes = sample.effects.sizes
    if sizes.max() <= LARGEST:
        return sample
    few = [np.unique(np.linspace(0, m - 1, min(m, LARGEST)).astype(int)) for m in sizes.tolist()]
    rows = np.concatenate([start + f for start, f in zip(sample.effects.starts, few, strict=True)])
    e = sample.effects
    starts = np.cumsum([0, *(len(f) for f in few[:-1])])
    drifts = tuple(d.at(rows) for d in e.drifts)
    effects = RandomEffects(starts, e.diagonals[:, rows], e.slopes[:, rows], drifts)
    return Sample(sample.y[rows], sample.basis[rows], effects)
