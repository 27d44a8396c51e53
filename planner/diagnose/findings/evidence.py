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
from planner.diagnose.noise.components import IN_RUN, IN_RUN_SCALE, LEVEL, draws
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
    before = _residual(w, c, whole, [], [])
    return Evidence(
        channel=c.name,
        before=before,
        after=_residual(w, c, whole, small, full) if blocks else before,
        expected=_expected(w, whole, data),
        added=_added(s, w, blocks, data),
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


def _residual(
    w: Whitened, c: Channel, whole: Channel, small: Sequence[Array], full: Sequence[Array]
) -> Array:
    """(N,) what generalised least squares with these columns leaves, run-to-run not taken off."""
    X = np.column_stack([c.J, *small, w.noise.fixed_runs])
    white = w.noise.whiten(np.column_stack([X, c.r]))
    step, _ = least_squares(white[:, :-1], white[:, -1], 1e-9)
    own = whole.J.shape[1]  # behind them c.J has what the thermometer leaves: it stays
    taken = sum(x.shape[1] for x in full)
    declared, effects = step[:own], step[c.J.shape[1] : c.J.shape[1] + taken]
    J = np.column_stack([whole.J, *full])
    return np.asarray(whole.r - J @ np.concatenate([declared, effects]))


def _expected(w: Whitened, whole: Channel, data: Prepared) -> Array:
    theta = dict(zip(w.noise.components, w.noise.variances.theta, strict=True))
    duration = np.where(data.full.duration > 0, data.full.duration, 1.0)
    usual = np.where(data.table.duration > 0, data.table.duration, 1.0).mean()
    total = theta["white"] * usual / duration + theta.get("constant", 0.0)
    along = ("rate_noise", "run_to_run_scale_factor", IN_RUN_SCALE)
    total = total + sum(theta.get(name, 0.0) for name in along) * whole.u**2
    total = total + theta.get("cross_noise", 0.0) * whole.across**2
    total = total + sum(
        theta[name] * z**2 for name, z in draws(whole, w.noise.drawn).items() if name in theta
    )
    return np.asarray(np.sqrt(total + theta.get(LEVEL, 0.0) + theta.get(IN_RUN, 0.0)))


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
