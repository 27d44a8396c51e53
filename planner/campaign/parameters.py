"""Parameters that do not enter linearly: where a fit starts, how far it steps, what no data observe."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from planner.measurement import ChannelModel, evaluate, jacobian
from planner.nouns.array import Array
from planner.protocols import Parameter
from planner.solvers.block_covariance import BlockCovariance
from planner.solvers.least_squares import least_squares
from planner.solvers.mixed_model import MixedFit
from planner.solvers.random_effects import Covariance, RandomEffects, covariance

STARTS = (0.1, 0.2, 0.4, 0.7, 1.0, 1.5, 2.5, 5.0)  # times the default of a logarithmic one
MOST_STARTS = 96  # for one effect, whatever the number of its parameters
MOST_ROWS = 4000  # enough to choose a start by
EDGE = 1e-6


def best_parameters(
    model: ChannelModel, theta: Array, y: Array, effects: RandomEffects, variances: Array
) -> Array:
    """θ (p,) with the parameters of every effect at the best of a grid over their ranges.

    variances: (K,) of `effects`. Rows are whitened: where a power-on's draw is ten times the noise, a decay
    would else be chosen to follow the draws.
    """
    rows, part = _some(effects)
    cut = replace(model, conditions=model.conditions.at(rows))
    v = covariance(part, variances)
    theta = theta.copy()
    names = [effect for effect, _ in model.fitted_parameters]
    for effect in dict.fromkeys(names):
        places = [model.linear + i for i, name in enumerate(names) if name == effect]
        grids = [_grid(p, len(places)) for e, p in model.fitted_parameters if e == effect]
        scores = {}
        for values in product(*grids):
            theta[places] = values
            scores[values] = _left(cut, theta, y[rows], v)
        theta[places] = min(scores, key=lambda values: scores[values])
    return theta


def _some(effects: RandomEffects) -> tuple[NDArray[np.bool_], RandomEffects]:
    """(n,) rows of evenly chosen whole power-ons, about MOST_ROWS, and what their V is made of."""
    groups = len(effects.starts)
    stays = np.zeros(groups, dtype=bool)
    count = max(1, int(groups * min(1.0, MOST_ROWS / effects.rows)))
    stays[np.linspace(0, groups - 1, count).round().astype(int)] = True
    return np.repeat(stays, effects.sizes), effects.at(stays)


def _grid(p: Parameter, together: int) -> Array:
    """Values of one parameter as they are carried; fewer where several must be tried together."""
    low, high = p.bounds
    most = max(3, int(MOST_STARTS ** (1.0 / together)))
    if p.scale == "logarithmic" and together == 1:
        return np.clip(p.carried(p.default) + np.log(STARTS), low, high)
    count = min(most, 24)
    return low + (np.arange(count) + 0.5) / count * (high - low)


def _left(model: ChannelModel, theta: Array, y: Array, v: Covariance | BlockCovariance) -> float:
    """Whitened sum of squares that the linear coefficients leave at these parameters."""
    parts = evaluate(model, theta)
    J = jacobian(model, theta, parts)[:, : model.linear]
    white = v.whiten(np.column_stack([J, y - parts.predicted]))
    beta, _ = least_squares(white[:, :-1], white[:, -1])
    return float(np.sum((white[:, -1] - white[:, :-1] @ beta) ** 2))


def limited(model: ChannelModel, old: Array, new: Array) -> Array:
    """A step in which no parameter changes more than twofold, or by an eighth of its range, or leaves it."""
    if not model.fitted_parameters:
        return new
    tail, new = slice(model.linear, len(old)), new.copy()
    bounds = np.array([p.bounds for _, p in model.fitted_parameters])
    most = np.array(
        [np.log(2.0) if p.scale == "logarithmic" else (p.bounds[1] - p.bounds[0]) / 8.0
         for _, p in model.fitted_parameters]
    )  # fmt: skip
    new[tail] = old[tail] + np.clip(new[tail] - old[tail], -most, most)
    new[tail] = np.clip(new[tail], bounds[:, 0], bounds[:, 1])
    return np.asarray(new)


def unobservable(model: ChannelModel, theta: Array, fit: MixedFit) -> list[tuple[str, str]]:
    """(effect, parameter) at an end of the range, or with an interval as wide as half of it."""
    if not model.fitted_parameters:
        return []
    bounds = np.array([p.bounds for _, p in model.fitted_parameters])
    error = np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))[model.linear :]
    value, width = theta[model.linear :], bounds[:, 1] - bounds[:, 0]
    at_end = np.minimum(value - bounds[:, 0], bounds[:, 1] - value) <= EDGE * width
    lost = at_end | (4.0 * error > width) | fit.undetermined[model.linear :]
    pairs = [(effect, p.name) for effect, p in model.fitted_parameters]
    return [pair for pair, gone in zip(pairs, lost, strict=True) if gone]
