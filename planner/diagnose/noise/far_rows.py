"""Rows far off under the noise that the others show: the accidents themselves must not tell its shape."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.noise.beside_budgets import between
from planner.diagnose.noise.channel_noise import Readings, channel_noise
from planner.diagnose.noise.outliers import FAR_WEIGHT, LEAST_FAR, Far, outliers
from planner.nouns.array import Array
from planner.spec.model import Unit


def scale_scatter(unit: Unit | None, c: Channel) -> Array:
    """(n,) SI: what the scale factor, drawn anew at every power-on by the spec, changes of each reading."""
    budget = None if unit is None else getattr(unit, c.sensor).get("scale_factor")
    if budget is None:
        return np.zeros(len(c.r))
    size = np.abs(c.u)
    inputs = budget.run_to_run_over_input
    sigma = np.interp(size, *np.transpose(inputs)) if inputs else budget.run_to_run_largest
    return np.asarray(sigma * size)


def drawn(unit: Unit | None, c: Channel) -> Array:
    """(n, t) SI: what each term of every error but the bias, drawn at every power-on by the spec, changes.

    σ_t x_t. At 80 g a g-sensitivity of which each power-on draws 2e-4 deg/s/g is five times a record's noise.
    """
    columns = [scale_scatter(unit, c) * np.sign(c.u)]
    budgets = {} if unit is None else getattr(unit, c.sensor)
    columns += [x for (error, _), x in between(c, budgets) if error not in ("bias", "scale_factor")]
    return np.column_stack(columns)


def far_rows(
    plain: Readings,
    candidates: Array,
    cells: NDArray[np.int64],
    scatter: Array,
    draws: Array | None = None,
) -> Far:
    """The rows of a channel that are left out, by the spread of those that are not suspect at first sight.

    plain: its readings under the declared model alone, every row at its full weight
    scatter: (n,) one sigma by which a row may be off with its whole power-on (`scale_scatter`)
    draws: (n, t) what each power-on may draw (`drawn`), which its own rows tell; None: nothing
    """
    c, starts = plain.channel, plain.starts
    first = outliers(c, candidates, starts, channel_noise(plain).spread, cells)
    suspect = first.size > LEAST_FAR
    if not suspect.any():
        return first
    weights = np.where(suspect, FAR_WEIGHT, 1.0)
    noise = channel_noise(plain.with_noise(weights=weights))
    spread = noise.spread * np.sqrt(weights)
    return outliers(c, candidates, starts, spread, cells, scatter, draws, noise.with_power_on)


def without_far(plain: Readings, blocks: Sequence[Array], far: NDArray[np.bool_]) -> Readings:
    """The readings beside more blocks (n, k), rows that are far off (n,) at next to no weight.

    Themselves where there are neither: their noise is judged already.
    """
    if not blocks and not far.any():
        return plain
    return replace(plain, blocks=tuple(blocks), weights=np.where(far, FAR_WEIGHT, 1.0))
