"""Coefficients of which the spec's budget says more than the data: they stay within the budget.

A term that no record drives (ω_x ω_y where no record turns about two axes) has an estimate as wide as the
noise over what little drives it. Flown, it does more harm than the error.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.campaign.estimate import Estimate, weighed
from planner.measurement import evaluate, jacobian
from planner.nouns.array import Array
from planner.solvers.distributions import normal_quantile
from planner.spec.model import Spec

TOLD = 0.5  # of its budget, within which a drawn coefficient is told by the data
STEPS = 4  # of Gauss-Newton, from where the linear solution is: products are small then


def weak(fit: Estimate, half: Array, spec: Spec, drawn: Array | float = np.inf) -> NDArray[np.bool_]:
    """(p,) intervals wider than the error's whole budget; than a quarter of its range for a parameter.

    half: (p,) half-widths; drawn: those of `within_budget`, for what only others made weak is told once these
    are within their budgets. Coefficients that are undetermined are not among them.
    """
    wide = _wide(fit, spec)
    return ~fit.fit.undetermined & (half > wide) & (drawn > TOLD * wide)


def within_budget(fit: Estimate, half: Array, spec: Spec) -> Estimate:
    """The channel with its weak coefficients, w, drawn to zero by their budgets, and the others with them.

    θ' = θ − C_w (C_ww + P)⁻¹ θ_w,  C' = C − C_w (C_ww + P)⁻¹ C_wᵀ,  P = diag(B / 1.96)²: what a record "w is
    zero within its budget B" would make of the fit (a normal distribution conditioned; Rasmussen, Williams,
    Gaussian Processes, 2006, eq A.6). Not drawn: a coefficient whose own interval excludes zero (the data
    contradict that budget), one that other channels share, a parameter of a shape.
    """
    drawn = weak(fit, half, spec) & (np.abs(fit.theta) <= half)
    own = [not c.parameter and not fit.model.shares(c) for c in fit.model.columns()]
    w = np.flatnonzero(drawn & own)
    if not len(w):
        return fit
    C = fit.fit.covariance
    P = np.diag((_wide(fit, spec)[w] / normal_quantile(0.975)) ** 2)
    gain = np.linalg.solve(C[np.ix_(w, w)] + P, C[w]).T
    theta, covariance = fit.theta - gain @ fit.theta[w], C - gain @ C[w]
    told = normal_quantile(0.975) * np.sqrt(np.diag(covariance)[w]) <= TOLD * _wide(fit, spec)[w]
    theta = _beside(fit, theta, w[~told])
    known = replace(fit.fit, coefficients=theta, covariance=0.5 * (covariance + covariance.T))
    return replace(fit, theta=theta, fit=known)


def _beside(fit: Estimate, theta: Array, weak: NDArray[np.intp]) -> Array:
    """(p,) θ with the others fitted anew beside those that were drawn, by Gauss-Newton: they may be products.

    A scale factor that goes from −0.2 to 0 takes a fifth of every misalignment with it.
    """
    others = np.setdiff1d(np.arange(fit.model.linear), weak)
    y = fit.residual + evaluate(fit.model, fit.theta).predicted
    for _ in range(STEPS):
        parts = evaluate(fit.model, theta)
        J = jacobian(fit.model, theta, parts)[:, others]
        target = y - parts.predicted + J @ theta[others]
        theta = theta.copy()
        theta[others], _, _ = weighed(target, J, fit.prior, fit.noise, fit.variances)
    return theta


def _wide(fit: Estimate, spec: Spec) -> Array:
    """(p,) half-width above which a coefficient is weak; infinite where the spec gives no budget."""
    budgets = getattr(spec.unit, fit.model.sensor)
    ranges = {(effect, p.name): p.bounds for effect, p in fit.model.fitted_parameters}
    found = []
    for c in fit.model.columns():
        if c.parameter:
            low, high = ranges[c.effect, c.parameter]
            found.append(min(1.0, 0.25 * (high - low)))
        else:
            size = budgets[c.effect].whole_variation if c.effect in budgets else 0.0
            found.append(size if size > 0 else np.inf)
    return np.array(found)
