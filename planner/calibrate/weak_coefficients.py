"""Coefficients of which the spec's budget says more than the data: they stay within the budget.

A term that no record drives (ω_x ω_y where no record turns about two axes) has an estimate as wide as the
noise over what little drives it. Flown, it does more harm than the error.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.campaign.estimate import Estimate
from planner.nouns.array import Array
from planner.solvers.distributions import normal_quantile
from planner.spec.model import Spec


def weak(fit: Estimate, half: Array, spec: Spec) -> NDArray[np.bool_]:
    """(p,) intervals wider than the error's whole budget; than a quarter of its range for a parameter.

    half: (p,) half-widths. Coefficients that are undetermined are not among them.
    """
    return ~fit.fit.undetermined & (half > _wide(fit, spec))


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
    known = replace(fit.fit, coefficients=theta, covariance=0.5 * (covariance + covariance.T))
    return replace(fit, theta=theta, fit=known)


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
