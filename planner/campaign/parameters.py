"""Parameters that do not enter linearly: where a fit starts, how far it steps, what the data do not tell."""

from __future__ import annotations

from itertools import product

import numpy as np

from planner.measurement import ChannelModel, evaluate, jacobian
from planner.protocols import Parameter
from planner.records import Array
from planner.solvers.least_squares import least_squares
from planner.solvers.mixed_model import MixedFit

STARTS = (0.1, 0.2, 0.4, 0.7, 1.0, 1.5, 2.5, 5.0)  # times the default of a logarithmic one
MOST_STARTS = 96  # for one effect, whatever the number of its parameters
MOST_ROWS = 4000  # enough to choose a start by
EDGE = 1e-6


def best_start(model: ChannelModel, y: Array) -> Array:
    """(p,) parameters of every effect at the best of a grid over their ranges, the rest zero."""
    theta = model.start()
    if not model.fitted_parameters:
        return theta
    thin, rows = _thinned(model, len(y))
    names = [effect for effect, _ in model.fitted_parameters]
    for effect in dict.fromkeys(names):
        places = [model.linear + i for i, name in enumerate(names) if name == effect]
        grids = [_grid(p, len(places)) for e, p in model.fitted_parameters if e == effect]
        scores = {}
        for values in product(*grids):
            theta[places] = values
            scores[values] = _left(thin, theta, y[rows])
        theta[places] = min(scores, key=lambda values: scores[values])
    return theta


def _thinned(model: ChannelModel, n: int) -> tuple[ChannelModel, Array]:
    from dataclasses import fields, replace

    rows = np.unique(np.linspace(0, n - 1, min(n, MOST_ROWS)).astype(int))
    c = model.conditions
    cut = replace(c, **{f.name: getattr(c, f.name)[rows] for f in fields(c)})
    return replace(model, conditions=cut), rows


def _grid(p: Parameter, together: int) -> Array:
    """Values of one parameter as they are carried; fewer where several must be tried together."""
    low, high = p.bounds
    most = max(3, int(MOST_STARTS ** (1.0 / together)))
    if p.scale == "logarithmic" and together == 1:
        return np.clip(p.carried(p.default) + np.log(STARTS), low, high)
    count = min(most, 24)
    return low + (np.arange(count) + 0.5) / count * (high - low)


def _left(model: ChannelModel, theta: Array, y: Array) -> float:
    """Sum of squares that the linear coefficients leave at these parameters."""
    parts = evaluate(model, theta)
    J = jacobian(model, theta, parts)[:, : model.linear]
    beta, _ = least_squares(J, y - parts.predicted)
    return float(np.sum((y - parts.predicted - J @ beta) ** 2))


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


def untold(model: ChannelModel, theta: Array, fit: MixedFit) -> list[tuple[str, str]]:
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
