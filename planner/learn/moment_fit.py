"""One channel under a given error model, with its variances by moments: ten times as fast as REML.

    V = diag(σ² T̄/T + ρ² u²) + τ² 1 1ᵀ per power-on,   T the duration of a record, T̄ their mean

Good enough to weigh rows when an error model is judged on runs that it has not seen; intervals of
coefficients come from elsewhere (planner.campaign.estimate). Spreads are medians of moduli, so rows that are
far off have no say.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.measurement import ChannelModel, Parts, evaluate, jacobian
from planner.records import Array
from planner.solvers.least_squares import least_squares
from planner.solvers.random_effects import Covariance, RandomEffects, woodbury

FAR = 8.0  # sigma; further off lies no row of a normal or Student-t campaign
MOST_FAR = 0.01  # share of the rows; more are no outliers but a structure
FAST = {"gyro": 0.5, "accelerometer": 30.0}  # rad/s, m/s²: above, errors grow with the input
_STEPS = 6
_ROUNDS = 2
_MAD = 1.4826  # standard deviation of a normal law over its median modulus


@dataclass(frozen=True)
class MomentFit:
    """theta: (p,) as in ChannelModel; J: (n, q) derivative by its linear coefficients; residual: (n,) SI.

    v: covariance of the rows; white, run, rate: σ (of a record of mean duration) and τ in SI, ρ as a share of
        the input
    far: (n,) rows that are outliers; linear: how many coefficients of theta are linear
    """

    model: ChannelModel
    theta: Array
    parts: Parts
    J: Array
    residual: Array
    v: Covariance
    white: float
    run: float
    rate: float
    far: NDArray[np.bool_]

    @property
    def linear(self) -> int:
        """How many coefficients are linear; nonlinear ones stand behind them and are held."""
        return int(self.J.shape[1])


def moment_fit(
    model: ChannelModel,
    y: Array,
    starts: NDArray[np.int64],
    nonlinear: Mapping[str, Mapping[str, float]] | None = None,
    duration: Array | None = None,
) -> MomentFit:
    """Fit one channel's readings y (n,); rows stand run by run from `starts` (g,).

    nonlinear: effect -> parameter -> value in SI; they are held, at their defaults when not given
    duration: (n,) s of every record; alike when not given
    """
    theta = _start(model, nonlinear or {})
    share = _noise_share(np.ones(len(y)) if duration is None else duration)
    v = _covariance(model, starts, share, np.ones(len(y)), (1.0, 0.0, 0.0))
    far = np.zeros(len(y), dtype=bool)
    sizes = (1.0, 0.0, 0.0)
    for _ in range(_ROUNDS + 1):
        theta = _gauss_newton(model, theta, y, v)
        residual = y - evaluate(model, theta).predicted
        sizes = _moments(model, residual, starts, len(theta), np.sqrt(share))
        v = _covariance(model, starts, share, np.ones(len(y)), sizes)
        far = _outliers(residual, v)
        v = _covariance(model, starts, share, np.where(far, 1e6, 1.0), sizes)
    theta = _gauss_newton(model, theta, y, v)
    parts = evaluate(model, theta)
    J = linear_jacobian(model, theta, parts)
    return MomentFit(model, theta, parts, J, y - parts.predicted, v, *sizes, far)


def _noise_share(duration: Array) -> Array:
    """(n,) T̄/T, the variance of a record's white noise over that of a record of mean duration."""
    known = np.where(duration > 0, duration, 0.0)
    if not known.all():
        return np.ones(len(duration))
    return np.asarray(known.mean() / known)


def linear_jacobian(model: ChannelModel, theta: Array, parts: Parts) -> Array:
    """(n, q) derivative of the prediction by the linear coefficients alone."""
    full = jacobian(model, theta, parts)
    return full[:, : full.shape[1] - len(model.fitted_parameters)]


def _start(model: ChannelModel, nonlinear: Mapping[str, Mapping[str, float]]) -> Array:
    theta = model.start()
    for i, (effect, parameter) in enumerate(model.fitted_parameters):
        value = nonlinear.get(effect, {}).get(parameter.name)
        if value is not None:
            theta[model.linear + i] = parameter.carried(value)
    return theta


def _gauss_newton(model: ChannelModel, theta: Array, y: Array, v: Covariance) -> Array:
    for _ in range(_STEPS):
        parts = evaluate(model, theta)
        J = linear_jacobian(model, theta, parts)
        white = v.whiten(np.column_stack([J, y - parts.predicted]))
        step, _ = least_squares(white[:, :-1], white[:, -1])
        theta = theta.copy()
        theta[: len(step)] += step
        if np.abs(white[:, :-1] @ step).max(initial=0.0) < 1e-3:
            break
    return theta


def _moments(
    model: ChannelModel, residual: Array, starts: NDArray[np.int64], coefficients: int, root: Array
) -> tuple[float, float, float]:
    """σ, τ and ρ from the spread within runs, of slow and fast rows, and between the means of runs.

    root: (n,) √(T̄/T) of every record
    """
    sizes = np.diff(np.append(starts, len(residual)))
    means = np.add.reduceat(residual, starts) / sizes
    several = np.repeat(sizes > 1, sizes)
    within = (residual - np.repeat(means, sizes)) * np.sqrt(
        np.repeat(sizes / np.maximum(sizes - 1, 1), sizes)
    )
    if not several.any():
        within, several = residual, np.ones(len(residual), dtype=bool)
    size = np.abs(model.u)
    slow = several & (size < FAST[model.sensor])
    calm = slow if slow.sum() > 10 else several
    white = _spread(within[calm] / root[calm])
    fast = several & ~slow
    rate = 0.0
    if fast.sum() > 10 and slow.sum() > 10:
        noise = white * float(np.median(root[fast] / size[fast]))
        more = max(0.0, _spread(within[fast] / size[fast]) ** 2 - noise**2)
        rate = float(np.sqrt(more))
    between = 0.0
    if len(starts) > 3 and (sizes > 1).any():
        shrink = len(starts) / max(1.0, len(starts) - 0.3 * min(coefficients, len(starts) - 2))
        slow_runs = np.maximum.reduceat(size, starts) < FAST[model.sensor]
        chosen = means[slow_runs] if slow_runs.sum() > 3 else means
        between = float(np.sqrt(max(0.0, _spread(chosen) ** 2 * shrink - white**2 / sizes.mean())))
    floor = 1e-9 * max(float(np.sqrt(np.mean(model.u**2))), float(np.sqrt(np.mean(residual**2))), 1e-12)
    return max(white, floor), between, rate


def _spread(x: Array) -> float:
    return _MAD * float(np.median(np.abs(x)))


def _covariance(
    model: ChannelModel,
    starts: NDArray[np.int64],
    share: Array,
    inflate: Array,
    sizes: tuple[float, float, float],
) -> Covariance:
    white, between, rate = sizes
    diagonal = (white**2 * share + (rate * model.u) ** 2) * inflate
    slopes = np.ones((1, len(inflate))) if between > 0 else np.empty((0, len(inflate)))
    effects = RandomEffects(starts, diagonal[None, :], slopes)
    return woodbury(effects, np.array([1.0, between**2][: 1 + len(slopes)]))


def _outliers(residual: Array, v: Covariance) -> NDArray[np.bool_]:
    """(n,) rows far off the others of their run; none when they are too many to be accidents."""
    effects = v.effects
    sizes = np.diff(np.append(effects.starts, len(residual)))
    middle = np.array([np.median(run) for run in np.split(residual, effects.starts[1:])])
    left = np.where(np.repeat(sizes > 2, sizes), residual - np.repeat(middle, sizes), residual)
    spread = np.sqrt(v.diagonal + np.where(np.repeat(sizes > 2, sizes), 0.0, np.sum(v.Z**2, axis=1)))
    far = np.abs(left) > FAR * spread
    return far if far.mean() <= MOST_FAR else np.zeros(len(residual), dtype=bool)
