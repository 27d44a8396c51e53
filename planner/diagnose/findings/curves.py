"""What is missing without a name, over a variable → a measured curve over it, as calibrate fits it.

Of every curve that the variable allows (its forms, few nodes and many) the one is taken that explains most of
what is left on the channel,  Δ − k log n,  k its columns; its coefficients and intervals are those of the
declared model, what was found and the curve together.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from planner import catalog
from planner.diagnose.channels.channel import columns
from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.findings.declared_and_found import declared_and_found
from planner.diagnose.findings.reported import cannot_fit, rows_to_fit
from planner.diagnose.references.bench_directions import loaded
from planner.diagnose.search.sensor import SensorFound
from planner.diagnose.shapes.generic import levels
from planner.effects._measured_curve import FORMS, LEAST_NODES, MOST_NODES, VARIABLES, curve_name, curve_of
from planner.errors import InputError
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.diagnosis import FoundEffect, FoundTerm, Unknown
from planner.nouns.dwell_table import DwellTable
from planner.spec.model import Spec

COUNTS = (4, 6, 9)  # nodes: a bend, a curve, a table
GAPS = {"time_on": 15.0, "day": 0.02, "temperature_rate": 0.3}  # in the unit of the nodes; of rates A_DPS
A_DPS = 1.0
STEPPED = ("temperature_rate", "rate", "rate_modulus", "cross_rate")  # whose values stand at levels
DIGITS = 3


def with_curve(
    u: Unknown, s: SensorFound, data: Prepared, table: DwellTable, spec: Spec, names: Sequence[str]
) -> Unknown:
    """The unknown with its measured curve; as it came where there is none over it, or no fit of it.

    names: of the effects that were found, of either sensor
    """
    axis = AXES.index(u.channels[0][-1])
    if len(u.channels) != 1 or cannot_fit(s, data, [axis]):
        return u
    name = _best(u.varies_with, s, axis)
    if name is None:
        return u
    try:
        rows = rows_to_fit(s, data, table, [axis])
        fit = declared_and_found(rows, spec, s.sensor, [*names, name], [axis])[axis]
    except InputError:
        return u
    unit = catalog.effects()[name].units[s.sensor]
    mine = [(term, c) for (effect, term), c in fit.terms.items() if effect == name]
    told = [(term, c) for term, c in mine if np.isfinite([c.low, c.high]).all()]
    if not any(c.low > 0.0 or c.high < 0.0 for _, c in told):
        return u
    terms = tuple(FoundTerm(t, u.channels[0], c.value, c.low, c.high, c.freedom, unit) for t, c in told)
    return replace(u, curve=FoundEffect(name, s.sensor, u.channels, terms, u.p_value, u.strength))


def _best(variable: str, s: SensorFound, axis: int) -> str | None:
    """The name of the curve that explains most, for its columns."""
    w, pool = s.found.pool.state[axis], s.found.pool
    believed = pool.columns(s.found.library)
    mine = np.isin(pool.axes[axis], believed)
    base = orthonormal(pool.parts[axis][:, mine])
    z = clear(base, w.z)
    best, most = None, 0.0
    for name in dict.fromkeys(_possible(variable, s, axis)):
        raw = columns(w.channel, name)[:, :]
        C = orthonormal(clear(base, clear(w.Q, w.noise.whiten(raw))), 1e-6)
        gain = float(np.sum((C.T @ z) ** 2)) - C.shape[1] * float(np.log(len(z)))
        if gain > most:
            best, most = name, gain
    return best


def _possible(variable: str, s: SensorFound, axis: int) -> Iterator[str]:
    conditions = s.found.pool.state[axis].channel.model.conditions
    for over in FORMS.get(variable, (variable,)):
        v = VARIABLES.get(over)
        if v is None or s.sensor not in v.sensors:
            continue
        for nodes in [()] if v.dropped is None else _nodes(over, conditions, axis):
            name = curve_name(s.sensor, axis, over, nodes)
            if curve_of(name) is not None:
                yield name


def _nodes(over: str, conditions: Conditions, axis: int) -> Iterator[tuple[float, ...]]:
    """Nodes in the variable's unit: at its levels, or evenly filled; few and many."""
    v, gap = VARIABLES[over], GAPS.get(over, A_DPS)
    unloaded = ~loaded(conditions)  # an arm turns faster than any flight, and tables cannot follow it there
    values: Array = v.of(conditions, axis)[unloaded if unloaded.any() else slice(None)].ravel() / v.scale
    for most in COUNTS:
        if over in STEPPED:
            found = levels(values, gap, min(most + 2, MOST_NODES))
        else:
            different = np.unique(np.round(values / gap) * gap)
            found = np.quantile(different, np.linspace(0.0, 1.0, min(most, len(different))))
        rounded = np.unique([0.0 if abs(x) < gap / 2.0 else float(f"{x:.{DIGITS}g}") for x in found])
        if len(rounded) >= LEAST_NODES:
            yield tuple(rounded.tolist())
