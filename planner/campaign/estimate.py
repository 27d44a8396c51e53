"""One channel's coefficients from its readings: Gauss-Newton, generalised least squares inside.

    θ̂ = argmin (y − ŷ(θ) − P ξ)ᵀ V⁻¹ (y − ŷ(θ) − P ξ) + ξᵀ Σ⁻¹ ξ

ŷ the measurement equation, V the covariance block by power-on (planner.campaign.noise), P ξ the unknowns with
a prior that the power-ons share (planner.campaign.prior), which enter as pseudo-records 0 = ξ + N(0, Σ). The
variances come from the data by REML, or are given.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from planner.campaign.first_order import FirstOrder, first_order
from planner.campaign.local_slopes import local_slopes
from planner.campaign.noise import Noise, Slopes, noise_model, with_stray
from planner.campaign.parameters import best_parameters, limited, unobservable
from planner.campaign.power_ons import PowerOns
from planner.campaign.prior import Prior, both, prior_of
from planner.campaign.spread import (
    augmented,
    augmented_effects,
    augmented_variances,
    measured_variances,
)
from planner.measurement import SANE, ChannelModel, evaluate
from planner.nouns.array import Array
from planner.solvers.least_squares import factors, least_squares
from planner.solvers.mixed_model import MixedFit, mixed_fit
from planner.solvers.random_effects import NoNoise, RandomEffects, covariance
from planner.solvers.reml import Variances
from planner.spec.model import Spec

Robust = Literal["no", "huber", "bisquare"]
_GAUSS_NEWTON = 12
_OUTER = 6
_SETTLED = 1e-3  # of a standard error
_TUNING = {"huber": 1.345, "bisquare": 4.685}  # 95 % efficiency at the normal (Holland, Welsch 1977)
SLOW = 0.5  # correlation of neighbours that white noise of 30 records reaches once in 400
LEAST_NEIGHBOURS = 30
FAR = 6.0  # sigma; one normal row in 5e8 lies further out
LAST_DIGIT = 1e-8  # of the largest reading
NOISELESS = (
    "the records have no noise at all: they were weighed as if their eighth digit were noise; what is said "
    "of intervals and spreads says nothing of a sensor"
)
CHANGED = 0.02  # of a standard error, by which a parameter moves before the variances are asked again


@dataclass(frozen=True)
class Estimate:
    """One channel's estimate. theta: (p,), parameters as they are carried; J: (n, p), the slope there.

    fit: coefficients with covariance (p, p) and degrees of freedom (p,), the shared unknowns taken out;
        whitened: (n,) residuals that should be white; noise, variances: V; prior: P
    residual: (n,) y − ŷ(θ); notes: sentences
    """

    model: ChannelModel
    theta: Array
    J: Array
    fit: MixedFit
    noise: Noise
    variances: Variances
    prior: Prior
    residual: Array
    notes: tuple[str, ...]


def estimate(
    model: ChannelModel,
    y: Array,
    runs: PowerOns,
    spec: Spec,
    robust: Robust = "no",
    given: tuple[Noise, Variances] | None = None,
    slopes: Slopes = dict,
) -> Estimate:
    """Fit the declared effects to one channel's readings y (n,); rows stand power-on by power-on.

    given: the covariance, if it is not to be found from these readings
    A parameter that the data do not tell within its range stays at its default: beside one that runs away its
    amplitude would be any number. Raises ValueError when there are no more rows than coefficients.
    """
    how = (runs, spec, robust, given, slopes)
    try:
        found, said = _fitted(model, y, *how), list[str]()
    except NoNoise:
        y = y + _last_digit(y)
        found, said = _fitted(model, y, *how), [NOISELESS]
    known = {c.effect.name: c.effect for c in model.carried}
    while lost := unobservable(found.model, found.theta, found.fit):
        held = replace(found.model, held=(*found.model.held, *lost))
        found = _fitted(held, y, *how)
        said += [
            f"the data do not tell the {p.name} of {effect}: held at its default, {p.shown(p.default)}"
            for effect, parameter in lost
            for p in known[effect].parameters
            if p.name == parameter
        ]
    return replace(found, notes=(*found.notes, *said))


def _last_digit(y: Array) -> Array:
    """(n,) noise of the last digits of readings that have none: to weigh records some is needed."""
    size = LAST_DIGIT * max(float(np.abs(y).max(initial=0.0)), LAST_DIGIT)
    return np.asarray(size * np.random.default_rng(0).normal(size=len(y)))


def _fitted(
    model: ChannelModel,
    y: Array,
    runs: PowerOns,
    spec: Spec,
    robust: Robust,
    given: tuple[Noise, Variances] | None,
    slopes: Slopes,
) -> Estimate:
    seen = first_order(model)
    theta, weights = _start(model, y, robust, seen)
    step, error = theta, np.zeros(len(theta))
    before: tuple[Noise, Variances] | None = given
    notes: list[str] = []
    for turn in range(_OUTER):
        parts = evaluate(model, theta)
        J = seen.slope(model, theta, parts)
        left = y - parts.predicted
        prior = both(prior_of(model, theta, parts, runs, spec), local_slopes(model, parts, spec))
        if given is None and (turn == 0 or robust != "no" or _moved(model, step, error)):
            every = noise_model(model, parts, runs, spec.unit, weights)
            by_spec = partial(with_stray, every, model, parts, spec.unit, weights, slopes)
            before, notes = measured_variances(left, J, prior, every, spec, before, by_spec)
        assert before is not None  # given, or measured in the first turn
        noise, variances = before
        if turn == 0 and model.fitted_parameters:
            theta = best_parameters(model, theta, y, noise.effects, variances.theta)
            parts = evaluate(model, theta)
            J, left = seen.slope(model, theta, parts), y - parts.predicted
        target = left + J @ theta
        found, error, white = weighed(target, J, prior, noise, variances, model.sane(np.zeros(len(theta))))
        step = limited(model, theta, found) - theta
        theta = theta + step
        if robust != "no":
            weights = _weights(white * np.sqrt(1.0 / weights), robust)
        if robust == "no" and np.all(np.abs(step) <= _SETTLED * error + 1e-15):
            break
    fit = solved(target, J, prior, noise, variances)
    far = int(np.sum(np.abs(fit.whitened) > FAR))
    if far and robust == "no":
        notes += [f"{far} rows lie more than {FAR:g} sigma off; the robust fit (--robust) resists them"]
    notes = [*notes, *_slow(fit.whitened, runs)]
    residual = y - evaluate(model, theta).predicted
    return Estimate(model, theta, J, fit, noise, variances, prior, residual, tuple(notes))


def weighed(
    y: Array, J: Array, prior: Prior, noise: Noise, variances: Variances, sane: Array | None = None
) -> tuple[Array, Array, Array]:
    """Coefficients (p,), their errors (p,) and white residuals (n,), V as it is: for the steps of a fit.

    sane: (s, l + 1) pseudo-records of the first l coefficients, and what they read
    """
    n, p = J.shape
    X, target, effects, full = with_pseudo_records(y, J, prior, noise, variances)
    white = covariance(effects, full.theta).whiten(np.column_stack([X, target]))
    if sane is not None:
        below = np.zeros((len(sane), white.shape[1]))
        below[:, : sane.shape[1] - 1], below[:, -1] = sane[:, :-1], sane[:, -1]
        white = np.vstack([white, below])
    found = factors(white[:, :-1])
    beta = found.solve(white[:, -1])
    error = np.sqrt(np.sum(found.to_coefficients**2, axis=1))
    return beta[:p], error[:p], (white[:, -1] - white[:, :-1] @ beta)[:n]


def solved(y: Array, J: Array, prior: Prior, noise: Noise, variances: Variances) -> MixedFit:
    """Generalised least squares of y (n,) on J (n, p) beside the shared unknowns, which are not returned."""
    n, p = J.shape
    X, target, effects, full = with_pseudo_records(y, J, prior, noise, variances)
    found = mixed_fit(target, X, effects, full)
    return replace(
        found,
        coefficients=found.coefficients[:p],
        covariance=found.covariance[:p, :p],
        freedom=found.freedom[:p],
        undetermined=found.undetermined[:p],
        whitened=found.whitened[:n],
        variances=variances,
    )


def with_pseudo_records(
    y: Array, J: Array, prior: Prior, noise: Noise, variances: Variances
) -> tuple[Array, Array, RandomEffects, Variances]:
    """Design, target and V of the records and of the unknowns with a prior, if there are any."""
    if len(prior.sigma) == 0:
        return J, y, noise.effects, variances
    X, target = augmented(y, J, prior)
    effects = augmented_effects(noise.effects, prior)
    return X, target, effects, augmented_variances(noise.effects, variances)


def _moved(model: ChannelModel, step: Array, error: Array) -> bool:
    """Whether a parameter moved: a step of linear coefficients alone does not change what REML is asked."""
    return bool(np.any(np.abs(step) > CHANGED * error + 1e-15, where=np.arange(len(step)) >= model.linear))


# ---------------------------------------------------------------- start and weights


def _start(model: ChannelModel, y: Array, robust: Robust, seen: FirstOrder) -> tuple[Array, Array]:
    """Gauss-Newton without a noise model: the first step, from no error at all, is the linear solution.

    Parameters wait for the noise model: without one they would follow what every power-on draws.
    """
    theta, weights = model.start(), np.ones(len(y))
    for _ in range(_GAUSS_NEWTON if robust == "no" else 2 * _GAUSS_NEWTON):
        parts = evaluate(model, theta)
        J = seen.slope(model, theta, parts)[:, : model.linear]
        root = np.sqrt(weights)
        step, _ = least_squares(root[:, None] * J, root * (y - parts.predicted))
        theta = theta + np.append(step, np.zeros(len(theta) - model.linear))
        if robust != "no":
            r = y - evaluate(model, theta).predicted
            weights = _weights(r / _spread(r), robust)
        elif np.abs(J @ step).max() <= 1e-6 * max(np.abs(y - parts.predicted).max(), 1e-300):
            break
    if np.any(np.abs(theta[model.scales]) > SANE):  # no record drives it: at equal weights it is anything
        theta = model.start()
    return theta, weights


def _spread(residual: Array) -> float:
    """Robust standard deviation: 1.4826 times the median modulus."""
    return max(1.4826 * float(np.median(np.abs(residual))), 1e-300)


def _weights(scaled: Array, robust: Robust) -> Array:
    """(n,) weights of residuals that are given in sigma; never quite zero, so that V stays finite."""
    size = np.abs(scaled) / _TUNING[robust]
    if robust == "huber":
        return np.asarray(1.0 / np.maximum(size, 1.0))
    return np.asarray(np.maximum((1.0 - np.minimum(size, 1.0) ** 2) ** 2, 1e-8))


def _slow(whitened: Array, runs: PowerOns) -> list[str]:
    """A sentence when neighbouring records of a run err alike: a first-order process of that correlation."""
    inside = np.ones(len(whitened), dtype=bool)
    inside[runs.starts] = False
    here = np.flatnonzero(inside)
    if len(here) < LEAST_NEIGHBOURS:
        return []
    r = float(whitened[here] @ whitened[here - 1] / max(float(whitened @ whitened), 1e-300))
    if r < SLOW:
        return []
    wider = np.sqrt((1.0 + r) / max(1.0 - r, 1e-3))
    return [
        f"neighbouring records err alike (correlation {r:.2f}): something slow is missing from the model, "
        f"and the intervals are too narrow, about {wider:.1f} times; `planner diagnose` looks for it"
    ]
