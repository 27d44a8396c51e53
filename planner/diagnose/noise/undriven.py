"""Declared scale factors and leans that no input drives: as large as the spec says, and no larger.

A gyro that only rests reads the Earth's rate, 4e-3 deg/s. Free, a scale factor at every temperature and two
leans take up what goes with the attitude: of a g-sensitivity of 110 sigma they left what two power-ons of
unlike headings told, and of these one was "off". Its budget makes them random, of one sigma each,

    V' = V + Σ_k σ_k² x_k x_kᵀ,   σ_k = systematic + what temperature does to it,

x_k their columns (Lindley, Smith, J. R. Stat. Soc. B 34, 1972, 1). Without a budget they stay free.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from planner.diagnose.channels.channel import Channel, declared_columns, hardly_driven
from planner.diagnose.noise.channel_noise import ChannelNoise
from planner.spec.budget import ErrorBudget

BUDGET_OF = {
    "scale_factor": "scale_factor",
    "scale_factor_temperature": "scale_factor",
    "misalignment": "misalignment",
}
"""Effect whose coefficients an input drives -> the error whose budget says how large they can be."""


def as_budgeted_at_rest(
    c: Channel, noise: ChannelNoise, budgets: Mapping[str, ErrorBudget]
) -> tuple[Channel, ChannelNoise]:
    """The channel without the columns of what its budgets say, and its noise with them."""
    if not hardly_driven(c.model):
        return c, noise
    effects = [c.model.columns()[i].effect for i in declared_columns(c.model, c.found)]
    sigma = np.zeros(c.J.shape[1])
    for k, effect in enumerate(effects):
        budget = budgets.get(BUDGET_OF.get(effect, ""))
        if budget is not None:
            sigma[k] = budget.systematic_size + max((budget.residual_table or {}).values(), default=0.0)
    if not sigma.any():
        return c, noise
    known = noise.whiten((c.J * sigma)[:, sigma > 0.0])
    return replace(c, most=np.where(sigma > 0.0, 0.0, c.most)), replace(noise, known=known)
