"""Whether what few power-ons tell is no more than what the spec lets every one of them draw, or wander.

    V' = V + Σ_runs Σ_t (σ_t² − σ̂_t²)⁺ x_t x_tᵀ

x_t the columns of the terms of every declared error but the bias (scale factor, misalignments), σ_t its
run-to-run of the spec, σ̂_t what the noise has of it already. Three power-ons on a centrifuge, each at a
temperature of its own, draw three misalignments: at 50 g by 0.003 deg 2.6 mg, and a curve over temperature
follows them to the last digit. Their spread is then one with the curve, no likelihood has it, and what the
records cannot tell the spec does. Where many power-ons tell a block their spread is in the noise. What the
scale factor wanders within them (`in_run`) counts as they draw it: by 0.002 % of 1500 deg/s six power-ons on
a centrifuge went with "time and rate" at 17 sigma.

Both must hold: beside the draws the block says nothing, and they say most of what it does.

Eight to thirty power-ons tell a spread, but badly: with four degrees of freedom beside all candidates it
comes out at a third of itself in one channel of fifty, and a curve over the load that follows four draws of a
scale factor is then eight sigma. There the block must be likelier than the draws (`as_likely`), these as
large as they then fit best: twelve power-ons of one sign and size are no draws, however large the budget.

With D the whitened x_t σ_t of every power-on and DᵀD = V Λ Vᵀ, a tenth of the work of D's own decomposition,

    (I + D Dᵀ)^(−½) = I − D V (1 − (1 + Λ)^(−½)) Λ⁻¹ Vᵀ Dᵀ
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel, usual_columns
from planner.diagnose.channels.orthogonal import clear, explained, orthonormal
from planner.diagnose.hypotheses.found import Found
from planner.diagnose.hypotheses.scores import Score
from planner.diagnose.noise.channel_noise import LEAST_RUNS, ChannelNoise
from planner.diagnose.noise.components import IN_RUN_SCALE, of_effect
from planner.diagnose.noise.modes_of_drift import modes_of
from planner.diagnose.noise.whitened import SEEN, Whitened, log_p
from planner.diagnose.vetoes.as_likely import Budgeted, likelier
from planner.nouns.array import Array
from planner.solvers.random_effects import Drift
from planner.spec.budget import ErrorBudget

MANY = 30.0  # power-ons, from which a spread is known to an eighth, 1 / √(2 · 30)
AS_BUDGETED = 1e-3  # p, above which a block says no more than power-ons that differ as they may
OF_IT = (
    0.85  # of what the block explains, that draws must: leans say 0.95 of it and more, what they do not 0.75
)
SAYS = 1e-6  # of what all power-ons tell of a block: what one that tells less may draw takes none of it
A_MODE = 1e-3
SHARES = (0.05, 0.1, 0.2, 0.5, 1.0)  # of the budget, that power-ons may draw
SCALE = "run_to_run_scale_factor"  # of the noise


def as_budgeted(found: Found, b: int, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]) -> bool:
    """Whether a believed block of one channel, told by few power-ons, is as likely what these draw."""
    block = found.pool.blocks[b]
    if block.reference or len(block.columns) != 1:
        return False
    (axis,) = block.columns
    w = found.pool.state[axis]
    others = [found.pool.blocks[o].columns[axis] for o in found.others(b) if axis in found.axes(o)]
    C, beside = w.noise.whiten(block.columns[axis]), np.empty((len(w.z), 0))
    known = np.column_stack([w.Q, *(w.noise.whiten(x) for x in others), beside])
    taken = orthonormal(known)
    told = np.add.reduceat(np.sum(clear(taken, C) ** 2, axis=1), starts)
    few = (many := _as_many(told)) < MANY
    drawn = _drawn(w, starts, budgets, told > SAYS * told.sum()) if few else np.empty((0, 0))
    if drawn.shape[1] == 0:
        return False
    if many >= LEAST_RUNS:
        process = Budgeted.of(clear(taken, drawn), clear(taken, w.z))
        return _is_drawn(found.share(b), likelier([(process, clear(taken, C))]))
    wider = _whitened_again(drawn, np.column_stack([w.z, C, known]))
    k = 1 + C.shape[1]
    delta, rank = explained(wider[:, k:], wider[:, 1:k], wider[:, 0], SEEN)
    s = found.share(b)
    if rank == 0 or s.m == 0:
        return True
    if log_p(delta, rank, s.freedom, s.s2) <= np.log(AS_BUDGETED):
        return False
    beside = orthonormal(known)
    return _gain(clear(beside, drawn), clear(beside, w.z)) > OF_IT * s.delta


def _is_drawn(s: Score, gain: float) -> bool:
    """Whether a block with draws beside it is no likelier than draws alone; gain: twice the log, Λ."""
    return s.m == 0 or bool(log_p(gain, s.m, s.freedom, s.s2) > np.log(AS_BUDGETED))


def _gain(D: Array, z: Array) -> float:
    """2 log of the likelihood ratio of z (n,) with draws of D's columns, at the best share of the budget.

    max_f  zᵀ (I − (I + f² DDᵀ)⁻¹) z − log det (I + f² DDᵀ)
    """
    square, V = _turned(D)
    shares = np.array(SHARES)[:, None] ** 2
    grown = 1.0 + shares * square
    return float(np.max(np.sum((V.T @ (D.T @ z)) ** 2 * shares / grown - np.log(grown), axis=1)))


def _turned(D: Array) -> tuple[Array, Array]:
    """Λ (k,) and V (k, k) of DᵀD = V Λ Vᵀ."""
    square, V = np.linalg.eigh(D.T @ D)
    return np.maximum(square, 0.0), V


def _as_many(square: Array) -> float:
    """How many power-ons tell something, those that tell more counted for more: (Σ e)² / Σ e²."""
    return float(square.sum() ** 2 / max(float(square @ square), 1e-300))


def _drawn(
    w: Whitened, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget], some: NDArray[np.bool_]
) -> Array:
    """(n, r) whitened columns of what each of some power-ons, (g,), may draw beside what the noise has of it.

    Of one sigma of the budget.
    """
    n = len(w.z)
    run = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, n)))
    parts = [np.empty((n, 0))]
    for x, more in _terms(w.channel, w.noise, budgets):
        each = np.zeros((n, len(starts)))
        each[np.arange(n), run] = more * x
        parts.append(each[:, some & np.any(each != 0.0, axis=0)])
    rows = [np.flatnonzero(run == r) for r in np.flatnonzero(some).tolist()]
    parts.append(_wandered(w.channel, w.noise, budgets, rows))
    return w.noise.whiten(np.column_stack(parts))


def _wandered(
    c: Channel,
    noise: ChannelNoise,
    budgets: Mapping[str, ErrorBudget],
    power_ons: Sequence[NDArray[np.int64]],
) -> Array:
    """(n, k) modes of what the scale factor may wander within power-ons beside what the noise has of it.

    Those of less than A_MODE of a power-on's variance are nothing beside its records' noise.
    """
    budget = budgets.get("scale_factor")
    has = dict(zip(noise.components, noise.variances.theta.tolist(), strict=True)).get(IN_RUN_SCALE, 0.0)
    more = 0.0 if budget is None else budget.in_run_sigma**2 - has
    if budget is None or more <= 0.0:
        return np.empty((len(c.u), 0))
    drift = Drift(np.sqrt(more) * c.u, c.model.conditions.time_on, budget.in_run_time)
    return modes_of(drift, power_ons, A_MODE)


def _terms(
    c: Channel, noise: ChannelNoise, budgets: Mapping[str, ErrorBudget]
) -> Iterator[tuple[Array, float]]:
    """x (n,) of every term of the channel's errors but the bias, and √(σ² − σ̂²) of it."""
    has = dict(zip(noise.components, noise.variances.theta.tolist(), strict=True))
    for name, budget in budgets.items():
        if name == "bias" or budget.run_to_run is None:
            continue
        already = [SCALE] if name == "scale_factor" else of_effect(name, has)
        more = budget.run_to_run_largest**2 - min((has[one] for one in already if one in has), default=0.0)
        for x in usual_columns(c, name) if more > 0.0 else ():
            yield x, float(np.sqrt(more))


def _whitened_again(drawn: Array, X: Array) -> Array:
    """(I + D Dᵀ)^(−½) X."""
    square, V = _turned(drawn)
    root = np.sqrt(1.0 + square)
    return np.asarray(X - drawn @ (V @ ((V.T @ (drawn.T @ X)) / (root * (1.0 + root))[:, None])))
