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
from planner.diagnose.records.changed_power_ons import LEAST_RUNS, Span, most, said, sets_of, sums_over
from planner.diagnose.records.channels_agree import CHANCE, agree
from planner.diagnose.records.size_within_power_ons import SEEN, size_within_power_ons
from planner.diagnose.references.bench_directions import at_rest, horizontal, loaded, through_the_unit
from planner.diagnose.references.references import MOST_SCALE, REFERENCES, Reference, hypothesis
from planner.diagnose.search.sensor import SensorFound
from planner.measurement import sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable
from planner.protocols import SENSORS, Sensor
from planner.solvers.distributions import TWO_SIDED, chi_square_tail
from planner.spec.references import BenchAccuracy
from planner.units import STANDARD_GRAVITY_MPS2

AS_BUDGETED = 1e-3  # p, above which power-ons that differ as they may are all there is
LEFT = 0.03  # of its columns, squared, that curves over temperature must leave of a change, or it is theirs
WITHIN = ("time_on", "time_on_and_temperature")  # no change of a reference goes with these
MOST_RAD = 0.1  # 6 deg, beyond which θ × u is no rotation
MOST_SHARE = 3.0  # of the horizontal rate: north that is south is 2

Felt = Callable[[Sensor, Conditions], list[Array]]


# ---------------------------------------------------------------- what may change


@dataclass(frozen=True)
class _Kind:
    """A hypothesis about a reference that may begin in mid-campaign.

    felt: what one unit of each coefficient adds to the true input, (n, 3) each; most: their length can be
    where: in words; said: how unit or bench would then stand, with blanks for the coefficients
    alone: whether it is told of single power-ons too (a mounting of one is `off_power_on`'s), and of whole
        campaigns by the search
    """

    name: str
    sensors: tuple[Sensor, ...]
    felt: Felt
    most: float
    where: str
    said: str
    alone: bool = False

    @property
    def reference(self) -> Reference:
        """What is known of it."""
        return REFERENCES.get(self.name, _GAIN)


def _mounted(sensor: Sensor, conditions: Conditions) -> list[Array]:
    here = ~loaded(conditions)  # a centrifuge has a mounting of its own
    u = sensed(sensor, conditions) * here[:, None]
    return [np.cross(e, u) for e in np.eye(3)]


def _mounted_on_the_arm(sensor: Sensor, conditions: Conditions) -> list[Array]:
    u = sensed(sensor, conditions) * loaded(conditions)[:, None]
    return [np.cross(e, u) for e in np.eye(3)]


def _mounted_at_rest(sensor: Sensor, conditions: Conditions) -> list[Array]:
    u = sensed(sensor, conditions) * at_rest(conditions)[:, None]
    return [np.cross(e, u) for e in np.eye(3)]


def _tilted(sensor: Sensor, conditions: Conditions) -> list[Array]:
    still = at_rest(conditions)[:, None]
    return [STANDARD_GRAVITY_MPS2 * still * v for v in horizontal(conditions)]


def _turned_from_north(sensor: Sensor, conditions: Conditions) -> list[Array]:
    still = at_rest(conditions)[:, None]
    north, east = horizontal(conditions)
    size = np.abs(np.sum(north * conditions.rate, axis=1, keepdims=True)) * still
    return [size * north, size * east]


def _scaled(sensor: Sensor, conditions: Conditions) -> list[Array]:
    return [sensed(sensor, conditions) * ~loaded(conditions)[:, None]]


def _read_out(sensor: Sensor, conditions: Conditions) -> list[Array]:
    return [sensed(sensor, conditions)]


_GAIN = Reference(
    "mixed_units", SENSORS, "1", ("scale",), lambda c, table, place: sensed(c.sensor, table.conditions()),
    "compare the gain or the range of the read-out before and after",
)  # fmt: skip
_ANEW = (
    "look up whether the unit was mounted anew {before}: {where}{there} it is turned by {sizes} deg about "
    "x, y and z on all channels alike"
)
_KINDS = (
    _Kind("mounting", ("gyro", "accelerometer"), _mounted, MOST_RAD, "", _ANEW),
    _Kind("mounting", ("gyro", "accelerometer"), _mounted_at_rest, MOST_RAD, "at rest, ", _ANEW),
    _Kind("mounting", ("gyro", "accelerometer"), _mounted_on_the_arm, MOST_RAD, "on the centrifuge, ", _ANEW),
    _Kind(
        "base_tilt", ("accelerometer",), _tilted, MOST_RAD, "",
        "look up whether the base settled or was levelled anew: {when} it leans by {sizes} deg along north "
        "and east",
        alone=True,
    ),
    _Kind(
        "mixed_units", SENSORS, _read_out, MOST_SCALE, "",
        "look up what was changed at the read-out of all channels: {when} they read by {sizes} of their "
        "input more",
    ),
    _Kind(
        "table_rate", ("gyro",), _scaled, MOST_SCALE, "",
        "look up what was changed at the table: {when} it turns by {sizes} of its rate faster than the "
        "reference says",
    ),
    _Kind(
        "local_gravity", ("accelerometer",), _scaled, MOST_SCALE, "",
        "look up whether the bench was moved: {when} gravity is larger by {sizes} of it",
    ),
    _Kind(
        "azimuth", ("gyro",), _turned_from_north, MOST_SHARE, "",
        "look up whether the fixture was turned: {when} {sizes} of the Earth's horizontal rate act along "
        "north and east beside the reference",
        alone=True,
    ),
)  # fmt: skip
_WITHIN_POWER_ONS = (_scaled, _read_out, _mounted, _mounted_on_the_arm, _tilted)  # turns and faces tell these


# ---------------------------------------------------------------- one that did


@dataclass(frozen=True)
class OtherFromRunOn:
    """Which reference is another one and by how much. gamma: (k,) SI, half: of their length's 95 % interval

    runs: in which it is; span: which these are
    """

    kind: _Kind
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
        mine, conditions = np.isin(table.run, self.runs), table.conditions()
        put = {}
        if self.kind.reference is _GAIN:
            by = np.where(mine, 1.0 + self.gamma[0], 1.0)[:, None]
            gyro, acc = (None if y is None else y / by for y in (table.gyro, table.acc))
            return replace(table, gyro=gyro, acc=acc)
        for sensor in self.kind.sensors:
            name = "ref_rate" if sensor == "gyro" else "ref_acc"
            u = getattr(table, name)
            if u is not None:
                felt = self.kind.felt(sensor, conditions)
                added = sum((g * d for g, d in zip(self.gamma, felt, strict=True)), np.zeros_like(u))
                put[name] = u + np.where(mine[:, None], added, 0.0)
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
    every = (_best(kind, found, data, benches) for kind in _KINDS)
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


def _best(
    kind: _Kind, found: Sequence[SensorFound], data: Prepared, benches: Sequence[BenchAccuracy]
) -> OtherFromRunOn | None:
    mine = [s for s in found if s.sensor in kind.sensors]
    sets, spans = sets_of(data.table.day[data.starts], kind.alone)
    sums = [_sums(kind, s, axis, sets) for s in mine for axis in s.found.pool.state]
    if len(sums) < 2:
        return None
    gram, h = np.sum([x.gram for x in sums], axis=0), np.sum([x.h for x in sums], axis=0)
    s2 = max(float(np.mean([w.mean_square for s in mine for w in s.found.pool.state.values()])), 1.0)
    delta = explained(gram, h, SEEN) / s2
    k = most(delta, spans)
    tests, way = float(len(sets) * len(_KINDS)), inverse_of_told(gram[k], SEEN)
    p = float(chi_square_tail(float(delta[k]), h.shape[1]))
    if tests * p <= CHANCE:  # a dozen power-ons tell their own spread by a dozen degrees of freedom
        freedom = freedom_of(_contrasts(kind, mine, sets[k], way))
        p = float(np.exp(log_p(float(delta[k]), h.shape[1], freedom, 1.0)))
    p = min(1.0, tests * p)
    # by the search, of all records or those of a bench
    searched = _told(found, kind) / s2 if kind.alone else 0.0
    throughout = max(float(delta[0]), searched) - 2.0 * np.log(CHANCE) if searched > 0.0 else 0.0
    if (
        p > CHANCE
        or delta[k] < max(_misfit(found, kind), throughout)
        or not agree(np.array([x.gram[k] for x in sums]), np.array([x.h[k] for x in sums]), s2)
        or (kind.felt is _read_out and not all(_says(x.sensor, sums, k, s2) for x in sums))
    ):
        return None
    gamma = way @ h[k]
    size = float(np.linalg.norm(gamma))
    if size > kind.most:
        return None
    variance = s2 * np.diag(way)
    if kind.name == "mounting" and _draws_as_much(gamma, variance, data, sets[k]):
        return None
    half = TWO_SIDED * float(np.sqrt(gamma**2 @ variance)) / max(size, 1e-300)
    stated = max(map(kind.reference.stated, benches), default=0.0)
    square = float(np.sum(gamma**2 / (stated**2 + variance))) if stated > 0.0 else 0.0
    told = OtherFromRunOn(
        kind, data.table.run[data.starts[sets[k]]], spans[k], gamma, half, tuple(x.name for x in sums),
        p, float(np.sqrt(delta[k])), float(chi_square_tail(square, len(gamma))), float(stated),
    )  # fmt: skip
    if kind.felt not in _WITHIN_POWER_ONS or spans[k] == "alone":
        return told

    def put_right(size: Array) -> DwellTable:
        return replace(told, gamma=size).right(data.table)

    see = [s for s in mine if any(x.told[k] for x in sums if x.sensor == s.sensor)]
    within = size_within_power_ons(kind.felt, see, data.starts, sets[k], put_right)
    return replace(told, gamma=within) if np.linalg.norm(within) <= kind.most else None


def _says(sensor: Sensor, sums: Sequence[_Sums], k: int, s2: float) -> bool:
    """Whether a sensor says it by itself: what one alone says is its own reference's, not the read-out's."""
    mine = [x for x in sums if x.sensor == sensor]
    gram, h = np.sum([x.gram[[k]] for x in mine], axis=0), np.sum([x.h[[k]] for x in mine], axis=0)
    return float(chi_square_tail(float(explained(gram, h, SEEN)[0]) / s2, h.shape[1])) < AS_BUDGETED


def _sums(kind: _Kind, s: SensorFound, axis: int, sets: NDArray[np.bool_]) -> _Sums:
    w = s.found.pool.state[axis]
    W, Q, z = _rows(kind, s, axis)
    drawn = w.noise.covariance.effects.drawn
    each = drawn(W, W), drawn(Q, W), drawn(W, z[:, None])[:, :, 0]
    square, along, h = (sums_over(sets, x) for x in each)
    before = np.trace(square, axis1=1, axis2=2)
    gram = square - np.swapaxes(along, 1, 2) @ along
    told = np.trace(gram, axis1=1, axis2=2) > LEFT * before
    return _Sums(s.sensor, w.channel.name, gram * told[:, None, None], h * told[:, None], told)


def _rows(kind: _Kind, s: SensorFound, axis: int) -> tuple[Array, Array, Array]:
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
    kind: _Kind, mine: Sequence[SensorFound], there: NDArray[np.bool_], way: Array
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


def _told(found: Sequence[SensorFound], kind: _Kind) -> float:
    """Δ of the same reference where a search believes it; 0 where none does."""
    mine = ((s, b) for s in found for b in s.found.library if _name(s, b) == kind.name)
    return max((float(s.found.share(b).delta) for s, b in mine), default=0.0)


def _misfit(found: Sequence[SensorFound], kind: _Kind) -> float:
    """Δ that a strong effect of the bench may leave: its geometry is known roughly, its columns linear."""
    known = [(hypothesis(_name(s, b)), s.found.share(b).delta) for s in found for b in s.found.library]
    same = kind.name if kind.alone else ""  # of all records: `throughout` has it
    others = [(h, delta) for h, delta in known if h.bench_only and h.name != same]
    return max((max(h.misfit, SHARED_MISFIT) * delta for h, delta in others), default=0.0)


def _name(s: SensorFound, b: int) -> str:
    return s.found.pool.blocks[b].name


def _of_other_kinds(s: SensorFound, axis: int, kind: _Kind) -> list[int]:
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
        and not (_name(s, b) == kind.name and kind.alone)
    ]
