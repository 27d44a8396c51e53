"""Intervals of a channel's fit beside a parameter: what an effect of one time constant has, by the profile.

The other coefficients, and other effects' parameters by their slopes, are fitted anew at every p; the
variances are those of the fit. t is Student's with each coefficient's own degrees of freedom, longer by what
estimated variances add to its error (Kenward, Roger), as in every other interval.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from planner.campaign.estimate import Estimate, with_pseudo_records
from planner.measurement import evaluate, jacobian
from planner.protocols import Parameter
from planner.solvers.distributions import student_quantile
from planner.solvers.least_squares import factors
from planner.solvers.profile_interval import Held, held_of, profile_intervals
from planner.solvers.random_effects import covariance


def profiled(fit: Estimate, confidence: float) -> dict[int, tuple[float, float]]:
    """Column -> its interval, parameters as they are carried: of effects with one parameter that is fitted.

    Not of tables over temperature, of what channels share or of what is undetermined.
    """
    columns = fit.model.columns()
    names = [effect for effect, _ in fit.model.fitted_parameters]
    found: dict[int, tuple[float, float]] = {}
    for i, (effect, p) in enumerate(fit.model.fitted_parameters):
        mine = [k for k, c in enumerate(columns) if c.effect == effect and not c.parameter]
        plain = all(np.isnan(columns[k].node_degc) and not fit.model.shares(columns[k]) for k in mine)
        place = fit.model.linear + i
        if names.count(effect) == 1 and plain and not fit.fit.undetermined[[*mine, place]].any():
            found |= _intervals(fit, mine, place, p, confidence)
    return found


def _intervals(
    fit: Estimate, mine: Sequence[int], place: int, p: Parameter, confidence: float
) -> dict[int, tuple[float, float]]:
    """Of the coefficients `mine` of an effect and of its parameter, which stands at `place`."""
    every = [place, *mine]
    error = np.sqrt(np.maximum(np.diag(fit.fit.covariance)[every], 0.0))
    by_slopes = np.linalg.norm(fit.fit.factors.to_coefficients[every], axis=1)
    wide = student_quantile((1.0 + confidence) / 2.0, fit.fit.freedom[every])
    reach = wide * error / np.maximum(by_slopes, 1e-300)
    told = profile_intervals(
        _held(fit, mine, place),
        float(fit.theta[place]),
        float(wide[0] * error[0]),
        p.bounds,
        float(reach[0]),
        reach[1:],
    )
    if told is None:
        return {}
    sizes = zip(mine, told.lows.tolist(), told.highs.tolist(), strict=True)
    return {place: (told.low, told.high), **{k: (low, high) for k, low, high in sizes}}


def _held(fit: Estimate, mine: Sequence[int], place: int) -> Callable[[float], Held | None]:
    """The fit with the parameter held: y + J θ − ŷ on the effect's columns there, beside all others."""
    others = np.setdiff1d(np.arange(len(fit.theta)), [*mine, place])
    y = fit.residual + fit.J @ fit.theta - fit.J[:, place] * fit.theta[place]
    X, target, effects, full = with_pseudo_records(y, fit.J[:, others], fit.prior, fit.noise, fit.variances)
    v = covariance(effects, full.theta)
    white = v.whiten(np.column_stack([X, target]))
    Q = factors(white[:, :-1]).basis
    z = white[:, -1] - Q @ (Q.T @ white[:, -1])

    def at(value: float) -> Held | None:
        theta = fit.theta.copy()
        theta[place] = value
        g = jacobian(fit.model, theta, evaluate(fit.model, theta))[:, mine]
        G = v.whiten(np.concatenate([g, np.zeros((len(target) - len(g), len(mine)))]))
        left = G - Q @ (Q.T @ G)
        return held_of(left.T @ left, left.T @ z, np.sum(G**2, axis=0))

    return at
