"""Whether what goes with the change of the temperature is no more than a curve that its table misses.

    z = C γ + κ(T) + e,   κ(T) = Σ_gaps f σ_N (x_1 4 s (1 − s) + x_2 4 s (1 − s) (1 − 2 s)),   0 ≤ f ≤ 1

as in `as_likely`: s from 0 to 1 between two nodes of the channel's table, x ~ N(0, 1), and σ_N of the spec's
`temperature_residual`, what a table of N points leaves that lie as far apart over the table's range as these
two. A chamber soaks at few points and passes between them on ramps. There a unit goes by its curve and the
table by a straight line. Ramps of one direction, or that have gaps of their own, do not tell that from a rate
or a lag of the temperature, of the sensor or of the thermometer: a cubic of 1 mg over a gap of 38 K had a
name. Up and down through the same gap the curve is the same, and what is not is none of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.diagnose.channels.channel import Channel, tables
from planner.diagnose.hypotheses.candidates import Block
from planner.diagnose.hypotheses.found import Found
from planner.diagnose.vetoes.as_likely import as_likely
from planner.nouns.array import Array
from planner.spec.budget import ErrorBudget

TABLE = "bias"  # what the table over temperature carries
LAG = "thermometer_lag"  # of the references: the slope of the curves times the rate
CHANGES = "temperature_rate"  # what a name needs that goes with the change of the temperature


def as_bent(found: Found, b: int, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]) -> bool:
    """Whether a believed name is as likely what the tables of the biases miss between their nodes.

    starts: (g,) first row of every power-on; budgets: of the sensor, by error
    """
    block, bias = found.pool.blocks[b], budgets.get("bias")
    left = None if bias is None else bias.residual_table
    if left is None or not _goes_with_changes(block):
        return False
    state = found.pool.state
    budgeted = {axis: (_modes(w.channel, left), w) for axis, w in state.items()}
    return any(budgeted[axis][0].shape[1] > 0 for axis in block.columns) and as_likely(found, b, budgeted)


def _goes_with_changes(block: Block) -> bool:
    """Whether a name adds to the bias what goes with the change of the temperature."""
    if block.generic or block.reference:
        return block.name == LAG
    effect = catalog.effects()[block.name]
    return effect.group == "bias" and CHANGES in effect.needs


def _modes(c: Channel, left: Mapping[int, float]) -> Array:
    """(n, k) one sigma of each bend between nodes; left: number of points -> what they leave, SI."""
    t = c.model.conditions.temperature_degc
    nodes = np.sort(_nodes(c))
    points, sizes = np.array(list(left)), np.array(list(left.values()))
    found = [np.empty((len(t), 0))]
    for low, high in pairwise(nodes.tolist()):
        s = (t - low) / (high - low)
        bump = np.where((s > 0.0) & (s < 1.0), 4.0 * s * (1.0 - s), 0.0)
        as_many = 1.0 + (nodes[-1] - nodes[0]) / (high - low)
        sigma = float(np.interp(as_many, points, sizes))
        found.append(sigma * np.column_stack([bump, bump * (1.0 - 2.0 * s)]))
    modes = np.column_stack(found)
    return np.asarray(modes[:, modes.any(axis=0)])


def _nodes(c: Channel) -> Array:
    """(N,) temperatures at which the table of the bias is known; none where none is declared."""
    columns = c.model.columns()
    return np.array(
        [columns[i].node_degc for (e, _), at in tables(c.model).items() if e == TABLE for i in at]
    )
