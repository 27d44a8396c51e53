"""Whether what goes with the change of the temperature is no more than a curve that its table misses.

    z = C γ + b(T) + κ(T) u + e,   b, κ = Σ_gaps f σ_N (x_1 4 s (1 − s) + x_2 4 s (1 − s) (1 − 2 s))

as in `as_likely`, 0 ≤ f ≤ 1: s from 0 to 1 between two nodes of the table, x ~ N(0, 1), and σ_N of the spec's
`temperature_residual`, what a table of N points leaves that lie as far apart over the table's range as these
two. A chamber soaks at few points and passes between them on ramps. There a unit goes by its curve and the
table by a straight line. Ramps of one direction, or that have gaps of their own, do not tell that from a rate
or a lag of the temperature, of the sensor or of the thermometer: a cubic of 1 mg over a gap of 38 K had a
name. Up and down through the same gap the curve is the same, and what is not is none of it. A ramp is told by
its time as by its temperature: a drift that differs with the temperature, or what goes with either and has no
name, is asked as well; of the scale factor the curve bends what has an input, at rest the gravity's.
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

TABLES = ("bias", "scale_factor")  # what tables over temperature carry
LAG = "thermometer_lag"  # of the references: the slope of the curves times the rate
COURSE = frozenset(("temperature_degc", "temperature_rate", "time_on"))  # on a ramp they are one
VARIABLES = frozenset(  # without a name
    ("temperature", "temperature_and_rate", "temperature_rate", "time_on", "time_on_and_temperature")
)


def as_bent(found: Found, b: int, starts: NDArray[np.int64], budgets: Mapping[str, ErrorBudget]) -> bool:
    """Whether a believed name is as likely what the tables of the biases miss between their nodes.

    starts: (g,) first row of every power-on; budgets: of the sensor, by error
    """
    block = found.pool.blocks[b]
    left = {name: table for name in TABLES if (table := _left_by(budgets.get(name)))}
    if not left or not _goes_with_ramps(block):
        return False
    state = found.pool.state
    budgeted = {axis: (_modes(w.channel, left), w) for axis, w in state.items()}
    return any(budgeted[axis][0].shape[1] > 0 for axis in block.columns) and as_likely(found, b, budgeted)


def _left_by(budget: ErrorBudget | None) -> Mapping[int, float] | None:
    """Number of points -> what a table of so many leaves, SI; None where the spec does not say."""
    return None if budget is None else budget.residual_table


def _goes_with_ramps(block: Block) -> bool:
    """Whether a block adds to the bias what goes with the temperature, its change or its course in time."""
    if block.reference:
        return block.name == LAG
    if block.generic:
        return block.name in VARIABLES
    effect = catalog.effects()[block.name]
    return effect.group == "bias" and bool(effect.needs) and effect.needs <= COURSE


def _modes(c: Channel, left: Mapping[str, Mapping[int, float]]) -> Array:
    """(n, k) one sigma of each bend between nodes; left: table -> number of points -> what they leave, SI."""
    t = c.model.conditions.temperature_degc
    found = [np.empty((len(t), 0))]
    for table, sizes in left.items():
        driven = c.u if table == "scale_factor" else np.ones(len(t))
        nodes = np.sort(_nodes(c, table))
        for low, high in pairwise(nodes.tolist()):
            s = (t - low) / (high - low)
            bump = np.where((s > 0.0) & (s < 1.0), 4.0 * s * (1.0 - s), 0.0) * driven
            as_many = 1.0 + (nodes[-1] - nodes[0]) / (high - low)
            sigma = float(np.interp(as_many, list(sizes), list(sizes.values())))
            found.append(sigma * np.column_stack([bump, bump * (1.0 - 2.0 * s)]))
    modes = np.column_stack(found)
    return np.asarray(modes[:, modes.any(axis=0)])


def _nodes(c: Channel, table: str) -> Array:
    """(N,) temperatures at which a table is known; none where none is declared."""
    columns = c.model.columns()
    return np.array(
        [columns[i].node_degc for (e, _), at in tables(c.model).items() if e == table for i in at]
    )
