"""A thermometer that lags the unit: by how much, and what is left once the temperatures are put right.

The declared curves were fitted to readings that lag and took most of the lag up; its size is therefore that
at which smooth curves over T + τ dT/dt leave least,

    S(τ) = Σ_channels min |V^(−½) (y − p(T) − κ(T) v − …)|²,     95 %: S(τ) − S(τ₀) ≤ 3.84 s²

p, κ polynomials, for a table's nodes would come and go as the ramps' rows move; v the misaligned input; T of
soaked rows their power-on's mean. What a search of those temperatures no longer finds was the thermometer's.

Where a ramp moves by many kelvin within the lag its linear columns miss so much that several channels have an
effect of the rate of temperature instead, each its own. That one number takes all of them away is no chance
where S falls on several channels and rises on none: their coefficients would have to stand to each other as
the slopes of the channels' curves do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray

from planner.diagnose.hypotheses.found import SINGLE
from planner.diagnose.hypotheses.orthogonal import clear, orthonormal
from planner.diagnose.hypotheses.prepared import Prepared
from planner.diagnose.hypotheses.read_temperature import STILL_K_S, straying
from planner.diagnose.hypotheses.references import REFERENCES, hypothesis
from planner.diagnose.hypotheses.scores import score
from planner.diagnose.hypotheses.sensor import SensorFound
from planner.diagnose.hypotheses.whitened import Whitened
from planner.measurement import AXES, evaluate, jacobian
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable
from planner.solvers.distributions import chi_square_tail
from planner.temperature_table import temperature_nodes

NAME = "thermometer_lag"
RATE = "temperature_rate"  # the condition, and the variable of what has no name
LAGS_S = (30.0, 60.0, 100.0, 150.0, 200.0, 300.0, 450.0, 600.0, 900.0)
CHI2_95 = 3.84
FINE = 5  # points between two of the grid
SEVERAL = 2  # channels that must say the same lag where each was named by itself
CHI2_999 = 10.83  # of one channel's S, that is no chance
MISFIT = 0.03  # of what all channels gain, by which curves of one may rise: polynomials follow only so well
UNASKED = 3  # channels that must say it where no search saw anything follow the ramps
MOST_DEGREE = 7  # a unit's curve over 120 K; fewer where the points at which the chamber soaks are fewer


@dataclass(frozen=True)
class Lag:
    """Seconds by which the unit's temperature is ahead of the reading, with its 95 % interval.

    falls: channel -> (S(0) − S(τ)) / s² of its own
    """

    value: float
    low: float
    high: float
    falls: Mapping[str, float]

    @property
    def strength(self) -> float:
        """√(S(0) − S(τ)) / s."""
        return float(np.sqrt(max(sum(self.falls.values()), 0.0)))

    @property
    def told(self) -> tuple[str, ...]:
        """The channels that say it by themselves; none where some channel says another."""
        saying = _saying(np.array(list(self.falls.values())))
        return tuple(channel for channel, says in zip(self.falls, saying, strict=True) if says)


@dataclass(frozen=True)
class Seen:
    """One channel. y, v: (n,) reading and misaligned input; others: (n, k) columns without a temperature."""

    w: Whitened
    y: Array
    v: Array
    others: Array

    def columns(self, basis: Array) -> Array:
        """(n, k) that are fitted to it with a basis (n, d) over temperature."""
        return np.column_stack([basis, basis * self.v[:, None], self.others, self.w.noise.fixed_runs])

    def left(self, basis: Array) -> float:
        """What curves of a basis over temperature leave of it, in noise."""
        X = self.columns(basis)
        white = self.w.noise.whiten(np.column_stack([self.y, X]))
        return float(np.sum(clear(orthonormal(white[:, 1:]), white[:, 0]) ** 2))


def lag_of(found: Sequence[SensorFound], data: Prepared) -> Lag | None:
    """The lag by all channels of all sensors; None where nothing suggests one, or none leaves less.

    Every channel that was searched has its say: accelerometers whose bias is steep know a lag best, and may
    yet have called it something else.
    """
    if not suspects_it(found):
        apart = _ramps(data) >= SEVERAL  # one sweep has no curves but those that it is to be judged by
        if not apart or not (len(following(found)) >= SEVERAL or _glimpsed(found)):
            return None
    table = _calmed(data)
    seen = [seen_of(w) for s in found for w in s.found.pool.state.values()]
    coarse = np.array([*(-lag for lag in reversed(LAGS_S)), 0.0, *LAGS_S])
    left = np.array([_left(seen, table, float(lag)).sum() for lag in coarse])
    k = int(np.clip(np.argmin(left), 1, len(coarse) - 2))
    fine = np.linspace(coarse[k - 1], coarse[k + 1], 2 * FINE + 1)
    around = np.array([_left(seen, table, float(lag)).sum() for lag in fine])
    i = int(np.clip(np.argmin(around), 1, len(fine) - 2))
    near = slice(i - 1, i + 2)  # S is no parabola over all of a grid's step, a hundred seconds
    a, b, _ = np.polyfit(fine[near] - fine[i], around[near], 2)
    if a <= 0.0:
        return None
    value = float(np.clip(fine[i] - b / (2.0 * a), fine[i - 1], fine[i + 1]))
    s2 = max(float(around.min()) / max(len(seen) * len(data.table) - _columns(seen, table), 1), 1.0)
    half = float(np.sqrt(CHI2_95 * s2 / a))
    if abs(value) <= half:
        return None
    falls = (_left(seen, table, 0.0) - _left(seen, table, value)) / s2
    return Lag(value, value - half, value + half, dict(zip(map(_name, seen), falls.tolist(), strict=True)))


def _ramps(data: Prepared) -> int:
    """Power-ons in which the temperature moves."""
    moves = np.abs(data.table.temperature_rate) > STILL_K_S
    return int(np.count_nonzero(np.logical_or.reduceat(moves, data.starts)))


def _glimpsed(found: Sequence[SensorFound]) -> bool:
    """Whether its linear columns, beside all that was found, see more of a lag than chance would."""
    return any(
        score(s.found.without(), [b]).log_p < np.log(SINGLE)
        for s in found
        for b, block in enumerate(s.found.pool.blocks)
        if block.name == NAME
    )


def _saying(falls: Array) -> NDArray[np.bool_]:
    """Which channels' S falls beyond chance; none where that of some channel rises by more than a misfit."""
    rises = max(CHI2_999, MISFIT * float(falls.sum()))
    return np.asarray((falls > CHI2_999) & (falls.min() >= -rises))


def suspects_it(found: Sequence[SensorFound]) -> bool:
    """Whether a search believes that the thermometer lags."""
    return any(s.found.pool.blocks[b].name == NAME for s in found for b in s.found.library)


def following(found: Sequence[SensorFound]) -> set[str]:
    """The channels with an effect, or something without a name, that follows the rate of temperature."""
    out = set()
    for s in found:
        for b in s.found.all:
            block = s.found.pool.blocks[b]
            if block.reference:
                continue
            if block.name == RATE or (not block.generic and RATE in hypothesis(block.name).needs):
                out |= {f"{s.sensor}_{AXES[a]}" for a in s.found.axes(b)}
    return out


def _calmed(data: Prepared) -> DwellTable:
    """The table without the thermometer's noise where the chamber soaks: it bends every curve's foot."""
    t = data.table
    stray = straying(t.temperature_degc, t.temperature_rate, data.starts)
    return replace(t, temperature_degc=t.temperature_degc - stray)


def seen_of(w: Whitened) -> Seen:
    """What curves over any temperature are fitted to."""
    c = w.channel
    parts = evaluate(c.model, c.theta)
    plain = [
        i
        for i, x in enumerate(c.model.columns())  # of the whole model: c.J has what was found taken out
        if not np.isfinite(x.node_degc) and not x.parameter and x.effect not in c.found
    ]
    return Seen(w, c.y, parts.v, jacobian(c.model, c.theta, parts)[:, plain])


def _name(one: Seen) -> str:
    return f"{one.w.channel.sensor}_{AXES[one.w.channel.axis]}"


def _left(seen: Sequence[Seen], table: DwellTable, lag: float) -> Array:
    """(channels,) of S(τ)."""
    basis = _basis(table, lag)
    return np.array([one.left(basis) for one in seen])


def _columns(seen: Sequence[Seen], table: DwellTable) -> int:
    """How many are fitted to all channels."""
    basis = _basis(table, 0.0)
    return sum(one.columns(basis).shape[1] for one in seen)


def _basis(table: DwellTable, lag: float) -> Array:
    """(n, d) polynomials over T + τ dT/dt."""
    t = ahead(table, lag).temperature_degc
    middle, half = (t.max() + t.min()) / 2.0, max(float(np.ptp(t)) / 2.0, 1.0)
    return chebvander((t - middle) / half, degree_of(table))


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
