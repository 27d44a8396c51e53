"""How well a mean is known: the confidence interval of a mean over power-ons (K 2.5.2, eq. 27).

    d = q(n) · s / √n

with s the standard deviation of what one repeat measures: run-to-run at the temperature, and beside it what
the records of the repeat add (`planner.plan.records_to_spread`; nothing in K's own formula). q is the
two-sided quantile: of Student's t with n − 1 degrees of freedom, or the normal one as published (1.960 for
95 %; K prints 2.96 for 99 %, the value is 2.576). d falls strictly with n in both cases, so the smallest n
for a given d is unique.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from planner.nouns.allowances import ErrorModel
from planner.nouns.array import Array
from planner.solvers.distributions import normal_quantile, student_quantile
from planner.spec.model import Spec


def quantile(confidence: float, kind: str, repeats: NDArray[np.int64]) -> Array:
    """Two-sided quantile for each number of repeats; infinite for one repeat under Student's t."""
    upper = (1 + confidence) / 2
    if kind == "normal":
        return np.full(len(repeats), float(normal_quantile(upper)))
    values = np.full(len(repeats), np.inf)
    enough = repeats > 1
    values[enough] = student_quantile(upper, repeats[enough] - 1.0)
    return values


def half_width(confidence: float, kind: str, spread: float, repeats: Sequence[int]) -> Array:
    """d = q(n) · s / √n for each n."""
    n = np.asarray(repeats, dtype=np.int64)
    return _known_by(quantile(confidence, kind, n), np.full(len(n), spread), n)


def needed_repeats(confidence: float, kind: str, spread: float, allowed: float, most: int) -> int | None:
    """The smallest n <= most with q(n) · s / √n <= allowed, the fixed point in n; None when there is none."""
    enough = np.flatnonzero(half_width(confidence, kind, spread, range(1, most + 1)) <= allowed)
    return int(enough[0]) + 1 if len(enough) else None


def spread_at(model: ErrorModel, temperatures: Sequence[float], test: str | None = None) -> Array:
    """Sigma of one repeat of a test at each temperature: s² = run-to-run² + what its records add².

    Run-to-run is linear between the table's points, constant outside them; without a test it stands alone.
    """
    known, sigma = (np.array(column) for column in zip(*model.run_to_run, strict=True))
    alone = np.full(len(temperatures), sigma[0])
    if len(known) > 1:
        alone = np.interp(np.array(temperatures), known, sigma)
    added = model.within.get(test, 0.0) if test is not None else 0.0
    return np.asarray(np.hypot(alone, added))


def half_widths(
    spec: Spec, model: ErrorModel, test: str, temperatures: Sequence[float], repeats: Sequence[int]
) -> Array:
    """d at each temperature for given repeats of a test."""
    n = np.asarray(repeats, dtype=np.int64)
    q = quantile(spec.plan.confidence, spec.plan.quantile, n)
    return _known_by(q, spread_at(model, temperatures, test), n)


def _known_by(q: Array, spread: Array, n: NDArray[np.int64]) -> Array:
    """q s / √n; what does not scatter is known by one repeat, whatever its quantile."""
    return np.asarray(np.where(spread > 0, q, 0.0) * spread / np.sqrt(n))
