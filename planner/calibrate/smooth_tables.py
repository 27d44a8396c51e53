"""Fitted nodes → smooth tables with as many nodes as asked for, and what lines between these miss.

    θ̂(T) = w(T)ᵀ v̂,   var(θ̂(T) − θ(T)) = wᵀ C w + κ (M(T, T) − 2 wᵀ M(T_k, T) + wᵀ M w)

The posterior mean of constant and curve (planner.information.smooth, planner.calibrate.curve_nodes); whoever
reads the table draws straight lines between its nodes, and needs more of them than the bench visited.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from planner.calibrate.curve_nodes import CurveNodes, curve_nodes, size_of
from planner.campaign.estimate import Estimate
from planner.information.curves import Curves
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.calibration import SmoothTable
from planner.solvers.distributions import normal_quantile, student_quantile
from planner.solvers.kriging import kriging_weights
from planner.spec.model import Spec
from planner.spec.own_units import own_unit

EVERY_K = 5.0
IN_A_GAP = 4  # nodes from one visited temperature to the next, at least: lines between few undo the smoothing
MOST_NODES = 33
BETWEEN = 4  # places looked at in every segment


def smooth_tables(
    fits: Sequence[Estimate], curves: Curves, count: int | None = None
) -> tuple[SmoothTable, ...]:
    """Of every table whose error's curve the spec knows; count: nodes, None: as `export_nodes` has them."""
    found: list[SmoothTable] = []
    every = curve_nodes(fits)
    for error in dict.fromkeys(c.error for c in every):
        mine = [c for c in every if c.error == error]
        grid = export_nodes(curves.spec, mine, count)
        fine = np.unique(np.append(np.linspace(grid[0], grid[-1], BETWEEN * (len(grid) - 1) + 1), grid))
        points = np.unique(np.concatenate([fine, *(c.degc for c in mine)]))
        prior = curves.prior(error, points)
        if prior is not None and np.any(prior):
            found += _of_error(mine, points, prior, grid, fine, own_unit(curves.spec, *error))
    return tuple(found)


def export_nodes(spec: Spec, tables: Sequence[CurveNodes], count: int | None) -> Array:
    """(N,) evenly over the temperatures of use and all that were visited.

    count: so many; None: every 5 K and four times from one visited temperature to the next, 33 at most
    """
    low, high = spec.plan.temperatures.range
    low = min([low, *(float(c.degc[0]) for c in tables)])
    high = max([high, *(float(c.degc[-1]) for c in tables)])
    gaps = np.concatenate([[EVERY_K], *(np.round(np.diff(c.degc), 1) / IN_A_GAP for c in tables)])
    every = max(float(gaps.min()), (high - low) / (MOST_NODES - 1))
    return np.linspace(low, high, count or int(np.ceil((high - low) / every - 0.01)) + 1)


def _of_error(
    channels: Sequence[CurveNodes], points: Array, prior: Array, grid: Array, fine: Array, unit: str
) -> list[SmoothTable]:
    places = [np.searchsorted(points, c.degc) for c in channels]
    moments = [prior[np.ix_(own, own)] for own in places]
    size = size_of(channels, moments)
    on_fine = np.searchsorted(points, fine)
    found = []
    for c, own in zip(channels, places, strict=True):
        M = size.value * prior
        value, sigma, half = _posterior(c, M, own, on_fine)
        at = np.searchsorted(fine, grid)
        found.append(
            SmoothTable(
                error=".".join(c.error),
                channel=AXES[c.channel],
                term=c.term,
                unit=unit,
                temperature_degc=grid,
                value=value[at],
                standard_error=sigma[at],
                low=value[at] - half[at],
                high=value[at] + half[at],
                size=(size.value**0.5, size.low**0.5, size.high**0.5),
                between_degc=fine,
                missed=value - np.interp(fine, grid, value[at]),
            )
        )
    return found


def _posterior(
    c: CurveNodes, M: Array, own: NDArray[np.intp], read: NDArray[np.intp]
) -> tuple[Array, Array, Array]:
    """(X,) value, sigma and half of the 95 % interval at the points `read`; the noise by Student's t."""
    K, across = M[np.ix_(own, own)], M[np.ix_(own, read)]
    w = kriging_weights(K + c.noise, across)
    noise = np.einsum("xk,kl,xl->x", w, c.noise, w)
    curve = M[read, read] - 2.0 * np.einsum("xk,kx->x", w, across) + np.einsum("xk,kl,xl->x", w, K, w)
    curve = np.maximum(curve, 0.0)
    student, normal = student_quantile(0.975, c.freedom.min()), normal_quantile(0.975)
    return w @ c.values, np.sqrt(noise + curve), np.sqrt(student**2 * noise + normal**2 * curve)
