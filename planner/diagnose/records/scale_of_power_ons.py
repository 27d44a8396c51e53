"""A reference that is off by another share in one power-on than in the next: all of a sensor say it alike.

    κ_ir = κ_i(T_r) + s_r + k_ir,   k_ir what channel i draws at power-on r, s_r what the reference is off by

A table's rate for the gyros, the local gravity for the accelerometers. κ_ir is regressed on the input of a
power-on alone. A step of the table from some day on, a drive that is weaker while the chamber works, a table
of another site's gravity, is in every channel's noise as a scale factor that scatters from power-on to
power-on; three channels that scatter independently do not agree. By squares clear of curves over temperature,

    F = m Σ_r c_r² / f  :  Σ_ir (κ_ir − c_r)² / ((m − 1) f),   c_r the mean of m, f degrees of freedom

(Fisher's analysis of variance). What agrees within the spread that the spec gives each channel is no finding.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.findings.suspects import FEW
from planner.diagnose.noise.whitened import log_p
from planner.diagnose.references.bench_directions import loaded
from planner.diagnose.references.references import MOST_SCALE, REFERENCES
from planner.diagnose.search.sensor import SensorFound
from planner.effects._bench_frame import turning
from planner.measurement import AXES, sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable
from planner.nouns.sensor import channel_name
from planner.protocols import Sensor
from planner.solvers.distributions import TWO_SIDED, chi_square_tail
from planner.spec.references import BenchAccuracy
from planner.temperature_table import hats

ERROR = "scale_factor"
CHANCE = 1e-5  # of what would be wrong with all gyros at once: as `other_from_run_on`
LEAST_FREEDOM = 4  # power-ons beside the curves over temperature
LEAST_ROWS = 5  # of a power-on with input: level, own input and two leans take four
STRONG = 0.3  # of the largest input, that a power-on's must reach, or its scale factor is not told
OF_ITS_OWN = 0.2  # of an input about its mean, that leans and a level must leave: 25 times the variance
BEYOND = 2.0  # of the spec's run-to-run, that channels may well have in common
ONE_STEP = 0.9  # of the squares, from which a step says them


@dataclass(frozen=True)
class Shared:
    """A reference that scales the input of all channels of a sensor in some records.

    here: conditions -> (n,) which these are; step: what it does from some power-on on, scatters: otherwise
    """

    name: str
    sensor: Sensor
    here: Callable[[Conditions], NDArray[np.bool_]]
    step: str
    scatters: str

    def scaled(self, table: DwellTable, by: Array) -> DwellTable:
        """The table with references that are larger by shares (n,)."""
        more = (1.0 + by * self.here(table.conditions()))[:, None]
        if self.sensor == "gyro":
            return table if table.ref_rate is None else replace(table, ref_rate=table.ref_rate * more)
        return table if table.ref_acc is None else replace(table, ref_acc=table.ref_acc * more)


def _on_the_table(conditions: Conditions) -> NDArray[np.bool_]:
    return np.asarray(turning(conditions) & ~loaded(conditions))


def _off_the_arm(conditions: Conditions) -> NDArray[np.bool_]:
    return np.asarray(~loaded(conditions))


TABLE = Shared(
    "table_rate", "gyro", _on_the_table,
    "look up what was changed at the table: from run {first} on it turns by {value:+.2g} of its rate faster "
    "than it did",
    "look up what was changed at the table: its rate differs from power-on to power-on, most in run {most}",
)  # fmt: skip
GRAVITY = Shared(
    "local_gravity", "accelerometer", _off_the_arm,
    "look up whether the bench was moved, or its local g entered anew: from run {first} on gravity is larger "
    "by {value:+.2g} of it",
    "look up the local g of each power-on: it differs from one to the next, most in run {most}",
)  # fmt: skip


@dataclass(frozen=True)
class Shares:
    """share: (g,) by which the reference was larger in each power-on; first: of a step, or −1

    half: of a 95 % interval of the step, or of one share
    """

    which: Shared
    share: Array
    runs: NDArray[np.int64]
    first: int
    value: float
    half: float
    p_value: float
    strength: float
    stated: float

    def right(self, table: DwellTable) -> DwellTable:
        """The table with the references that there were."""
        by = np.zeros(len(table))
        for run, share in zip(self.runs.tolist(), self.share.tolist(), strict=True):
            by[table.run == run] = share
        return self.which.scaled(table, by)

    @property
    def suspect(self) -> ReferenceSuspect:
        """As it is reported: the step, or the spread of the shares."""
        most = sorted(self.runs[np.argsort(-np.abs(self.share))[:FEW]].tolist())
        said = self.which.step if self.first >= 0 else self.which.scatters
        where = said.format(first=self.first, value=self.value, most=", ".join(map(str, most)))
        r, size = REFERENCES[self.which.name], abs(self.value)
        square = (size / np.hypot(self.stated, self.half / TWO_SIDED)) ** 2 if self.stated > 0.0 else 0.0
        return ReferenceSuspect(
            self.which.name, size, size - self.half, size + self.half, r.unit,
            tuple(channel_name(self.which.sensor, axis) for axis in range(len(AXES))),
            self.p_value, self.strength, f"{where}; {r.check}",
            self.strength, r.alias, r.record, self.stated, float(chi_square_tail(square, 1)),
        )  # fmt: skip


def table_rate_of_power_ons(
    found: Sequence[SensorFound], data: Prepared, benches: Sequence[BenchAccuracy]
) -> Shares | None:
    """By what share the table's rate differs between power-ons, where all gyros say so, or None.

    A rate that a search believes to be wrong above some rate differs with the rates of each power-on.
    """
    return _shares(TABLE, found, data, benches)


def gravity_of_power_ons(
    found: Sequence[SensorFound], data: Prepared, benches: Sequence[BenchAccuracy]
) -> Shares | None:
    """The same of the local gravity, where all accelerometers say so."""
    return _shares(GRAVITY, found, data, benches)


def _shares(
    which: Shared, found: Sequence[SensorFound], data: Prepared, benches: Sequence[BenchAccuracy]
) -> Shares | None:
    if _believed(which, found):
        return None
    mine = [c for s in found if s.sensor == which.sensor for c in s.channels]
    if len(mine) < len(AXES):
        return None
    kappa = np.array([_scale_factors(which, c, data.starts) for c in mine])
    told = np.all(np.isfinite(kappa), axis=0)
    curves = _curves(mine[0], data.starts)[told]
    freedom = int(told.sum()) - np.linalg.matrix_rank(curves)
    if freedom < LEAST_FREEDOM:
        return None
    basis = orthonormal(curves)
    each = clear(basis, kappa[:, told].T)
    common = each.mean(axis=1)
    apart = float(np.sum((each - common[:, None]) ** 2)) / ((len(mine) - 1) * freedom)
    agreed, s2 = len(mine) * float(common @ common), max(apart, 1e-300)
    p = float(np.exp(log_p(agreed, freedom, (len(mine) - 1.0) * freedom, s2)))
    spread = float(np.sqrt(common @ common / freedom))
    budget = None if data.unit is None else getattr(data.unit, which.sensor).get(ERROR)
    drawn = 0.0 if budget is None else budget.run_to_run_largest or 0.0
    if p > CHANCE or not BEYOND * drawn < spread < MOST_SCALE:
        return None
    runs, share = data.table.run[data.starts], np.zeros(len(data.starts))
    of_one = float(np.sqrt(apart / len(mine)))
    stated = max(map(REFERENCES[which.name].stated, benches), default=0.0)
    place, step, left = _step(basis, common)
    strength = float(np.sqrt(agreed / s2))
    if left <= (1.0 - ONE_STEP) * float(common @ common):
        first = int(np.flatnonzero(told)[place])
        share[first:] = step
        half = TWO_SIDED * of_one / float(np.linalg.norm(clear(basis, _from(place, len(common)))))
        return Shares(which, share, runs, int(runs[first]), step, half, p, strength, stated)
    share[told] = common
    return Shares(which, share, runs, -1, spread, TWO_SIDED * of_one, p, strength, stated)


def _believed(which: Shared, found: Sequence[SensorFound]) -> bool:
    """Whether a search has a fault of that reference already."""
    blocks = (s.found.pool.blocks[b] for s in found for b in s.found.library)
    names = (REFERENCES[b.name] for b in blocks if b.reference)
    return any(which.name in (r.name, r.said) for r in names)


def _scale_factors(which: Shared, c: Channel, starts: NDArray[np.int64]) -> Array:
    """(g,) what the input of each power-on says of a scale factor beside the declared one; NaN: nothing."""
    conditions = c.model.conditions
    here, u = which.here(conditions), sensed(c.sensor, conditions)
    fastest = np.abs(np.where(here, c.u, 0.0))
    out = np.full(len(starts), np.nan)
    for k, rows in enumerate(np.split(np.arange(len(c.y)), starts[1:])):
        mine = rows[here[rows]]
        if len(mine) < LEAST_ROWS or fastest[mine].max() < STRONG * fastest.max():
            continue
        own = [c.axis, *(a for a in range(3) if a != c.axis)]
        X = np.column_stack([u[mine][:, own] * c.lean[mine][:, None], np.ones(len(mine))])
        size = np.maximum(np.linalg.norm(X, axis=0), 1e-300)
        if _is_told(X[:, 0], X[:, 1:] / size[1:]):
            beta, *_ = np.linalg.lstsq(X / size, c.r[mine], rcond=1e-6)
            out[k] = beta[0] / size[0]
    return out


def _is_told(own: Array, beside: Array) -> bool:
    """Whether the own input (m,) of a power-on tells its scale factor beside leans and its level (m, 3).

    A unit that stands on each axis in turn, one way up, has 1 g as the sum of its inputs: but for a few mg of
    what turning adds the level is that sum, and three levels of as many channels that came out with one sign
    were a gravity that differs from power-on to power-on, at 1 in 5 million.
    """
    about = float(np.linalg.norm(own - own.mean()))
    left = clear(orthonormal(beside), own[:, None])
    return about > 0.0 and float(np.linalg.norm(left)) > OF_ITS_OWN * about


def _curves(c: Channel, starts: NDArray[np.int64]) -> Array:
    """(g, nodes) what a scale factor over temperature, or one alone, has in each power-on."""
    nodes, t = c.model.nodes_of(ERROR), c.model.conditions.temperature_degc
    if nodes is None:
        return np.ones((len(starts), 1))
    return hats(np.array([part.mean() for part in np.split(t, starts[1:])]), nodes, 0.0)


def _step(basis: Array, common: Array) -> tuple[int, float, float]:
    """The place from which on a share explains most of what is common, that share, what it leaves."""
    best = (0, 0.0, float(common @ common))
    for place in range(1, len(common)):
        x = clear(basis, _from(place, len(common)))
        square = float(x @ x)
        if square > 1e-9:
            step = float(x @ common) / square
            left = float(np.sum((common - step * x) ** 2))
            best = min(best, (place, step, left), key=lambda one: one[2])
    return best


def _from(place: int, count: int) -> Array:
    return (np.arange(count) >= place).astype(float)
