"""A unit that had not come to the temperature that is written: a chamber that was not soaked, a set point.

    T = T_read + d_r e^(−t/τ)   of power-on r, t its time since power-on; one τ, one d_r for all channels

Each channel follows it by the slope of its own curve, D = p'(T) + κ'(T) v, and a search makes a warm-up of
one, a drift over temperature of the next. In whitened rows clear of curves over temperature and all else,
W_a those of D_a e^(−t/τ) of each power-on, z_a the rest of channel a,

    d = (Σ_a W_aᵀW_a + s² I/σ_d²)⁻¹ Σ_a W_aᵀz_a,

anew about the temperatures so found until they stay (Gauss, Newton). It is the unit's temperature where

    the channel that says most foretells the others',   (Σ_b h_bᵀd_a)² / Σ_b |W_b d_a|²,   χ² of one, or
    one d_r for all channels is likelier than a d_ar of each that needs one: with G = WᵀW, h = Wᵀz of it
        E(G, h) = max_σ ½ hᵀ(G + s²/σ²)⁻¹h / s² − ½ log det(I + σ² G / s²),   E(Σ G, Σ h) − Σ max(E_a, 0)
    (Kass, Raftery, J. Am. Stat. Assoc. 90 (1995) 773), and what they differ by is little, or chance,
    and no warm-up of their own, the same in every power-on, says as much: a unit heats itself so each time.

Asked where a search makes something of the time since power-on, or leaves what one time constant explains.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.findings.lagging_thermometer import (
    CHI2_999,
    MISFIT,
    MOST_DEGREE,
    OF_WHAT_IS_COMMON,
    Seen,
    curves,
    on_several_ramps,
    seen_of,
)
from planner.diagnose.findings.lagging_thermometer import NAME as LAGS
from planner.diagnose.findings.suspects import FEW
from planner.diagnose.search.sensor import SensorFound
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable
from planner.protocols import SENSORS, Sensor
from planner.solvers.distributions import chi_square_tail
from planner.temperature_table import GAP_K, hats, temperature_nodes

TAUS_S = (100.0, 200.0, 300.0, 450.0, 700.0, 1000.0, 1500.0, 2500.0)  # of a unit's mass on its fixture
FIRST_S = (200.0, 700.0, 1500.0)  # asked of curves as read, before all are about the temperatures found
QUICK = 1_000  # rows, of which all is asked within a fifth of a second
FAR_FROM = 20.0  # log odds against one temperature, that curves as read may miss of it
FOLLOWS = 0.01  # p, as a channel foretells the others
GLIMPSED_S = 450.0  # of which what any of them leaves has enough
SIGMAS_K = (0.5, 1.5, 5.0, 15.0, 50.0)  # of d_r, where what they would be is weighed
SIGMA_K = 15.0  # of d_r before any record: beyond it a chamber has not even come near
NEARER_K = (2.0, 4.0, 8.0)  # first, or curves that bend both ways are met at the other temperature
MOST_K = 80.0  # from one end of a chamber's range to the air of the room
LEAST_K = 0.5  # below which the chamber's own gradient is as much
ROUNDS = 4  # of Gauss and Newton, for curves bend within 20 K
LEAST_POINTS = 3  # of temperature, of which a curve has a slope everywhere
MOST_ROWS = 20_000  # larger tables are recordings, not dwells
CHANCE = 1e-6  # of what channels say beside the one that says most, over all τ; a fault of a bench is rare
SEVERAL = 3  # channels that must say it by themselves
TOLD = 3.0  # sigma of a d_r that is named
RANK = 1e-11  # of the largest direction of products of columns
TIME = "time_on"


@dataclass(frozen=True)
class NotSoaked:
    """offset: (g,) K by which the unit was warmer than is written as each power-on of `runs` began.

    tau: s, with low and high of its grid; sigma: (g,) K; channels: that say it by themselves
    """

    runs: NDArray[np.int64]
    offset: Array
    sigma: Array
    tau: float
    low: float
    high: float
    channels: tuple[str, ...]
    strength: float
    p_value: float

    def right(self, table: DwellTable) -> DwellTable:
        """The table with the temperatures that the unit had."""
        by = dict(zip(self.runs.tolist(), self.offset.tolist(), strict=True))
        d = np.array([by.get(run, 0.0) for run in table.run.tolist()])
        warmer = d * np.exp(-table.time_on / self.tau)
        return replace(table, temperature_degc=table.temperature_degc + warmer)

    @property
    def suspect(self) -> ReferenceSuspect:
        """As it is reported."""
        size = np.where(np.abs(self.offset) > TOLD * self.sigma, np.abs(self.offset), 0.0)
        most = np.sort(self.runs[np.argsort(-size)[: max(min(FEW, int((size > 0.0).sum())), 1)]])
        far = float(self.offset[np.argmax(size)])
        check = (
            f"look up how long the chamber was soaked: in run {', '.join(map(str, most.tolist()))}"
            f"{' and others' if (size > 0.0).sum() > len(most) else ''} the unit was up to {far:+.2g} K from "
            f"what is written, and came to it with a time constant of {self.tau:.0f} s; all channels follow "
            "it by the slopes of their own curves"
        )
        return ReferenceSuspect(
            LAGS, self.tau, self.low, self.high, "s", self.channels, self.p_value, self.strength, check,
            self.strength,
        )  # fmt: skip


def not_soaked(found: Sequence[SensorFound], data: Prepared) -> NotSoaked | None:
    """The temperatures that the unit had, where it had not come to those that are written, or None."""
    table = data.table
    points = len(temperature_nodes(table.temperature_degc))
    degree = int(np.clip(points - 1, 1, MOST_DEGREE))
    several = sum(len(s.found.pool.state) for s in found) >= SEVERAL
    if points < LEAST_POINTS or len(table) > MOST_ROWS or not several or on_several_ramps(data):
        return None  # of ramps it is asked how much the thermometer lags
    if not _goes_with_time(found) and not _glimpsed(found, data, degree):
        return None
    seen = [seen_of(s, axis) for s in found for axis in s.found.pool.state]
    names = [c.name for s in found for c in s.channels]
    fit = _Fit(data, [_Channel.of(one, table.temperature_degc) for one in seen], degree)
    if len(table) > QUICK and not any(fit.may_be(tau) for tau in FIRST_S):
        return None
    each = [fit.at(tau) for tau in TAUS_S]
    left = np.array([one.left for one in each])
    best = int(np.argmin(left))
    one, s2 = each[best], fit.noise(float(left[best]))
    p = min(_foretold(one.first, s2), float(np.exp(-max(_odds(one.gram, one.h, s2), 0.0)))) * len(TAUS_S)
    if p > CHANCE or not one.agree(s2) or not one.no_warm_up(s2) or np.abs(one.d).max() > MOST_K:
        return None
    if any(one.contradicted(fit.of(sensor), s2) for sensor in SENSORS):
        return None
    told = tuple(name for name, fall in zip(names, one.falls / s2, strict=True) if fall > CHI2_999)
    sigma = np.sqrt(s2 * np.diag(one.way))
    far = np.abs(one.d) > np.maximum(TOLD * sigma, LEAST_K)
    if len(told) < SEVERAL or not far.any():
        return None
    low, high = TAUS_S[max(best - 1, 0)], TAUS_S[min(best + 1, len(TAUS_S) - 1)]
    strength = float(np.sqrt(max(float(one.falls.sum()) / s2, 0.0)))
    return NotSoaked(table.run[data.starts], one.d, sigma, TAUS_S[best], low, high, told, strength, p)


def _goes_with_time(found: Sequence[SensorFound]) -> bool:
    """Whether a search makes something of the time since power-on, on whatever channel."""
    effects = catalog.effects()
    for s in found:
        for b in s.found.all:
            name = s.found.pool.blocks[b].name
            if TIME in (effects[name].needs if name in effects else name):
                return True
    return False


def _glimpsed(found: Sequence[SensorFound], data: Prepared, degree: int) -> bool:
    """Whether what a search leaves follows plain curves' slopes in the first minutes, at one time constant.

    A few milliseconds a channel: of rows as they were read, and beside the declared model's own basis.
    """
    t, starts = data.table.temperature_degc, data.starts
    decay = np.exp(-data.table.time_on / GLIMPSED_S)
    gram, h, square, rows = np.zeros((len(starts), len(starts))), np.zeros(len(starts)), 0.0, 0
    basis, rises = curves(t, t, degree), curves(t, t + 0.5, degree) - curves(t, t - 0.5, degree)
    for s in found:
        for w in s.found.pool.state.values():
            u, here = w.channel.u, w.channel.model.conditions
            driven = here.rate if s.sensor == "gyro" else here.specific_force
            X = np.column_stack([basis, basis * u[:, None], np.delete(driven, w.channel.axis, axis=1)])
            beta = np.linalg.lstsq(X.T @ X, X.T @ (w.channel.y - u), rcond=RANK)[0]
            slope = np.column_stack([rises, rises * u[:, None]]) @ beta[: 2 * basis.shape[1]]
            W = w.noise.whiten((slope * decay)[:, None])[:, 0]
            sums = np.add.reduceat(np.column_stack([W * W, W * w.z, w.Q * W[:, None]]), starts, axis=0)
            gram = gram + np.diag(sums[:, 0]) - sums[:, 2:] @ sums[:, 2:].T
            h, square, rows = h + sums[:, 1], square + float(w.z @ w.z), rows + len(t) - w.Q.shape[1]
    s2 = max(square / max(rows, 1), 1.0)
    return float(chi_square_tail(float(h @ _inverse(gram, s2) @ h) / s2, len(starts))) < CHANCE


# ---------------------------------------------------------------- curves at temperatures


@dataclass(frozen=True)
class _Channel:
    """One channel.

    bends: (n, m) whitened, what a curve through every point of a chamber has beyond polynomials of so few
        degrees: a misfit that all power-ons of one temperature share is none of its own
    """

    seen: Seen
    bends: Array

    @classmethod
    def of(cls, seen: Seen, degc: Array) -> _Channel:
        nodes = temperature_nodes(degc)
        through = hats(degc, nodes, GAP_K) if len(nodes) > MOST_DEGREE + 1 else np.empty((len(degc), 0))
        return cls(seen, seen.curved(through))


@dataclass(frozen=True)
class _Linear:
    """One channel: WᵀW (g, g), Wᵀz (g,), zᵀz, and what one warm-up for all power-ons explains of it."""

    gram: Array
    h: Array
    left: float
    alike: float


@dataclass(frozen=True)
class _At:
    """A time constant. d: (g,) K; way: (g, g) the inverse that gave it; left: of all channels

    first: the channels about curves as they were read
    gram: (a, g, g), h: (a, g) of each channel, by slopes where the unit was
    falls, apart: (a,) as in `agree_on_one`
    alike: (a,) what a warm-up of its own, the same in every power-on, explains of each
    """

    d: Array
    way: Array
    left: float
    first: Sequence[_Linear]
    gram: Array
    h: Array
    falls: Array
    apart: Array
    alike: Array

    def agree(self, s2: float) -> bool:
        """Whether the channels say the same d_r: each by itself would say little more, or that by chance."""
        falls, apart = self.falls / s2, self.apart / s2
        if falls.min() < -max(CHI2_999, MISFIT * float(falls.sum())):
            return False
        freedom = (len(falls) - 1) * len(self.d)
        differ = float(apart.sum())
        return bool(
            differ - freedom <= OF_WHAT_IS_COMMON * float(falls.sum())
            or chi_square_tail(differ, freedom) > 1e-3
        )

    def contradicted(self, mine: NDArray[np.bool_], s2: float) -> bool:
        """Whether a sensor's channels (a,), which would show Σ dᵀG_a d of these temperatures, rise by them.

        A unit has one temperature. A table's rate that drifted was 50 K to the gyros, nothing beside.
        """
        shown = float(np.einsum("i,aij,j->", self.d, self.gram[mine], self.d)) / s2
        return bool(shown > CHI2_999 and self.falls[mine].sum() < 0.0)

    def no_warm_up(self, s2: float) -> bool:
        """Whether it is more than each channel's own warm-up, or one of all, that is the same every time."""
        more = float(self.falls.sum() - self.alike.sum()) / s2
        G, h = self.gram.sum(axis=0), self.h.sum(axis=0)
        every, same = float(h @ self.d), float(h.sum()) ** 2 / max(float(G.sum()), 1e-300)
        differ = (every - same) / s2
        enough = (
            differ > OF_WHAT_IS_COMMON * every / s2 and chi_square_tail(max(differ, 0.0), len(h)) < CHANCE
        )
        return bool(enough and more > 0.0 and chi_square_tail(more, len(self.d)) < CHANCE)


@dataclass(frozen=True)
class _Fit:
    """All channels under curves over the temperatures that the unit had."""

    data: Prepared
    channels: Sequence[_Channel]
    degree: int

    def of(self, sensor: Sensor) -> NDArray[np.bool_]:
        """(a,) the channels of a sensor."""
        return np.array([c.seen.w.channel.sensor == sensor for c in self.channels], dtype=bool)

    def may_be(self, tau: float) -> bool:
        """Whether channels may say one temperature, by curves as read; of a warm-up of one they do not."""
        t = self.data.table
        each = [self._linear(c, t.temperature_degc, np.exp(-t.time_on / tau)) for c in self.channels]
        s2 = self.noise(sum(x.left for x in each))
        odds = _odds(np.array([x.gram for x in each]), np.array([x.h for x in each]), s2)
        return odds > -FAR_FROM or _foretold(each, s2) < FOLLOWS

    def at(self, tau: float) -> _At:
        """What they say of one time constant."""
        t, starts = self.data.table.temperature_degc, self.data.starts
        run = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(t))))
        decay = np.exp(-self.data.table.time_on / tau)
        first = now = [self._linear(c, t, decay) for c in self.channels]
        d = np.zeros(len(starts))
        for sigma in (*NEARER_K, *(SIGMA_K,) * ROUNDS):
            known = np.eye(len(d)) / sigma**2
            step = np.linalg.inv(np.sum([x.gram for x in now], axis=0) + known)
            step = step @ (np.sum([x.h for x in now], axis=0) - d / sigma**2)
            d = np.clip(d + step, -2.0 * MOST_K, 2.0 * MOST_K)
            now = [self._linear(c, t + d[run] * decay, decay) for c in self.channels]
            if sigma == SIGMA_K and np.abs(step).max() < LEAST_K / 5.0:
                break
        left = np.array([x.left for x in now])
        return _At(
            d, _inverse(np.sum([x.gram for x in now], axis=0), 1.0), float(left.sum()), first,
            np.array([x.gram for x in now]), np.array([x.h + x.gram @ d for x in now]),
            np.array([x.left for x in first]) - left,
            np.array([x.h @ _inverse(x.gram, 1.0) @ x.h for x in now]),
            np.array([x.alike for x in first]),
        )  # fmt: skip

    def _linear(self, c: _Channel, t: Array, decay: Array) -> _Linear:
        """One channel about temperatures t (n,).

        A power-on's column has rows of its own only, whitened too: sums over them make all of a table.
        """
        all_degc, whiten = self.data.table.temperature_degc, c.seen.w.noise.whiten
        basis = curves(all_degc, t, self.degree)
        fixed = c.seen.fixed
        X = np.column_stack([c.seen.curved(basis), fixed[:, 1:]])
        beta = np.linalg.lstsq(X.T @ X, X.T @ fixed[:, 0], rcond=RANK)[0]
        beta = beta[: 2 * basis.shape[1]].reshape(2, -1)
        rises = (curves(all_degc, t + 0.5, self.degree) - curves(all_degc, t - 0.5, self.degree)) @ beta.T
        slope = (rises[:, 0] + rises[:, 1] * c.seen.v) * decay
        Q = orthonormal(np.column_stack([X, c.bends]))
        both = whiten(np.column_stack([slope, decay]))
        W, rest = both[:, 0], clear(Q, np.column_stack([fixed[:, 0], both[:, 1]]))
        z, u = rest[:, 0], rest[:, 1]
        sums = np.add.reduceat(np.column_stack([W * W, W * z, Q * W[:, None]]), self.data.starts, axis=0)
        gram = np.diag(sums[:, 0]) - sums[:, 2:] @ sums[:, 2:].T
        return _Linear(gram, sums[:, 1], float(z @ z), float(u @ z) ** 2 / max(float(u @ u), 1e-300))

    def noise(self, left: float) -> float:
        """s², of all channels; what is whitened has one, or more where curves miss."""
        columns = sum(2 * (self.degree + 1) + int(c.seen.fixed.shape[1]) - 1 for c in self.channels)
        columns += sum(int(c.bends.shape[1]) for c in self.channels)
        freedom = len(self.channels) * len(self.data.table) - columns - len(self.data.starts)
        return max(left / max(freedom, 1), 1.0)


def _foretold(each: Sequence[_Linear], s2: float) -> float:
    """p of how the others follow what the channel that says most by itself says, of curves as read."""
    a = int(np.argmax([x.h @ _inverse(x.gram, s2) @ x.h for x in each]))
    d = _inverse(each[a].gram, s2) @ each[a].h
    others = [x for x in each if x is not each[a]]
    along = float(np.sum([x.h for x in others], axis=0) @ d)
    square = float(d @ np.sum([x.gram for x in others], axis=0) @ d)
    return float(chi_square_tail(along**2 / square / s2, 1)) if along > 0.0 and square > 0.0 else 1.0


def _odds(gram: Array, h: Array, s2: float) -> float:
    """Log of the odds of one d_r for all channels, (a, g, g) and (a, g), against d_ar where it is needed."""
    own = (_evidence(G, x, s2) for G, x in zip(gram, h, strict=True))
    return _evidence(gram.sum(axis=0), h.sum(axis=0), s2) - sum(max(one, 0.0) for one in own)


def _evidence(gram: Array, h: Array, s2: float) -> float:
    """½ hᵀ(G + s²/σ²)⁻¹h / s² − ½ log det(I + σ² G / s²): of d_r ~ N(0, σ²) against none, at its best σ."""
    value, vector = np.linalg.eigh(gram)
    value, along = np.maximum(value, 0.0) / s2, (vector.T @ h) ** 2 / s2**2
    each = ((along / (value + 1.0 / x**2)).sum() - np.log1p(x**2 * value).sum() for x in SIGMAS_K)
    return 0.5 * float(max(each))


def _inverse(gram: Array, s2: float) -> Array:
    """Of the products of power-ons with what is known of them before."""
    return np.asarray(np.linalg.inv(gram + s2 / SIGMA_K**2 * np.eye(len(gram))))
