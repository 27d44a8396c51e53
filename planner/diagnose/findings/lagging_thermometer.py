"""A thermometer that lags the unit: by how much, and what is left once the temperatures are put right.

The declared curves were fitted to readings that lag and took most of the lag up; its size is therefore that
at which smooth curves over T + τ dT/dt leave least,

    S(τ) = Σ_channels min |V^(−½) (y − p(T) − κ(T) v − …)|²,     95 %: S(τ) − S(τ₀) ≤ 3.84 s²

p, κ polynomials, for a table's nodes would come and go as the ramps' rows move; v the misaligned input; T of
soaked rows their power-on's mean. They have a degree less than the points at which the chamber soaks, or as
many more as the rows of long ramps between these ask for: the bends of one curve, beside straight lines from
end to end, were a lag of five minutes. What a search of those temperatures no longer finds was the
thermometer's.

It need not be suspected by a search: where a ramp moves by many kelvin within the lag, linear columns miss
so much that channels have an effect of the rate of temperature instead, each its own, or nothing at all.
What one channel follows by itself is no lag of the thermometer's. It is one where S falls beyond chance
without the channel that says most, rises on none, and the least S of each of the others is near the common,

    Q = Σ_a [S_a(τ₀) − min S_a] / s²   (χ²; Cochran, Biometrics 10 (1954) 101)

for coefficients of several channels would have to stand to each other as the slopes of their curves do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray

from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.channels.read_temperature import STILL_K_S, straying
from planner.diagnose.noise.whitened import Whitened
from planner.diagnose.references.references import REFERENCES
from planner.diagnose.search.sensor import SensorFound
from planner.diagnose.vetoes.own_noise import wandering
from planner.measurement import evaluate, jacobian
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable
from planner.solvers.block_covariance import BlockCovariance
from planner.solvers.distributions import chi_square_tail
from planner.temperature_table import temperature_nodes

NAME = "thermometer_lag"
RATE = "temperature_rate"  # the condition, and the variable of what has no name
LAGS_S = (30.0, 60.0, 100.0, 150.0, 200.0, 300.0, 450.0, 600.0, 900.0)
GLIMPSED_S = (50.0, 150.0, 450.0)  # at one of which S falls by half of what it does at any of 30 to 1500 s
CHI2_95 = 3.84
FINE = 5  # points between two of the grid
SEVERAL = 2  # ramps: one has no curves but those that it is to be judged by
CHANCE = 1e-4  # of what the channels say beside the one that says most: a fault of the bench is rare
CHI2_999 = 10.83  # of one channel's S, that is no chance
MISFIT = 0.03  # of what all channels gain, by which curves of one may rise: polynomials follow only so well
UNLIKE = 1e-3  # p of Q, below which the channels differ
OF_WHAT_IS_COMMON = 0.25  # of what the others say, that a strong lag's curves miss: that is no reason
MOST_DEGREE = 7  # a unit's curve over 120 K; fewer where the points at which the chamber soaks are fewer


@dataclass(frozen=True)
class Lag:
    """Seconds by which the unit's temperature is ahead of the reading, with its 95 % interval.

    falls: channel -> (S(0) − S(τ)) / s² of its own; apart: (channels,) (S(τ) − min S) / s²
    """

    value: float
    low: float
    high: float
    falls: Mapping[str, float]
    apart: Array

    @property
    def strength(self) -> float:
        """√(S(0) − S(τ)) / s."""
        return float(np.sqrt(max(sum(self.falls.values()), 0.0)))

    @property
    def told(self) -> tuple[str, ...]:
        """The channels that say it by themselves."""
        return tuple(channel for channel, fall in self.falls.items() if fall > CHI2_95)

    @property
    def of_several(self) -> bool:
        """Whether the channels say it together, and not one alone."""
        return agree_on_one(np.array(list(self.falls.values())), self.apart, CHANCE)


def agree_on_one(falls: Array, apart: Array, chance: float) -> bool:
    """Whether channels say one change of their temperatures together, and not one of them alone.

    falls: (channels,) of S by it, apart: (channels,) that it leaves S above its own least, both in s²
    """
    others = np.arange(len(falls)) != np.argmax(falls)
    said, differ = float(falls[others].sum()), float(apart[others].sum())
    rises = max(CHI2_999, MISFIT * float(falls.sum()))
    if said <= 0.0 or chi_square_tail(said, 1) > chance or falls.min() < -rises:
        return False
    return bool(differ <= OF_WHAT_IS_COMMON * said or chi_square_tail(differ, others.sum()) > UNLIKE)


@dataclass(frozen=True)
class Seen:
    """One channel. y, v: (n,) reading and misaligned input; others: (n, k) columns without a temperature

    law: of its noise, where that is not its search's; known: (lag, degree) -> `left`
    """

    w: Whitened
    y: Array
    v: Array
    others: Array
    law: BlockCovariance | None = None
    known: dict[tuple[float, int], float] = field(init=False, default_factory=dict, compare=False)

    @property
    def name(self) -> str:
        """`gyro_x` …"""
        return self.w.channel.name

    def columns(self, basis: Array, rows: NDArray[np.int64] | slice = slice(None)) -> Array:
        """(m, k) that are fitted to rows of it with a basis (m, d) over temperature."""
        fixed = self.w.noise.fixed_runs[rows]
        return np.column_stack([basis, basis * self.v[rows][:, None], self.others[rows], fixed])

    def left(self, lag: float, degree: int, basis: Array) -> float:
        """What curves over temperatures that lag, (n, d), leave of it, in noise; asked once of every lag."""
        if (lag, degree) not in self.known:
            X = np.column_stack([self.curved(basis), self.fixed[:, 1:]])
            self.known[lag, degree] = float(np.sum(clear(orthonormal(X), self.fixed[:, 0]) ** 2))
        return self.known[lag, degree]

    def curved(self, basis: Array) -> Array:
        """(n, 2 d) p and κ v of a basis (n, d) over temperature, whitened."""
        return (self.law or self.w.noise).whiten(np.column_stack([basis, basis * self.v[:, None]]))

    @cached_property
    def fixed(self) -> Array:
        """(n, 1 + k) reading beyond its input and columns without a temperature, whitened; once for all."""
        fixed = np.column_stack([self.y - self.v, self.others, self.w.noise.fixed_runs])
        return (self.law or self.w.noise).whiten(fixed)


def lag_of(found: Sequence[SensorFound], data: Prepared) -> Lag | None:
    """The lag by all channels of all sensors; None where nothing suggests one, or none leaves less.

    Every channel that was searched has its say: accelerometers whose bias is steep know a lag best, and may
    yet have called it something else.
    """
    asked = suspects_it(found)
    if not asked and not on_several_ramps(data):
        return None
    table = _calmed(data)
    seen = [seen_of(s, axis) for s in found for axis in s.found.pool.state]
    degree = degree_of(table)
    if not asked and not _glimpsed(seen, table, degree):
        return None
    seen = [_in_own_noise(one, table, degree) for one in seen]
    lag = _sized(seen, table, degree)
    bent = degree if lag is None else degree_asked(seen, table, lag.value)
    return lag if bent == degree else _sized(seen, table, bent)


def _sized(seen: Sequence[Seen], table: DwellTable, degree: int) -> Lag | None:
    """The lag at which curves of a degree leave least; None where that is none."""
    coarse = np.array([*(-lag for lag in reversed(LAGS_S)), 0.0, *LAGS_S])
    each = np.array([_left(seen, table, float(lag), degree) for lag in coarse])
    left = each.sum(axis=1)
    k = int(np.clip(np.argmin(left), 1, len(coarse) - 2))
    fine = np.linspace(coarse[k - 1], coarse[k + 1], 2 * FINE + 1)
    finer = np.array([_left(seen, table, float(lag), degree) for lag in fine])
    around = finer.sum(axis=1)
    i = int(np.clip(np.argmin(around), 1, len(fine) - 2))
    near = slice(i - 1, i + 2)  # S is no parabola over all of a grid's step, a hundred seconds
    a, b, _ = np.polyfit(fine[near] - fine[i], around[near], 2)
    if a <= 0.0:
        return None
    value = float(np.clip(fine[i] - b / (2.0 * a), fine[i - 1], fine[i + 1]))
    s2 = _noise(around.min(), seen, table, degree)
    half = float(np.sqrt(CHI2_95 * s2 / a))
    if abs(value) <= half:
        return None
    here = _left(seen, table, value, degree)
    falls = (_left(seen, table, 0.0, degree) - here) / s2
    least = np.minimum(here, np.vstack([each, finer]).min(axis=0))
    return Lag(
        value, value - half, value + half, dict(zip((one.name for one in seen), falls.tolist(), strict=True)),
        (here - least) / s2,
    )  # fmt: skip


def lags_more(found: Sequence[SensorFound], data: Prepared, strength: float) -> bool:
    """Whether the channels say of several ramps that the thermometer lags, at more sigma than some other."""
    lag = lag_of(found, data) if on_several_ramps(data) else None
    return lag is not None and lag.of_several and lag.strength > strength


def _in_own_noise(one: Seen, table: DwellTable, degree: int) -> Seen:
    """A channel in noise that wanders within power-ons, where it does beside curves that lag or do not.

    A ramp lasts for half an hour: so does a walk, and white about its power-on it is a lag of its own.
    """
    X = np.column_stack([one.columns(_basis(table, lag, degree)) for lag in (0.0, GLIMPSED_S[1])])
    law = wandering(one.w, clear(orthonormal(X), one.y[:, None])[:, 0], X)
    return one if law is None else replace(one, law=law)


def on_several_ramps(data: Prepared) -> bool:
    """Whether the temperature moves in several power-ons."""
    moves = np.abs(data.table.temperature_rate) > STILL_K_S
    return int(np.count_nonzero(np.logical_or.reduceat(moves, data.starts))) >= SEVERAL


def _glimpsed(seen: Sequence[Seen], table: DwellTable, degree: int) -> bool:
    """Whether some lag leaves less than none by more than noise does; not all are asked of every table."""
    now = float(_left(seen, table, 0.0, degree).sum())
    lags = (sign * lag for lag in GLIMPSED_S for sign in (1.0, -1.0))
    least = min(float(_left(seen, table, lag, degree).sum()) for lag in lags)
    return now - least > CHI2_95 * _noise(least, seen, table, degree)


def degree_asked(seen: Sequence[Seen], table: DwellTable, lag: float) -> int:
    """Of the polynomials: that of the soaked points, or higher where all channels together ask for it.

    By what they leave beside that lag or none, with log n for each coefficient more.
    """
    least, count = degree_of(table), len(seen) * len(table)
    most = min(len(temperature_nodes(table.temperature_degc)) - 1, MOST_DEGREE)

    def criterion(degree: int) -> float:
        columns = _columns(seen, table, degree)
        left = min(float(_left(seen, table, one, degree).sum()) for one in (0.0, lag))
        return float(count * np.log(left / count) + columns * np.log(count)) if columns < count else np.inf

    return min(range(least, max(most, least) + 1), key=criterion)


def _noise(least: float, seen: Sequence[Seen], table: DwellTable, degree: int) -> float:
    """s², by the degrees of freedom of all channels; what is whitened has one, or more where curves miss."""
    return max(float(least) / max(len(seen) * len(table) - _columns(seen, table, degree), 1), 1.0)


def suspects_it(found: Sequence[SensorFound]) -> bool:
    """Whether a search believes that the thermometer lags."""
    return any(s.found.pool.blocks[b].name == NAME for s in found for b in s.found.library)


def _calmed(data: Prepared) -> DwellTable:
    """The table without the thermometer's noise where the chamber soaks: it bends every curve's foot."""
    t = data.table
    stray = straying(t.temperature_degc, t.temperature_rate, data.starts)
    return replace(t, temperature_degc=t.temperature_degc - stray)


def _other_references(s: SensorFound, axis: int) -> Array:
    """(n, k) columns of what else was found to be wrong with the bench: a base that leans is no lag."""
    mine = [s.found.pool.blocks[b] for b in s.found.on({axis})]
    wrong = [b.columns[axis] for b in mine if b.reference and b.name != NAME]
    return np.column_stack([np.empty((len(s.found.pool.state[axis].z), 0)), *wrong])


def seen_of(s: SensorFound, axis: int) -> Seen:
    """What curves over any temperature are fitted to, beside what else is wrong with the bench."""
    w = s.found.pool.state[axis]
    c = w.channel
    parts = evaluate(c.model, c.theta)
    plain = [
        i
        for i, x in enumerate(c.model.columns())  # of the whole model: c.J has what was found taken out
        if not np.isfinite(x.node_degc) and not x.parameter and x.effect not in c.found
    ]
    others = np.column_stack([jacobian(c.model, c.theta, parts)[:, plain], _other_references(s, axis)])
    return Seen(w, c.y, parts.v, others)


def _left(seen: Sequence[Seen], table: DwellTable, lag: float, degree: int) -> Array:
    """(channels,) of S(τ)."""
    basis = _basis(table, lag, degree)
    return np.array([one.left(lag, degree, basis) for one in seen])


def _columns(seen: Sequence[Seen], table: DwellTable, degree: int) -> int:
    """How many are fitted to all channels."""
    basis = _basis(table, 0.0, degree)
    return sum(one.columns(basis).shape[1] for one in seen)


def _basis(table: DwellTable, lag: float, degree: int) -> Array:
    """(n, d) polynomials over T + τ dT/dt."""
    t = ahead(table, lag).temperature_degc
    return curves(t, t, degree)


def curves(all_degc: Array, degc: Array, degree: int) -> Array:
    """(…, d) polynomials over temperatures (…), on the range of all of a table's (n,)."""
    middle, half = (all_degc.max() + all_degc.min()) / 2.0, max(float(np.ptp(all_degc)) / 2.0, 1.0)
    return chebvander((degc - middle) / half, degree)


def shifted(all_degc: Array, offsets: Array, degree: int, columns: int) -> Array:
    """(d, k, k) M of offsets (d,): k columns as `Seen` has them, at T − δ, are those at T times M(δ).

    Chebyshev's polynomials at u − e are combinations of those at u; what has no temperature stays.
    """
    n, half = degree + 1, max(float(np.ptp(all_degc)), 2.0) / 2.0
    at = all_degc.min() + half * (1.0 + np.cos(np.pi * (np.arange(n) + 0.5) / n))
    moved = curves(all_degc, at - offsets[:, None], degree)
    M = np.tile(np.eye(columns), (len(offsets), 1, 1))
    M[:, :n, :n] = M[:, n : 2 * n, n : 2 * n] = np.linalg.solve(curves(all_degc, at, degree), moved)
    return M


def degree_of(table: DwellTable) -> int:
    """Of the polynomials that the points at which the chamber soaks tell."""
    still = np.abs(table.temperature_rate) <= STILL_K_S
    points = len(temperature_nodes(table.temperature_degc[still])) if still.any() else MOST_DEGREE + 1
    return int(np.clip(points - 1, 1, MOST_DEGREE))


def ahead(table: DwellTable, lag: float) -> DwellTable:
    """The table with the temperatures that the unit had, T + τ dT/dt."""
    return replace(table, temperature_degc=table.temperature_degc + lag * table.temperature_rate)


def suspect_of(lag: Lag) -> ReferenceSuspect:
    """A lag that the search called something else, as it is reported."""
    r = REFERENCES[NAME]
    return ReferenceSuspect(
        hypothesis=NAME,
        value=lag.value,
        low=lag.low,
        high=lag.high,
        unit=r.unit,
        channels=lag.told,
        p_value=float(chi_square_tail(lag.strength**2, 1)),
        strength=lag.strength,
        check=r.check,
        separated_by=0.0,
    )


def with_lag(suspect: ReferenceSuspect, lag: Lag) -> ReferenceSuspect:
    """The suspicion with the size that the declared model itself tells."""
    return replace(suspect, value=lag.value, low=lag.low, high=lag.high)
