"""Residuals before and after and added variables of every channel, in the order of the given table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.diagnose.channels.channel import Channel, at_rows, columns
from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.hypotheses.candidates import effect_blocks
from planner.diagnose.hypotheses.estimates import estimates
from planner.diagnose.hypotheses.pool import Pool
from planner.diagnose.noise.components import (
    CROSS_NOISE,
    IN_RUN,
    IN_RUN_SCALE,
    RATE_NOISE,
    drawn_of_power_ons,
)
from planner.diagnose.noise.whitened import Whitened
from planner.diagnose.references.references import REFERENCES
from planner.diagnose.search.sensor import SensorFound
from planner.dwells.table_rows import rows_of
from planner.nouns.array import Array
from planner.nouns.diagnosis import Evidence
from planner.nouns.dwell_table import DwellTable
from planner.solvers.least_squares import least_squares

MOST_ROWS = 40_000  # that a chart can show


def evidence(s: SensorFound, data: Prepared) -> list[Evidence]:
    """What the report draws, for the three channels of a sensor; of a large table as many rows as it can."""
    n = len(data.full)
    if n <= MOST_ROWS or data.attitude is not None:
        return [_of(s, data, c) for c in s.channels]
    judged = np.flatnonzero(data.where >= 0)
    rows = judged[:: -(-len(judged) // MOST_ROWS)]
    part = replace(data, full=rows_of(data.full, rows), where=data.where[rows])
    return [replace(_of(s, part, c), rows=rows) for c in s.channels]


def among(e: Evidence, kept: NDArray[np.bool_]) -> Evidence:
    """Evidence of a table's rows that were kept (n,), as evidence of some rows of the whole table."""
    rows = np.flatnonzero(kept)
    return replace(e, rows=rows if e.rows is None else rows[e.rows])


def _of(s: SensorFound, data: Prepared, c: Channel) -> Evidence:
    w = s.found.pool.state[c.axis]
    blocks = [b for b in s.found.library if c.axis in s.found.pool.blocks[b].columns]
    readings = data.full.gyro if s.sensor == "gyro" else data.full.acc
    assert readings is not None  # the sensor was searched
    free = data.attitudes()[1] if s.sensor == "accelerometer" else None
    whole = at_rows(c, data.full.conditions(), readings[:, c.axis], free)
    small = [s.found.pool.blocks[b].columns[c.axis] for b in blocks]
    full = [_columns(s, whole, b, data.full) for b in blocks]
    levels = _levels_of_their_own(w, data)
    before = _residual(w, c, whole, [], [], levels)
    own, shared = _variances(w, whole, data)
    return Evidence(
        channel=c.name,
        before=before,
        after=_residual(w, c, whole, small, full, levels) if blocks else before,
        expected=np.sqrt(own + np.sum(shared**2, axis=0)),
        added=_added(s, w, blocks, data),
        shared=shared,
    )


def _columns(s: SensorFound, whole: Channel, b: int, table: DwellTable) -> Array:
    """The block's columns on the full table."""
    block = s.found.pool.blocks[b]
    if block.reference:
        return REFERENCES[block.name].columns(whole, table, block.place)
    if len(block.columns) == 1:
        every = effect_blocks([whole], block.name, block.nonlinear)
        x = next(x for x in every if set(x.terms) >= set(block.terms) and x.place == block.place)
        fewer = [x.terms.index(t) for t in block.terms] if x.terms != block.terms else slice(None)
        return x.columns[whole.axis][:, fewer]
    names = [t.name for t in catalog.effects()[block.name].terms(s.sensor)]
    shared = columns(whole, block.name, dict(block.nonlinear))
    return shared[:, [names.index(t) for t in block.terms]]


def _levels_of_their_own(w: Whitened, data: Prepared) -> Array:
    """(N, g − 1) `fixed_runs` of the full table: where power-ons are few, what no model of them sees."""
    fixed, runs = w.noise.fixed_runs[data.starts], data.table.run[data.starts]
    order = np.argsort(runs)
    at = order[np.clip(np.searchsorted(runs[order], data.full.run), 0, len(runs) - 1)]
    return np.where((runs[at] == data.full.run)[:, None], fixed[at], 0.0)


def _residual(
    w: Whitened, c: Channel, whole: Channel, small: Sequence[Array], full: Sequence[Array], levels: Array
) -> Array:
    """(N,) what generalised least squares with these columns leaves.

    A level that is drawn from power-on to power-on stays in it, one that is each power-on's own does not.
    """
    X = np.column_stack([c.J, *small, w.noise.fixed_runs])
    white = w.noise.whiten(np.column_stack([X, c.r]))
    step, _ = least_squares(white[:, :-1], white[:, -1], 1e-9)
    own = whole.J.shape[1]  # behind them c.J has what the thermometer leaves: it stays
    declared, rest = step[:own], step[c.J.shape[1] :]
    J = np.column_stack([whole.J, *full, levels])
    return np.asarray(whole.r - J @ np.concatenate([declared, rest]))


def _variances(w: Whitened, whole: Channel, data: Prepared) -> tuple[Array, Array]:
    """(N,) variance of each row by itself, and (k, N) one sigma of what it shares with its power-on."""
    theta = dict(zip(w.noise.components, w.noise.variances.theta, strict=True))
    duration = np.where(data.full.duration > 0, data.full.duration, 1.0)
    usual = np.where(data.table.duration > 0, data.table.duration, 1.0).mean()
    own = theta["white"] * usual / duration + theta.get("constant", 0.0)
    own = own + theta.get(RATE_NOISE, 0.0) * whole.u**2 + theta.get(CROSS_NOISE, 0.0) * whole.across**2
    drawn = drawn_of_power_ons(whole, w.noise.drawn, len(w.noise.starts)) | {
        IN_RUN: np.ones(len(own)),
        IN_RUN_SCALE: whole.u,
    }
    shared = [np.sqrt(theta[name]) * z for name, z in drawn.items() if name in theta]
    return own, np.array(shared).reshape(-1, len(own))


def _added(s: SensorFound, w: Whitened, blocks: Sequence[int], data: Prepared) -> dict[str, Array]:
    """effect -> (N, 2) what it adds and the reading, both cleared of all the rest, the scale given back."""
    pool: Pool = s.found.pool
    sizes = estimates(pool, s.found.all)
    axis = w.channel.axis
    parts = {}
    for b in [*blocks, *(u for u in s.found.unknown if axis in pool.blocks[u].columns)]:
        white = w.noise.whiten(pool.blocks[b].columns[axis])
        parts[b] = clear(w.Q, white)
    everything = orthonormal(np.concatenate([np.empty((len(w.z), 0)), *parts.values()], axis=1), 1e-6)
    rest = w.z - everything @ (everything.T @ w.z)
    out = {}
    for b in blocks:
        named = [i for i, term in enumerate(pool.blocks[b].terms) if term]
        gamma = np.array([e.value for e in sizes if e.block == b])
        others = [p for i, p in parts.items() if i != b]
        basis = orthonormal(np.concatenate([np.empty((len(w.z), 0)), *others], axis=1), 1e-6)
        adds = clear(basis, parts[b][:, named] @ gamma)
        pair = np.column_stack([adds, adds + rest]) * w.noise.spread[:, None]
        out[pool.blocks[b].name] = np.where(data.where[:, None] >= 0, pair[data.where], np.nan)
    return out
