"""What few power-ons say of a spread together with what the spec says of it.

Of a scale factor's or a lean's run-to-run a dozen power-ons on an arm tell, beside all candidates, four
degrees of freedom: in one channel of fifty it comes out at a third of itself, and in half of a triad's at
zero. A budget is an engineer's statement of the same variance, right within a factor of two of its sigma b:

    log p(θ) = −(f / 2) (log (θ + s) + (θ̂ + s) / (θ + s))  −  (log θ − log b²)² / (2 (2 log 2)²)

f and s of the estimate's law (`spread_law`). The noise has the mean of that and its variance. A hundred
power-ons say what their spread is whatever the budget; without a budget all is as the rows say.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from planner.diagnose.noise.channel_noise import ChannelNoise
from planner.diagnose.noise.components import LEANS, of_effect
from planner.diagnose.noise.spread_law import SpreadLaw, errors, spread_law
from planner.solvers.random_effects import covariance
from planner.spec.budget import ErrorBudget

WITHIN = 2.0 * np.log(2.0)  # one sigma of the log of a variance of which a budget is the sigma
BEYOND = 12.0  # of the log of a variance, at which neither rows nor budget have any of it
GRID = 400
KNOWN = 0.2  # of a variance, to which fifty power-ons tell it: a budget's share is then (0.2 / WITHIN)², 2 %
DRAWN = ("scale_factor", LEANS)


def with_stated(noise: ChannelNoise, budgets: Mapping[str, ErrorBudget]) -> ChannelNoise:
    """The noise of a channel with its spreads from power-on to power-on as rows and budgets say."""
    v = noise.variances
    theta, growth = v.theta.copy(), np.ones(len(v.theta))
    for name in DRAWN:
        budget = budgets.get(name)
        if budget is None or not budget.has_run_to_run:
            continue
        stated = budget.run_to_run_largest**2
        for component in of_effect(name, noise.components) or [f"run_to_run_{name}"]:
            if component in noise.components:
                k = noise.components.index(component)
                theta[k], growth[k] = _both(noise, k, stated)
    if np.array_equal(theta, v.theta):
        return noise
    wider = replace(v, theta=theta, error=v.error * np.outer(growth, growth))
    return replace(noise, variances=wider, covariance=covariance(noise.covariance.effects, theta), rows=noise)


def _both(noise: ChannelNoise, k: int, stated: float) -> tuple[float, float]:
    """A variance by rows and budget, and by how much its standard error grows."""
    theta, error = float(noise.variances.theta[k]), float(np.sqrt(max(noise.variances.error[k, k], 0.0)))
    if error <= KNOWN * theta:
        return theta, 1.0
    whole, half = errors(noise, [k]) if noise.variances.free[k] else (0.0, 0.0)  # none where it came out zero
    law = spread_law(theta, error, error * half / whole if whole > 0.0 else error)
    mean, sigma = by_both(law, stated)
    return mean, sigma / error


def by_both(law: SpreadLaw, stated: float) -> tuple[float, float]:
    """Mean and one sigma of a variance by the law of its estimate and a budget's variance b²."""
    ends = np.log([min(stated, max(law.theta, 1e-6 * stated)), max(stated, law.theta)])
    log_theta = np.linspace(ends[0] - BEYOND, ends[1] + BEYOND, GRID)
    theta = np.exp(log_theta)
    over = (law.theta + law.shift) / (theta + law.shift)
    log_p = 0.5 * law.freedom * (np.log(over) - over) - 0.5 * ((log_theta - np.log(stated)) / WITHIN) ** 2
    p = np.exp(log_p - log_p.max())
    mean = float(p @ theta / p.sum())
    return mean, float(np.sqrt(max(p @ theta**2 / p.sum() - mean**2, 0.0)))
