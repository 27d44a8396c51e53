"""What few power-ons say of a spread together with what the spec says of it.

Of a scale factor's or a lean's run-to-run a dozen power-ons on an arm tell, beside all candidates, four
degrees of freedom: in one channel of fifty it comes out at a third of itself, and in half of a triad's at
zero. A budget is an engineer's statement of the same variance, right within a factor of two of its sigma b:

    log p(θ) = −(f / 2) (log (θ + s) + (θ̂ + s) / (θ + s))  −  (log θ − log b²)² / (2 (2 log 2)²)

f and s of the estimate's law (`spread_law`). The noise has exp(E log θ), as well known as an inverse χ² is of
which the logarithm varies as much, of ν degrees,

    ψ'(ν / 2) = var log θ     (Smyth, Stat. Appl. Genet. Mol. Biol. 3, 2004, 3)

F and Student's law are made for those; its own scale is smaller, so that they ask a little more. By the mean
and the variance of θ itself, which one tail makes, three degrees with a budget that agrees were one.
A hundred power-ons say what their spread is whatever the budget; without a budget all is as the rows say.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
STEPS = 8  # of Newton's, which has all digits after four
KNOWN = 0.2  # of a variance, to which fifty power-ons tell it: a budget's share is then (0.2 / WITHIN)², 2 %
DRAWN = ("scale_factor", LEANS)


def stated_variances(components: Sequence[str], budgets: Mapping[str, ErrorBudget]) -> dict[int, float]:
    """Place among the components of a noise -> b² of a spread between power-ons that has a budget."""
    found = {}
    for name in DRAWN:
        budget = budgets.get(name)
        if budget is None or not budget.has_run_to_run:
            continue
        for component in of_effect(name, components) or [f"run_to_run_{name}"]:
            if component in components:
                found[components.index(component)] = budget.run_to_run_largest**2
    return found


def with_stated(noise: ChannelNoise, budgets: Mapping[str, ErrorBudget]) -> ChannelNoise:
    """The noise of a channel with its spreads from power-on to power-on as rows and budgets say."""
    v = noise.variances
    theta, growth = v.theta.copy(), np.ones(len(v.theta))
    for k, stated in stated_variances(noise.components, budgets).items():
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
    both, sigma = by_both(law, stated)
    return both, sigma / error


def by_both(law: SpreadLaw, stated: float) -> tuple[float, float]:
    """A variance θ and its one sigma θ √(2 / ν) by the law of its estimate and a budget's variance b²."""
    ends = np.log([min(stated, max(law.theta, 1e-6 * stated)), max(stated, law.theta)])
    log_theta = np.linspace(ends[0] - BEYOND, ends[1] + BEYOND, GRID)
    theta = np.exp(log_theta)
    over = (law.theta + law.shift) / (theta + law.shift)
    log_p = 0.5 * law.freedom * (np.log(over) - over) - 0.5 * ((log_theta - np.log(stated)) / WITHIN) ** 2
    p = np.exp(log_p - log_p.max())
    p /= p.sum()
    middle = float(p @ log_theta)
    half = _half_of_degrees(float(p @ (log_theta - middle) ** 2))
    return float(np.exp(middle)), float(np.exp(middle) / np.sqrt(half))


def _half_of_degrees(variance: float) -> float:
    """ν / 2 with ψ'(ν / 2) = variance, by Newton's method in 1 / ψ', which is nearly a straight line."""
    from scipy.special import polygamma

    half = 0.5 + 1.0 / variance
    for _ in range(STEPS):
        slope = float(polygamma(1, half))
        half += slope * (1.0 - slope / variance) / float(polygamma(2, half))
    return half
