"""What an integer program chooses among: groups of rows that share resources, limits, cuts.

    min  Σ_g Σ_r cost_gr x_gr + Σ_k price_k y_k
    s.t. Σ_r x_gr = 1                            for every group g
         Σ_g Σ_r contribution_grc x_gr <= limit_c  for every constraint c
         y_k >= Σ_r amount_grk x_gr              for every resource k and every group g that uses it
         y_k <= forced_k + Σ_g Σ_r amount_grk x_gr, y_k <= 1   for every k with a negative price
         x binary, y >= forced (continuous: settled by x)

A resource is paid for by the largest amount that any group asks of it: a soak (0 or 1), an installation, the
repeats of a record that serves several groups. A resource with a negative price is saved once when any group
uses it; its amounts are 0 or 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Rows = tuple[int, ...]

# Contributions are sums of some ten products: a selection may exceed a limit by rounding only.
LIMIT_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Group:
    """What one group can choose: cost (R,), contribution (R, C) to the limits, amounts (R, K) of resources.

    index (R,) is the row's number for the caller; it survives when rows are left out.
    """

    cost: Array
    contribution: Array
    amounts: Array
    index: Indices

    def take(self, rows: Indices) -> Group:
        """The group with only these rows."""
        return Group(self.cost[rows], self.contribution[rows], self.amounts[rows], self.index[rows])


@dataclass(frozen=True)
class Problem:
    """Groups, prices (K,) of the resources, limits (C,), amounts (K,) that are paid for in any case.

    within (K,): the resource that every row which uses this one uses as much of, −1 for none. It says nothing
    new about selections; where the price is negative it keeps the linear relaxation close to them.
    """

    groups: tuple[Group, ...]
    prices: Array
    limits: Array
    forced: Array
    within: Indices | None = None

    def cost(self, chosen: Sequence[int]) -> float:
        """Exact cost of a selection (positions within the groups)."""
        amounts = self.forced
        for group, r in zip(self.groups, chosen, strict=True):
            amounts = np.maximum(amounts, group.amounts[r])
        own = sum(float(group.cost[r]) for group, r in zip(self.groups, chosen, strict=True))
        return own + float(self.prices @ amounts)

    def usage(self, chosen: Sequence[int]) -> Array:
        """(C,) left-hand sides of a selection."""
        parts = [group.contribution[r] for group, r in zip(self.groups, chosen, strict=True)]
        return np.asarray(np.array(parts).reshape(-1, len(self.limits)).sum(axis=0))

    def within_limits(self, chosen: Sequence[int]) -> bool:
        """Whether a selection keeps every limit, up to rounding."""
        return bool(np.all(self.usage(chosen) <= self.limits * (1 + LIMIT_TOLERANCE)))


@dataclass(frozen=True)
class Cut:
    """Σ_g Σ_r coefficients[g][r] x_gr <= limit, coefficients by the caller's row numbers."""

    coefficients: tuple[Array, ...]
    limit: float
