"""One channel: Gauss-Newton on the product model, generalised least squares with REML variances inside."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.campaign.channel_model import ChannelModel, Parts, evaluate, jacobian
from planner.learn.fit_options import Robust
from planner.campaign.noise import (
    LEAST_RUN_FREEDOM,
    Noise,
    noise_model,
    run_freedom,
    spec_variances,
    without_idle,
)
from planner.records import Array
from planner.solvers.least_squares import least_squares
from planner.solvers.mixed_model import MixedFit, mixed_fit
from planner.solvers.reml import Variances, reml
from planner.spec.model import Spec

_GAUSS_NEWTON = 12
_OUTER = 6
_SETTLED = 1e-3  # of a standard error
_TUNING = {"huber": 1.345, "bisquare": 4.685}  # 95 % efficiency at the normal (Holland, Welsch 1977)
WIDEST = float(np.log(20.0))  # of a nonlinear parameter's logarithm, about its default
SLOW = 0.5  # correlation of neighbours that white noise of 30 records reaches once in 400
LEAST_NEIGHBOURS = 30
FAR = 6.0  # sigma; one normal row in 5e8 lies further out


@dataclass(frozen=True)
class ChannelFit:
    """One channel's fit. theta: (p,); parts, J: the model there; weights: (n,) of the rows."""

    model: ChannelModel
    theta: Array
    parts: Parts
    fit: MixedFit
    noise: Noise
    weights: Array
    residual: Array
    notes: tuple[str, ...]


def fit_channel(
    model: ChannelModel,
    y: Array,
    starts: NDArray[np.int64],
    duration: Array,
    spec: Spec,
    robust: Robust = "no",
) -> ChannelFit:
    """Fit the declared effects to one channel's readings y (n,); rows stand run by run.

    A nonlinear parameter that the data do not tell within a factor of 20 stays at its default: beside one
    that runs away its amplitude would be any number. Raises ValueError when there are no more rows than
    coefficients.
    """
    found = _fitted(model, y, starts, duration, spec, robust)
    lost = _untold(found)
    if not lost:
        return found
    held = _fitted(replace(model, held=(*model.held, *lost)), y, starts, duration, spec, robust)
    said = [
        f"the data do not tell the {parameter} of {effect}: held at its default, "
        f"{catalog.effects()[effect].nonlinear[parameter]:g} in SI"
        for effect, parameter in lost
    ]
    return replace(held, notes=(*held.notes, *said))


def _untold(fit: ChannelFit) -> list[tuple[str, str]]:
    """Nonlinear parameters at the edge of what is sought, or with an interval wider than that."""
    names = fit.model.parameters()
    first = len(fit.theta) - len(names)
    error = np.sqrt(np.maximum(np.diag(fit.fit.covariance), 0.0))[first:]
    moved = np.abs(fit.theta - fit.model.start())[first:]
    far = (moved >= WIDEST - 1e-6) | (2.0 * error > WIDEST) | fit.fit.undetermined[first:]
    return [name for name, lost in zip(names, far, strict=True) if lost]


def _fitted(
    model: ChannelModel,
    y: Array,
    starts: NDArray[np.int64],
    duration: Array,
    spec: Spec,
    robust: Robust,
) -> ChannelFit:
    theta, weights = _start(model, y, robust)
    before: tuple[Noise, Variances] | None = None
    for _ in range(_OUTER):
        parts = evaluate(model, theta)
        J = jacobian(model, theta, parts)
        every = noise_model(model, parts, starts, duration, spec, weights)
        noise, variances, notes = _variances(y - parts.predicted, J, every, spec, before)
        before = noise, variances
        fit = mixed_fit(y - parts.predicted + J @ theta, J, noise.effects, variances)
        step = _limited(model, theta, fit.coefficients) - theta
        theta = theta + step
        error = np.sqrt(np.diag(fit.covariance))
        if robust != "no":
            weights = _weights(fit.whitened * np.sqrt(1.0 / weights), robust)
        if np.all(np.abs(step) <= _SETTLED * error + 1e-15) and robust == "no":
            break
    parts = evaluate(model, theta)
    residual = y - parts.predicted
    far = int(np.sum(np.abs(fit.whitened) > FAR))
    if far and robust == "no":
        notes.append(f"{far} rows lie more than {FAR:g} sigma off; the robust fit (--robust) resists them")
    notes += _slow(fit.whitened, starts)
    return ChannelFit(model, theta, parts, fit, noise, weights, residual, tuple(notes))


def _slow(whitened: Array, starts: NDArray[np.int64]) -> list[str]:
    """A sentence when neighbouring records of a run err alike: a first-order process of that correlation."""
    inside = np.ones(len(whitened), dtype=bool)
    inside[starts] = False
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


def _start(model: ChannelModel, y: Array, robust: Robust) -> tuple[Array, Array]:
    """Gauss-Newton without a noise model: the first step, from no error at all, is the linear solution."""
    theta, weights = _best_nonlinear(model, y), np.ones(len(y))
    for _ in range(_GAUSS_NEWTON if robust == "no" else 2 * _GAUSS_NEWTON):
        parts = evaluate(model, theta)
        J = jacobian(model, theta, parts)
        root = np.sqrt(weights)
        step, _ = least_squares(root[:, None] * J, root * (y - parts.predicted))
        theta = _limited(model, theta, theta + step)
        if robust != "no":
            r = y - evaluate(model, theta).predicted
            weights = _weights(r / _spread(r), robust)
        elif np.abs(J @ step).max() <= 1e-9 * max(np.abs(y - parts.predicted).max(), 1e-300):
            break
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


def _best_nonlinear(model: ChannelModel, y: Array) -> Array:
    """Start: nonlinear parameters at the best of a grid around their defaults, the rest zero."""
    theta = model.start()
    count = len(model.parameters())
    for i in range(len(theta) - count, len(theta)):
        scores = []
        grid = theta[i] + np.log([0.1, 0.2, 0.4, 0.7, 1.0, 1.5, 2.5, 5.0])
        for value in grid:
            theta[i] = value
            parts = evaluate(model, theta)
            J = jacobian(model, theta, parts)[:, : len(theta) - count]
            beta, _ = least_squares(J, y - parts.predicted)
            scores.append(float(np.sum((y - parts.predicted - J @ beta) ** 2)))
        theta[i] = grid[int(np.argmin(scores))]
    return theta


def _limited(model: ChannelModel, old: Array, new: Array) -> Array:
    """A step in which no nonlinear parameter changes more than twofold, or 20-fold from its default."""
    count = len(model.parameters())
    if count:
        tail = slice(len(old) - count, len(old))
        new = new.copy()
        new[tail] = old[tail] + np.clip(new[tail] - old[tail], -np.log(2.0), np.log(2.0))
        middle = model.start()[tail]
        new[tail] = np.clip(new[tail], middle - WIDEST, middle + WIDEST)
    return new


def _variances(
    residual: Array, J: Array, noise: Noise, spec: Spec, before: tuple[Noise, Variances] | None
) -> tuple[Noise, Variances, list[str]]:
    """REML where the data have the freedom for it; otherwise the spec's run-to-run spreads, and a note.

    before: of the last round, from which the search goes on
    """
    if len(noise.effects.slopes) and run_freedom(J, noise.effects) >= LEAST_RUN_FREEDOM:
        found = reml(residual, J, noise.effects, _carried_on(noise, before))
        return (*without_idle(noise, found, residual, J), [])
    white = _within(residual, J, noise)
    given = spec_variances(noise, spec, white)
    note = "too few power-ons to measure the run-to-run spread: the spec's is taken for the intervals"
    return replace(noise, known=True), given, [note]


def _carried_on(noise: Noise, before: tuple[Noise, Variances] | None) -> Array | None:
    """(K,) the last round's variances; one that it had dropped is released again if its score says so."""
    if before is None:
        return None
    known = dict(zip(before[0].components, before[1].theta, strict=True))
    if noise.components[0] not in known or known[noise.components[0]] <= 0:
        return None
    return np.array([known.get(component, 0.0) for component in noise.components])


def _within(residual: Array, J: Array, noise: Noise) -> float:
    """Noise variance from what differs within runs; from everything when nothing does."""
    runs = (
        noise.effects.spread(np.eye(len(noise.effects.starts))) if len(noise.effects.starts) < 400 else None
    )
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
