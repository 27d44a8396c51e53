"""What the other budgets let differ, and is taken for a spread that it is not.

Misalignments that every power-on draws anew look like noise of its records at six faces, a nonlinearity of
the scale factor like that one's own spread. With x_t the columns of the terms of every other error, σ_t its
run-to-run, u the input, all about the mean of their power-on,

    bias, run to run            w² = σ_b² mean_ij exp(−|t_i − t_j| / τ),   σ_b, τ in-run of the bias itself
    bias, in run                w² = Σ_t σ_t² mean x_t² + σ_k² mean u²,    σ_k in-run of the scale factor
    scale factor, run to run    w² = Σ_t σ_t² (u · x_t / u · u)²
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.diagnose.hypotheses.channels import Channel, columns
from planner.diagnose.hypotheses.orthogonal import about_means
from planner.nouns.array import Array
from planner.spec.budget import ErrorBudget


def like_level(times: Array, starts: NDArray[np.int64], budget: ErrorBudget) -> float:
    """w of a bias' run-to-run (SI): what wanders within a power-on has a mean there.

    times: (n,) since power-on
    """
    if not budget.in_run_sigma:
        return 0.0
    alike = [np.exp(-np.abs(t[:, None] - t) / budget.in_run_time).mean() for t in np.split(times, starts[1:])]
    return float(budget.in_run_sigma * np.sqrt(np.mean(alike)))


def like_in_run(c: Channel, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]) -> float:
    """w of a bias' in-run (SI)."""
    drawn = sum(sigma**2 * float(np.mean(x**2)) for sigma, x in _drawn(c, starts, budgets))
    scale = budgets["scale_factor"].in_run_sigma if "scale_factor" in budgets else 0.0
    return float(np.sqrt(drawn + scale**2 * float(np.mean(c.u**2))))


def like_scale_factor(c: Channel, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]) -> float:
    """w of a scale factor's run-to-run; 0 where no input differs within a power-on."""
    u = _about(c.u[:, None], starts)[:, 0]
    square = float(u @ u)
    if square <= 0.0:
        return 0.0
    others = {name: b for name, b in budgets.items() if name != "scale_factor"}
    shares = (sigma**2 * float((u @ x) / square) ** 2 for sigma, x in _drawn(c, starts, others))
    return float(np.sqrt(sum(shares)))


def _drawn(
    c: Channel, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]
) -> Iterator[tuple[float, Array]]:
    """σ and x (n,) about the mean of its power-on, of every term of every error but the bias."""
    for name, budget in budgets.items():
        effect = catalog.effects().get(name)
        if effect is None or name == "bias" or budget.run_to_run is None:
            continue
        nonlinear = {p.name: p.default for p in effect.parameters}
        for x in _about(columns(c, name, nonlinear), starts).T:
            yield budget.run_to_run_largest, x


def _about(columns: Array, starts: NDArray[np.int64]) -> Array:
    """(n, k) columns about the mean of their power-on."""
    sizes = np.diff(np.append(starts, len(columns)))
    return about_means(columns, np.repeat(np.arange(len(starts)), sizes))
