"""Whether what all channels of a sensor lack over their own inputs is one law: that of their reference.

A table that does not come to its highest rate, a column of rates that ends at what its field holds: each gyro
lacks a curve over its own rate, the same as the others. Three sensors are never so alike. What no search of a
reference believes, for it is more than a reference can be off by, is a curve of each gyro to it. With shares
of the rate at each signed level as columns C, γ common to the channels, or γ_a of each one's own,

    Δ = Σ_a |z_a|² − |z_a − C_a γ|²,    Δ' with γ_a:    Δ' − Δ ≤ ALIKE Δ,    Δ' ≥ MOSTLY of what was claimed
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planner import catalog
from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.channels.told_directions import explained, inverse_of_told
from planner.diagnose.noise.whitened import SEEN
from planner.diagnose.references.references import REFERENCES
from planner.diagnose.search.sensor import SensorFound
from planner.diagnose.shapes.generic import variable_of
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.diagnosis import FoundEffect, ReferenceSuspect, Unknown
from planner.protocols import Sensor
from planner.solvers.distributions import TWO_SIDED, chi_square_tail

LAWS = {"gyro": ("table_rate_by_level", "rate"), "accelerometer": ("arm_rate_by_level", "specific_force")}
ALIKE = 0.1  # of Δ, by which the channels may differ: of three sizes with a sign of their own hardly ever
MOSTLY = 0.8  # of what the claims explain: the law is of levels, and a claim that is not stands
SURE = 20.0  # sigma of Δ: three small sizes are alike by chance
WELL = 0.01  # of the best told direction's information
CHECK = "; what each {0} lacks over its own {1} is one law for all three"


@dataclass(frozen=True)
class OneLaw:
    """A sensor's channels over their own inputs, by one law."""

    sensor: Sensor
    variable: str
    suspect: ReferenceSuspect

    def takes(self, e: FoundEffect) -> bool:
        """Whether an effect is what its channels make of it."""
        return e.sensor == self.sensor and _variable(e) == self.variable


def one_laws(
    found: Sequence[SensorFound], data: Prepared, effects: Sequence[FoundEffect], unknown: Sequence[Unknown]
) -> Iterator[OneLaw]:
    """Of each sensor, all of whose channels lack something over their own inputs."""
    for s in found:
        name, variable = LAWS[s.sensor]
        claims = {c for e in effects if e.sensor == s.sensor and _variable(e) == variable for c in e.channels}
        claims |= {c for u in unknown if u.varies_with == variable for c in u.channels}
        mine = {c.name for c in s.channels}
        if len(mine & claims) == len(AXES):
            suspect = _suspect(s, data, name, variable)
            if suspect is not None:
                yield OneLaw(s.sensor, variable, suspect)


def _variable(e: FoundEffect) -> str | None:
    known = catalog.effects()[e.effect]
    return None if known.bench_only else variable_of(known, e.sensor)


def _goes_with(s: SensorFound, b: int, variable: str) -> bool:
    """Whether a believed block is a claim of a channel over a variable."""
    block = s.found.pool.blocks[b]
    if block.reference or block.generic:
        return block.generic and block.name == variable
    known = catalog.effects()[block.name]
    return not known.bench_only and variable_of(known, s.sensor) == variable


def _suspect(s: SensorFound, data: Prepared, name: str, variable: str) -> ReferenceSuspect | None:
    r, blocks = REFERENCES[name], s.found.pool.blocks
    if not r.places(data.table):
        return None
    over = [b for b in s.found.all if _goes_with(s, b, variable)]
    grams, hs = list[Array](), list[Array]()
    for axis, w in s.found.pool.state.items():
        beside = [blocks[b].columns[axis] for b in s.found.others(*over) if axis in blocks[b].columns]
        white = w.noise.whiten(np.column_stack([r.columns(w.channel, data.table, 0.0), *beside]))
        k = white.shape[1] - sum(x.shape[1] for x in beside)
        Q = orthonormal(np.column_stack([w.Q, white[:, k:]]), SEEN)
        C, z = clear(Q, white[:, :k]), clear(Q, w.z[:, None])[:, 0]
        grams.append(C.T @ C)
        hs.append(C.T @ z)
    G, h = np.array(grams), np.array(hs)
    each, common = float(explained(G, h, WELL).sum()), float(explained(G.sum(axis=0), h.sum(axis=0), WELL))
    claimed = sum(s.found.share(b).delta for b in over)
    if common < SURE**2 or each - common > ALIKE * common or each < MOSTLY * claimed:
        return None
    left = inverse_of_told(G.sum(axis=0), WELL)
    gamma = left @ h.sum(axis=0)
    k = int(np.argmax(np.abs(gamma)))
    value, half = float(gamma[k]), TWO_SIDED * float(np.sqrt(max(left[k, k], 0.0)))
    return ReferenceSuspect(
        r.said, value, value - half, value + half, r.unit, tuple(c.name for c in s.channels),
        float(chi_square_tail(common, len(gamma))), float(np.sqrt(common)),
        r.check + CHECK.format(s.sensor, variable.replace("_", " ")), 0.0,
    )  # fmt: skip
