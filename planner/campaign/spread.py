"""The variances of one channel as its readings tell them, by REML beside the unknowns with a prior."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.campaign.noise import Noise, spec_variances
from planner.campaign.prior import Prior
from planner.nouns.array import Array
from planner.solvers.least_squares import least_squares
from planner.solvers.random_effects import RandomEffects
from planner.solvers.reml import Variances, reml
from planner.solvers.restricted_likelihood import Sample, reml_information, restricted_loglik
from planner.spec.model import Spec

_WORTH = 3.3  # gain of log-likelihood that a further variance must bring: one per cent of a χ² with 1
LEAST_RUN_FREEDOM = 2
UNTOLD = 1.0  # standard errors that a variance would have: two degrees of freedom
LEAST_SHARE = 1e-9  # of what differs within runs, that is white
LEAST_OWN_FREEDOM = 10  # degrees a variance, from which it is told apart from the others
OPTIONAL = ("rate_noise", "constant")  # kept only when they are worth it
MOST_ROWS = 6_000  # of evenly chosen whole power-ons: a spread is then known to some 3 %, and that is enough


def measured_variances(
    residual: Array,
    J: Array,
    prior: Prior,
    noise: Noise,
    spec: Spec,
    before: tuple[Noise, Variances] | None,
    by_spec: Callable[[], Noise],
) -> tuple[tuple[Noise, Variances], list[str]]:
    """REML where the data have the freedom for it; otherwise the spec's run-to-run spreads, and a note.

    before: of the last round, from which the search goes on; by_spec: the noise with what only a spec knows,
    which is taken where spreads are the spec's. Raises ValueError when no degree of freedom is
    left for the noise.
    """
    drawn = any(c.kind in ("run_to_run", "in_run") for c in noise.components)
    if drawn and run_freedom(J, noise.effects) >= LEAST_RUN_FREEDOM:
        rows, part = _chosen(noise.effects)
        thin = replace(noise, effects=part)
        cut = replace(prior, columns=prior.columns[rows])
        slim, found = _worthwhile(thin, residual[rows], J[rows], cut, _carried_on(noise, before))
        return _with_untold(noise, thin, slim, found, residual[rows], J[rows], cut, spec), []
    noise = by_spec()
    note = "too few power-ons to measure the run-to-run spread: the spec's is taken for the intervals"
    own = own_noise(residual, J, prior, noise, spec)
    if own is not None:
        return own, [note]
    white = _white(residual, J, prior, noise, spec)
    return (replace(noise, known=True), spec_variances(noise, spec.unit, white)), [note]


def own_noise(
    residual: Array, J: Array, prior: Prior, noise: Noise, spec: Spec
) -> tuple[Noise, Variances] | None:
    """Each row's own noise by REML where it grows with the input, beside draws that are the spec's.

    Every power-on has a level of its own, so that a spread of levels that is not the spec's is no noise of
    rows. With one white variance for all, coefficients that the input drives had intervals of 0.8 and those
    told at rest of 1.5 times their length. None where no input is large, or the rows tell no second variance.
    """
    given = spec_variances(noise, spec.unit, 1.0)
    a = len(noise.effects.diagonals)
    free = [k for k in range(a) if noise.components[k].kind in ("white", *OPTIONAL)]
    keep = [k for k in range(len(noise.components)) if k in free or given.theta[k] > 0.0]
    if not any(noise.components[k].kind == "rate_noise" for k in free):
        return None
    part, theta = replace(noise.of(keep), known=True), given.theta[keep]
    unknown = [i for i, k in enumerate(keep) if k in free]
    known = tuple(i for i in range(len(keep)) if i not in unknown)
    size = np.where(np.isin(np.arange(len(keep)), unknown), 1.0, theta)
    effects = replace(part.effects.scaled(size), known=known)
    levels = effects.spread(np.eye(len(effects.starts)))[:, 1:]
    X = np.column_stack([J, levels])
    if len(X) - np.linalg.matrix_rank(X) < LEAST_OWN_FREEDOM * len(unknown):
        return None
    slim, found = _without_zeros(replace(part, effects=effects), residual, X, prior, None)
    stays = [part.components.index(c) for c in slim.components]
    if len(stays) < 2 or slim.components[0].kind != "white" or found.theta[0] <= 0.0:
        return None
    back, factor = part.of(stays), size[stays]
    theta, error = found.theta * factor, found.error * np.outer(factor, factor)
    return back, replace(found, theta=theta, error=error, free=theta > 0.0)


def _white(residual: Array, J: Array, prior: Prior, noise: Noise, spec: Spec) -> float:
    """The white variance beside spreads that are the spec's: what differs within runs, less their draws.

    Where errors drift within a run, or what a power-on draws of them is not the same in all its records, it
    is the likeliest one, the others given: a scale factor may differ by more than the noise between power-ons
    or drift by more at high rates, and as noise it would take the weight of the records at rest. So would
    what unknowns with a prior add, an effect that nobody declares by hundreds of times the noise.
    """
    effects = noise.effects
    largest = within(residual, J, effects)
    steep = effects.drifts or _differ_within(effects.slopes, effects)
    if largest <= 0.0 or not (steep or _differ_within((prior.columns * prior.sigma).T, effects)):
        return largest
    from scipy.optimize import minimize_scalar

    X, target = augmented(residual, J, prior)
    effects = augmented_effects(noise.effects, prior) if len(prior.sigma) else noise.effects
    sample = Sample(target, X, effects)

    def misfit(logarithm: float) -> float:
        found = spec_variances(noise, spec.unit, largest * float(np.exp(logarithm)))
        theta = augmented_variances(noise.effects, found).theta if len(prior.sigma) else found.theta
        return -restricted_loglik(sample, theta)

    best = minimize_scalar(misfit, bounds=(np.log(LEAST_SHARE), 0.0), method="bounded")
    return float(largest * np.exp(best.x))


def _differ_within(slopes: Array, effects: RandomEffects) -> bool:
    """Whether any of the slopes (k, n) differs between the records of a power-on."""
    mean = effects.spread(effects.sums(slopes.T) / effects.sizes[:, None]).T
    return bool(np.any(np.abs(slopes - mean) > LEAST_SHARE * np.abs(slopes).max(initial=0.0)))


def run_freedom(X: Array, effects: RandomEffects) -> int:
    """How many differences between runs the coefficients leave to estimate the run-to-run spread from."""
    means = effects.sums(X) / effects.sums(np.ones((len(X), 1)))
    return len(effects.starts) - int(
        np.linalg.matrix_rank(means, tol=1e-9 * max(1e-300, np.abs(means).max()))
    )


def _chosen(effects: RandomEffects) -> tuple[NDArray[np.bool_], RandomEffects]:
    """(n,) rows of whole power-ons, about MOST_ROWS of them evenly over the campaign."""
    if effects.rows <= MOST_ROWS:
        return np.ones(effects.rows, dtype=bool), effects
    g = len(effects.starts)
    stays = np.zeros(g, dtype=bool)
    stays[np.linspace(0, g - 1, max(2, int(g * MOST_ROWS / effects.rows))).astype(int)] = True
    return np.repeat(stays, effects.sizes), effects.at(stays)


def _worthwhile(
    noise: Noise, y: Array, J: Array, prior: Prior, start: Array | None
) -> tuple[Noise, Variances]:
    """The noise without the components whose variance is zero or not worth having, and its variances."""
    slim, found = _without_zeros(noise, y, J, prior, start)
    for i in reversed(range(1, len(slim.components))):
        if slim.components[i].kind in OPTIONAL:
            others = [j for j in range(len(slim.components)) if j != i]
            fewer = slim.of(others)
            less = _reml(y, J, prior, fewer, found.theta[others])
            if found.loglik - less.loglik < _WORTH:
                slim, found = fewer, less
    return slim, found


def _with_untold(
    noise: Noise, thin: Noise, slim: Noise, found: Variances, y: Array, J: Array, prior: Prior, spec: Spec
) -> tuple[Noise, Variances]:
    """The noise with the spec's variances in place of nothing, where few power-ons would tell them.

    noise: of all rows; thin: of those that were asked, slim: what was found of that
    Two power-ons on an arm tell how a scale factor drifts under load by hardly a degree of freedom, and often
    as nothing: intervals of high_g.yaml's nonlinearity held the truth in 85 to 89 % of units.
    """
    said = spec_variances(noise, spec.unit).theta
    told = {c: float(v) for c, v in zip(slim.components, found.theta, strict=True)}
    lost = np.array([c not in told and c.kind in ("run_to_run", "in_run") for c in noise.components]) & (
        said > 0.0
    )
    if lost.any():
        as_said = np.where(lost, said, [told.get(c, 0.0) for c in noise.components])
        lost &= said < UNTOLD * _errors(y, J, prior, thin, as_said)
    keep = np.flatnonzero([x or c in told for c, x in zip(noise.components, lost, strict=True)]).tolist()
    theta = np.array([said[i] if lost[i] else told[noise.components[i]] for i in keep])
    own = np.flatnonzero(~lost[keep])
    error = np.zeros((len(keep), len(keep)))
    error[np.ix_(own, own)] = found.error
    return noise.of(keep), replace(found, theta=theta, error=error, free=~lost[keep] & (theta > 0.0))


def _errors(y: Array, J: Array, prior: Prior, noise: Noise, theta: Array) -> Array:
    """(K,) standard errors that estimates of variances have where they are θ, by the expected information."""
    effects, a = noise.effects, len(noise.effects.diagonals)
    asked = np.arange(len(theta))
    if len(prior.sigma):
        effects, theta, asked = (
            augmented_effects(effects, prior),
            np.insert(theta, a, 1.0),
            asked + (asked >= a),
        )
    X, target = augmented(y, J, prior)
    information = reml_information(Sample(target, X, effects), theta)[np.ix_(asked, asked)]
    unit = np.sqrt(np.maximum(np.diag(information), 1e-300))  # variances of unlike sizes, each in its own
    inverse = np.linalg.pinv(information / np.outer(unit, unit), hermitian=True)
    return np.asarray(np.sqrt(np.maximum(np.diag(inverse), 0.0)) / unit)


def _without_zeros(
    noise: Noise, y: Array, J: Array, prior: Prior, start: Array | None
) -> tuple[Noise, Variances]:
    """The noise without the components whose variance is zero, and its variances."""
    found = _reml(y, J, prior, noise, start)
    keep = [i for i in range(len(noise.components)) if i == 0 or found.theta[i] > 0]
    if len(keep) == len(noise.components):
        return noise, found
    slim = noise.of(keep)
    return slim, _reml(y, J, prior, slim, found.theta[keep])


def _reml(y: Array, J: Array, prior: Prior, noise: Noise, start: Array | None) -> Variances:
    """REML of the records; the unknowns with a prior enter with their pseudo-records."""
    if len(prior.sigma) == 0:
        return reml(y, J, noise.effects, start)
    X, target = augmented(y, J, prior)
    a = len(noise.effects.diagonals)
    if start is not None:
        start = np.insert(start, a, 1.0)
    found = reml(target, X, augmented_effects(noise.effects, prior), start)
    keep = [k for k in range(len(found.theta)) if k != a]
    return Variances(
        found.theta[keep], found.error[np.ix_(keep, keep)], found.free[keep], found.loglik, found.converged
    )


def _carried_on(noise: Noise, before: tuple[Noise, Variances] | None) -> Array | None:
    """(K,) the last round's variances; one that it had dropped is released again if its score says so."""
    if before is None:
        return None
    known = dict(zip(before[0].components, before[1].theta, strict=True))
    if known.get(noise.components[0], 0.0) <= 0:
        return None
    return np.array([known.get(component, 0.0) for component in noise.components])


def within(residual: Array, J: Array, effects: RandomEffects) -> float:
    """Noise variance from what differs within runs; from everything when nothing does."""
    runs = effects.spread(np.eye(len(effects.starts))) if len(effects.starts) < 400 else None
    X = J if runs is None or runs.shape[1] == len(J) else np.column_stack([J, runs])
    beta, found = least_squares(X, residual)
    freedom = len(residual) - found.rank
    if freedom < 1:
        beta, found = least_squares(J, residual)
        X, freedom = J, len(residual) - found.rank
    if freedom < 1:
        raise ValueError("as many coefficients as rows: nothing is left to estimate the noise from")
    left = residual - X @ beta
    return float(left @ left) / freedom


# ---------------------------------------------------------------- pseudo-records


def augmented(y: Array, J: Array, prior: Prior) -> tuple[Array, Array]:
    """Design (n + q, p + q) and target (n + q,): the records, then 0 = ξ with the prior's sigma."""
    q = len(prior.sigma)
    if q == 0:
        return J, y
    X = np.block([[J, prior.columns], [np.zeros((q, J.shape[1])), np.eye(q)]])
    return X, np.concatenate([y, np.zeros(q)])


def augmented_effects(effects: RandomEffects, prior: Prior) -> RandomEffects:
    """V of records and pseudo-records, each of these a group of its own; the new last diagonal is known."""
    n, q = effects.rows, len(prior.sigma)
    blank = np.zeros((len(effects.diagonals), q))
    own = np.concatenate([np.zeros(n), prior.sigma**2])
    drifts = tuple(
        replace(d, z=np.append(d.z, np.zeros(q)), time=np.append(d.time, np.zeros(q))) for d in effects.drifts
    )
    a = len(effects.diagonals)
    known = (*(k if k < a else k + 1 for k in effects.known), a)
    return RandomEffects(
        np.append(effects.starts, n + np.arange(q)),
        np.vstack([np.hstack([effects.diagonals, blank]), own[None, :]]),
        np.hstack([effects.slopes, np.zeros((len(effects.slopes), q))]),
        drifts,
        known,
    )


def augmented_variances(effects: RandomEffects, variances: Variances) -> Variances:
    """The variances with the known one, 1 without error, after the last diagonal."""
    a = len(effects.diagonals)
    error = np.insert(np.insert(variances.error, a, 0.0, axis=0), a, 0.0, axis=1)
    return Variances(
        np.insert(variances.theta, a, 1.0), error, np.insert(variances.free, a, False), 0.0, True
    )
