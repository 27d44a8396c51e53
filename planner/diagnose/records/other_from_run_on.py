"""A reference that is another one in some power-ons (`changed_power_ons`): mounting, tilt, azimuth, scale.

    y = (1 + κ) M (u + Σ_j γ_j d_j) + b   of those power-ons

    mounting   d_j = e_j × u of both sensors
    tilt       g · north, g · east of the accelerometers, at rest
    azimuth    |Ω_h| · north, |Ω_h| · east of the gyros, at rest
    scale      u of both sensors (the read-out), of the gyros (the table), of the accelerometers (gravity)

The leans of six channels are twelve numbers, and a mounting gives them three: it is one where the three say
what the twelve would, beyond chance over all power-ons (`channels_agree`). A sensor that is another one, or
changed by itself, does not keep to it. A channel of which curves that are declared take the change up says
nothing: the turns of gyros, which all came later, tell no lean that began before them.
Sums over power-ons make every one as cheap as the first,

    G = Σ WᵀW − (Σ QᵀW)ᵀ(Σ QᵀW),   h = Σ Wᵀz   over the power-ons in question,

W the whitened columns, Q the declared model and what is believed, z the residual clear of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.channels.told_directions import explained, inverse_of_told
from planner.diagnose.findings.suspects import DEGREES
from planner.diagnose.hypotheses.lack_of_fit import SHARED_MISFIT
from planner.diagnose.noise.channel_noise import LEAST_RUNS as LEAST_RUNS_OF_A_SPREAD
from planner.diagnose.noise.channel_noise import ChannelNoise
from planner.diagnose.noise.shares import freedom_of
from planner.diagnose.noise.whitened import log_p
from planner.diagnose.records.changed_power_ons import (
    LEAST_RUNS,
    Span,
    most,
    said,
    sets_of,
    sums_over,
)
from planner.diagnose.records.channels_agree import CHANCE, agree
from planner.diagnose.records.kinds_of_change import GAIN, KINDS, WITHIN_POWER_ONS, Kind, read_out
from planner.diagnose.records.size_within_power_ons import SEEN, size_within_power_ons
from planner.diagnose.references.bench_directions import through_the_unit
from planner.diagnose.references.references import hypothesis
from planner.diagnose.search.sensor import SensorFound
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable
from planner.protocols import SENSORS, Sensor
from planner.solvers.distributions import TWO_SIDED, chi_square_tail
from planner.spec.references import BenchAccuracy

AS_BUDGETED = 1e-3  # p, above which power-ons that differ as they may are all there is
LEFT = 0.03  # of its columns, squared, that curves over temperature must leave of a change, or it is theirs
WITHIN = ("time_on", "time_on_and_temperature")  # no change of a reference goes with these


# ---------------------------------------------------------------- one that did


@dataclass(frozen=True)
class OtherFromRunOn:
    """Which reference is another one and by how much. gamma: (k,) SI, half: of their length's 95 % interval

    runs: in which it is; span: which these are
    """

    kind: Kind
    runs: NDArray[np.int64]
    span: Span
    gamma: Array
    half: float
    channels: tuple[str, ...]
    p_value: float
    strength: float
    chance: float
    stated: float

    def right(self, table: DwellTable) -> DwellTable:
        """The table with the references that the unit had, or with the readings of one gain."""
        mine, conditions = np.isin(table.run, self.runs)[:, None], table.conditions()
        put = {}
        if self.kind.reference is GAIN:
            by = 1.0 + self.gamma[0] * mine
            gyro, acc = (None if y is None else y / by for y in (table.gyro, table.acc))
            return replace(table, gyro=gyro, acc=acc)
        for sensor in self.kind.sensors:
            name = "ref_rate" if sensor == "gyro" else "ref_acc"
            u = getattr(table, name)
            if u is not None:
                felt = self.kind.felt(sensor, conditions)
                added = sum((g * d for g, d in zip(self.gamma, felt, strict=True)), np.zeros_like(u))
                put[name] = u + mine * added
        return replace(table, **put)

    @property
    def suspect(self) -> ReferenceSuspect:
        """As it is reported."""
        r, size = self.kind.reference, float(np.linalg.norm(self.gamma))
        scale = DEGREES if r.unit == "deg" else 1.0
        sizes = ", ".join(f"{x:+.2g}" for x in self.gamma * scale)
        check = self.kind.said.format(where=self.kind.where, sizes=sizes, **said(self.span, self.runs))
        return ReferenceSuspect(
            self.kind.name, size * scale, (size - self.half) * scale, (size + self.half) * scale, r.unit,
            self.channels, self.p_value, self.strength, f"{check}; {r.check}", self.strength, r.alias,
            r.record, self.stated * scale, self.chance,
        )  # fmt: skip


def other_from_run_on(
    found: Sequence[SensorFound], data: Prepared, benches: Sequence[BenchAccuracy]
) -> OtherFromRunOn | None:
    """The one change that explains most; None where that is how one power-on sat: it is off as a whole."""
    if len(data.starts) < LEAST_RUNS:
        return None
    every = (_best(kind, found, data, benches) for kind in KINDS)
    told = [one for one in every if one is not None]
    best = max(told, key=lambda one: one.strength**2 - 2.0 * len(one.gamma), default=None)
    return None if best is None or (best.span == "alone" and not best.kind.alone) else best


# ---------------------------------------------------------------- sums over power-ons


@dataclass(frozen=True)
class _Sums:
    """What a channel says of the coefficients in each of w sets of power-ons.

    gram: (w, k, k), h: (w, k), 0 where what is declared takes the change up; told: (w,) where it does not
    """

    sensor: Sensor
    name: str
    gram: Array
    h: Array
    told: NDArray[np.bool_]


@dataclass(frozen=True)
class _Asked:
    """A kind of change in every set of power-ons that may have it.

    sets: (w, g) which power-ons; s2: of the channels' noise
    """

    kind: Kind
    mine: list[SensorFound]
    data: Prepared
    sets: NDArray[np.bool_]
    spans: list[Span]
    sums: list[_Sums]
    s2: float

    @classmethod
    def of(cls, kind: Kind, found: Sequence[SensorFound], data: Prepared) -> _Asked:
        mine = [s for s in found if s.sensor in kind.sensors]
        sets, spans = _sets(kind, data)
        over = sums_over(sets)
        sums = [_sums(kind, s, axis, over) for s in mine for axis in s.found.pool.state]
        squares = [w.mean_square for s in mine for w in s.found.pool.state.values()]
        s2 = max(float(np.mean(squares)), 1.0) if squares else 1.0
        return cls(kind, mine, data, sets, spans, sums, s2)

    def gram(self, k: int) -> Array:
        """(k, k) of all channels, of one set."""
        return np.asarray(np.sum([x.gram[k] for x in self.sums], axis=0))

    def h(self, k: int) -> Array:
        """(k,) of all channels, of one set."""
        return np.asarray(np.sum([x.h[k] for x in self.sums], axis=0))

    @cached_property
    def delta(self) -> Array:
        """(w,) what the change explains in each set."""
        gram, h = np.sum([x.gram for x in self.sums], axis=0), np.sum([x.h for x in self.sums], axis=0)
        return explained(gram, h, SEEN) / self.s2

    def chance(self, k: int) -> float:
        """Of so much in one set, over all sets and kinds.

        A dozen power-ons tell their own spread by a dozen degrees of freedom.
        """
        tests, columns = float(len(self.spans) * len(KINDS)), len(self.h(k))
        p = float(chi_square_tail(float(self.delta[k]), columns))
        if tests * p <= CHANCE:
            way = inverse_of_told(self.gram(k), SEEN)
            freedom = freedom_of(_contrasts(self.kind, self.mine, self.sets[k], way))
            p = float(np.exp(log_p(float(self.delta[k]), columns, freedom, 1.0)))
        return min(1.0, tests * p)

    def stands(self, k: int, found: Sequence[SensorFound]) -> bool:
        """Whether it is more than what else may be it, and the channels agree on it."""
        # by the search, of all records or those of a bench
        searched = _told(found, self.kind) / self.s2 if self.kind.searched else 0.0
        constant = searched if self.kind.drifts else max(float(self.delta[0]), searched)
        throughout = constant - 2.0 * np.log(CHANCE) if searched > 0.0 else 0.0
        if self.delta[k] < max(_misfit(found, self.kind), throughout):
            return False
        if not agree(
            np.array([x.gram[k] for x in self.sums]), np.array([x.h[k] for x in self.sums]), self.s2
        ):
            return False
        return self.kind.felt is not read_out or all(
            _says(x.sensor, self.sums, k, self.s2) for x in self.sums
        )

    def sized(self, k: int, p: float, benches: Sequence[BenchAccuracy]) -> OtherFromRunOn | None:
        """The change in one set with its size, or None where that is none."""
        way, data = inverse_of_told(self.gram(k), SEEN), self.data
        gamma, variance = way @ self.h(k), self.s2 * np.diag(way)
        size = float(np.linalg.norm(gamma))
        if size > self.kind.most:
            return None
        there = self.sets[k]
        if self.kind.name == "mounting" and _draws_as_much(gamma, variance, data, there):
            return None
        half = TWO_SIDED * float(np.sqrt(gamma**2 @ variance)) / max(size, 1e-300)
        stated = max(map(self.kind.reference.stated, benches), default=0.0)
        square = float(np.sum(gamma**2 / (stated**2 + variance))) if stated > 0.0 else 0.0
        told = OtherFromRunOn(
            self.kind, data.table.run[data.starts[there]], self.spans[k], gamma, half,
            tuple(x.name for x in self.sums), p, float(np.sqrt(self.delta[k])),
            float(chi_square_tail(square, len(gamma))), float(stated),
        )  # fmt: skip
        if self.kind.felt not in WITHIN_POWER_ONS or self.spans[k] == "alone":
            return told
        within = self._within_power_ons(k, told)
        return replace(told, gamma=within) if np.linalg.norm(within) <= self.kind.most else None

    def _within_power_ons(self, k: int, told: OtherFromRunOn) -> Array:
        """(k,) the coefficients by the noise of rows."""

        def put_right(size: Array) -> DwellTable:
            return replace(told, gamma=size).right(self.data.table)

        see = [s for s in self.mine if any(x.told[k] for x in self.sums if x.sensor == s.sensor)]
        return size_within_power_ons(self.kind.felt, see, self.data.starts, self.sets[k], put_right)


def _best(
    kind: Kind, found: Sequence[SensorFound], data: Prepared, benches: Sequence[BenchAccuracy]
) -> OtherFromRunOn | None:
    asked = _Asked.of(kind, found, data)
    if len(asked.sums) < 2:
        return None
    k = 0 if kind.drifts else most(asked.delta, asked.spans)
    p = asked.chance(k)
    return asked.sized(k, p, benches) if p <= CHANCE and asked.stands(k, found) else None


def _says(sensor: Sensor, sums: Sequence[_Sums], k: int, s2: float) -> bool:
    """Whether a sensor says it by itself: what one alone says is its own reference's, not the read-out's."""
    mine = [x for x in sums if x.sensor == sensor]
    gram, h = np.sum([x.gram[[k]] for x in mine], axis=0), np.sum([x.h[[k]] for x in mine], axis=0)
    return float(chi_square_tail(float(explained(gram, h, SEEN)[0]) / s2, h.shape[1])) < AS_BUDGETED


def _sets(kind: Kind, data: Prepared) -> tuple[NDArray[np.bool_], list[Span]]:
    """(w, g) power-ons that may have it; all of them, of what grows from day to day."""
    if kind.drifts:
        return np.ones((1, len(data.starts)), dtype=bool), ["drift"]
    return sets_of(data.table.day[data.starts], kind.alone)


def _sums(kind: Kind, s: SensorFound, axis: int, over: Callable[[Array], Array]) -> _Sums:
    """over: sums of what each power-on says over sets of them (`sums_over`)."""
    w = s.found.pool.state[axis]
    W, Q, z = _rows(kind, s, axis)
    drawn = w.noise.covariance.effects.drawn
    each = drawn(W, W), drawn(Q, W), drawn(W, z[:, None])[:, :, 0]
    square, along, h = map(over, each)
    before = np.trace(square, axis1=1, axis2=2)
    gram = square - np.swapaxes(along, 1, 2) @ along
    told = np.trace(gram, axis1=1, axis2=2) > LEFT * before
    return _Sums(s.sensor, w.channel.name, gram * told[:, None, None], h * told[:, None], told)


def _rows(kind: Kind, s: SensorFound, axis: int) -> tuple[Array, Array, Array]:
    """W, Q and z of a channel."""
    w, pool = s.found.pool.state[axis], s.found.pool
    felt = kind.felt(s.sensor, w.channel.model.conditions)
    W = w.noise.whiten(through_the_unit(w.channel, felt))
    mine = [pool.blocks[b].columns[axis] for b in _of_other_kinds(s, axis, kind)]
    if not mine:
        return W, w.Q, w.z
    more = orthonormal(clear(w.Q, w.noise.whiten(np.column_stack(mine))), 1e-6)
    return W, np.column_stack([w.Q, more]), clear(more, w.z)


def _contrasts(
    kind: Kind, mine: Sequence[SensorFound], there: NDArray[np.bool_], way: Array
) -> list[tuple[ChannelNoise, Array]]:
    """C (n, m) of every channel, whitened rows of some power-ons, in which Σ Cᵀz has unit covariance."""
    values, vectors = np.linalg.eigh(way)
    kept = values > SEEN * float(values[-1])
    root, found = vectors[:, kept] * np.sqrt(values[kept]), []
    for s in mine:
        for axis, w in s.found.pool.state.items():
            W, Q, _ = _rows(kind, s, axis)
            here = W * np.repeat(there, w.noise.covariance.effects.sizes)[:, None]
            found.append((w.noise, clear(Q, here) @ root))
    return found


def _draws_as_much(gamma: Array, variance: Array, data: Prepared, there: NDArray[np.bool_]) -> bool:
    """Whether misalignments that differ from power-on to power-on as the spec lets them may be all of it.

    Σ γ² / (var γ + σ² (1/g₁ + 1/g₂)), χ² of k;  σ the larger budget, g₁, g₂ power-ons there and elsewhere
    Of few power-ons, whose spread nothing tells; where they are many it is in the noise.
    """
    if len(there) >= LEAST_RUNS_OF_A_SPREAD:
        return False
    budgets = [] if data.unit is None else [getattr(data.unit, s).get("misalignment") for s in SENSORS]
    sigma = max((b.run_to_run_largest or 0.0 for b in budgets if b is not None), default=0.0)
    drawn = sigma**2 * (1.0 / int(there.sum()) + 1.0 / int((~there).sum()))
    square = float(np.sum(gamma**2 / (variance + drawn)))
    return bool(chi_square_tail(square, len(gamma)) > AS_BUDGETED)


def _told(found: Sequence[SensorFound], kind: Kind) -> float:
    """Δ of the same reference where a search believes it; 0 where none does."""
    mine = ((s, b) for s in found for b in s.found.library if _name(s, b) == kind.name)
    return max((float(s.found.share(b).delta) for s, b in mine), default=0.0)


def _misfit(found: Sequence[SensorFound], kind: Kind) -> float:
    """Δ that a strong effect of the bench may leave: its geometry is known roughly, its columns linear."""
    known = [(hypothesis(_name(s, b)), s.found.share(b).delta) for s in found for b in s.found.library]
    same = kind.name if kind.searched else ""  # of all records: `throughout` has it
    others = [(h, delta) for h, delta in known if h.bench_only and h.name != same]
    return max((max(h.misfit, SHARED_MISFIT) * delta for h, delta in others), default=0.0)


def _name(s: SensorFound, b: int) -> str:
    return s.found.pool.blocks[b].name


def _of_other_kinds(s: SensorFound, axis: int, kind: Kind) -> list[int]:
    """What is believed of a channel and is not the change itself, which may look like an effect of days.

    So may it look like what has no name, but for what goes with the time since power-on: no reference does.
    """
    blocks = s.found.pool.blocks
    unknown = [b for b in s.found.unknown if axis in blocks[b].columns and blocks[b].name in WITHIN]
    return unknown + [
        b
        for b in s.found.library
        if axis in blocks[b].columns
        and "day" not in hypothesis(_name(s, b)).needs
        and not (_name(s, b) == kind.name and kind.searched)
    ]
