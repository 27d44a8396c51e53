"""What the thermometer's own noise leaves: a soaked unit keeps its temperature, the readings of it stray.

    y = b(T) + …,  T̃ = T + δ    ⇒    y − b(T̃) = −b′(T̃) δ,    δ ≈ T̃ − mean of the power-on

0.05 K on a bias of 0.8 mg/K are 0.04 mg, the noise of a record; only where the curve is steep, so that it
looks like an effect of temperature. One column with a free coefficient says how much of the straying is
noise: none where the unit's temperature really moved (it then lies on the curve), all where it did not.

A unit that warms itself moves by kelvins on a course that is smooth, and the readings stray about that,

    δ ≈ T̃ − q(t),   q a polynomial over the time of each stretch of a power-on that moves by less than JUMP_K

At 600 deg/s on an arm 0.04 K are ten sigma of a record there: a scale factor that goes with the time. And
the slope that the readings show at a soaked point is b′ less a part of it, b′ σ²(δ) / σ²(T̃), which leaves a
rest of the warming itself: 0.02 K on 0.3 K are 4 %, a warm_up at 16 sigma.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.diagnose.channels.channel import LEAST_NODES, ROUNDING, SOAKED_K, TOLD, Channel, tables
from planner.diagnose.channels.orthogonal import orthonormal
from planner.effects._bench_frame import turning
from planner.effects._history import RAMP
from planner.measurement import sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.solvers.group_batches import batches_of
from planner.solvers.least_squares import least_squares
from planner.temperature_table import REACH_K, fitting_hats

JUMP_K = 1.5  # between records, from which the chamber went on to another point
MOVES = 5.0  # times what strays about it, from which a course is one: of noise alone it is twice
LEAST_OF_A_COURSE = 5  # records: a parabola leaves two of them
DEGREES = (2, 3, 4, 5, 6)  # of a course: an hour of 2.5 K with a time constant of 10 min is a sextic to 4 mK
A_DEGREE = 4  # records at least for each: of fewer, a polynomial follows the noise
_STEP_K = 0.01  # for the slope of a table that is linear between its nodes
STILL_K_S = 0.1 / 60.0  # K/s: a chamber that soaks moves less; on a ramp the readings move with the unit


def strays_of(x: Conditions, starts: NDArray[np.int64]) -> tuple[Array, Array]:
    """(n,) K each: how soaked rows stray about the mean of their power-on, and about their course."""
    return (
        straying(x.temperature_degc, x.temperature_rate, starts),
        about_course(x.temperature_degc, x.temperature_rate, x.time_on, starts),
    )


def with_read_temperature(c: Channel, strays: tuple[Array, Array], starts: NDArray[np.int64]) -> Channel:
    """The channel with the columns of the thermometer's noise among those of the declared model."""
    columns = np.column_stack([np.empty((len(c.r), 0)), *_columns(c, strays, starts)])
    return replace(
        c,
        J=np.column_stack([c.J, columns]),
        steep=np.column_stack([c.steep, np.zeros_like(columns)]),
        most=np.concatenate([c.most, np.full(columns.shape[1], np.inf)]),
    )


def _columns(c: Channel, strays: tuple[Array, Array], starts: NDArray[np.int64]) -> Iterator[Array]:
    """(n, 1) at rest and in turns, where another thermometer's place or another soak may hold."""
    if not np.any(strays):
        return
    steep, turns = _steepness(c), turning(c.model.conditions)
    whole = steep + _steepness_at_few_nodes(c, starts) if strays[1].any() else steep
    for column in (strays[0] * steep, strays[1] * whole):
        for here in (turns, ~turns):
            if np.any(column[here]):
                yield np.where(here, column, 0.0)[:, None]


def straying(degc: Array, rate: Array, starts: NDArray[np.int64]) -> Array:
    """(n,) K by which a soaked row's reading differs from the mean of its power-on's soaked rows."""
    run = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(degc))))
    still = np.abs(rate) <= STILL_K_S
    count = np.bincount(run, still, len(starts))
    mean = np.bincount(run, np.where(still, degc, 0.0), len(starts)) / np.maximum(count, 1.0)
    about = np.where(still, degc - mean[run], 0.0)
    return np.where((np.abs(about) <= SOAKED_K) & (count[run] > 1), about, 0.0)


def about_course(degc: Array, rate: Array, time_on: Array, starts: NDArray[np.int64]) -> Array:
    """(n,) K by which a row's reading differs from the course of those before and after it; on ramps 0.

    A unit that warms itself moves faster than a soaked chamber, 0.25 K/min, and slower than one that ramps.
    """
    run = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(degc))))
    soaked = np.flatnonzero(np.abs(rate) <= RAMP)
    goes_on = (np.diff(run[soaked]) == 0) & (np.abs(np.diff(degc[soaked])) <= JUMP_K)
    firsts = np.flatnonzero(np.concatenate([np.ones(min(len(soaked), 1), dtype=bool), ~goes_on]))
    out, moving = np.zeros(len(degc)), list[_Stretches]()
    for batch in batches_of(firsts, np.diff(np.append(firsts, len(soaked)))):
        if batch.rows.shape[1] >= LEAST_OF_A_COURSE:
            rows = soaked[batch.rows]
            every = _of_own_course(rows, time_on[rows], degc[rows])
            # a unit that keeps its temperature has its mean
            moves = np.ptp(every.about - every.left, axis=1) > MOVES * np.std(every.left, axis=1)
            if moves.any():
                moving.append(every.at(moves))
    for one in _of_one_course(moving):
        out[one.rows] = one.left
    return out


@dataclass(frozen=True)
class _Stretches:
    """Stretches of one length, G of m records, (G, m) each.

    rows: of the table; time: s; about: K about their mean; left: K beside their course, for which `taken`
    coefficients were taken
    """

    rows: NDArray[np.int64]
    time: Array
    about: Array
    left: Array
    taken: float

    def at(self, some: NDArray[np.bool_]) -> _Stretches:
        """Some of the G."""
        share = float(np.mean(some))
        return _Stretches(
            self.rows[some], self.time[some], self.about[some], self.left[some], share * self.taken
        )


def _of_own_course(rows: NDArray[np.int64], time: Array, degc: Array) -> _Stretches:
    """What polynomials over the time leave, each with its own coefficients; one degree, that does best."""
    about = degc - degc.mean(axis=1, keepdims=True)
    count, m = rows.shape
    degrees = [d for d in DEGREES if d == DEGREES[0] or d * A_DEGREE <= m]
    left = [_beside_polynomials(time, about, d) for d in degrees]
    best = min(range(len(degrees)), key=lambda k: _foreseen([left[k]], count * (degrees[k] + 1.0)))
    return _Stretches(rows, time, about, left[best], count * (degrees[best] + 1.0))


def _of_one_course(own: Sequence[_Stretches]) -> Sequence[_Stretches]:
    """The same beside one course that all have in common, each at its own level, where that does better.

    Polynomials of their own follow the noise of a dozen records. A unit that warms itself alike whenever it
    is switched on has a few coefficients in a whole campaign; what a course takes of the noise would be one
    of the scale factor over the time again.
    """
    if sum(len(s.rows) for s in own) < LEAST_OF_A_COURSE:
        return own
    best, least = own, _foreseen([s.left for s in own], sum(s.taken for s in own))
    span = max(float(s.time.max()) for s in own)
    levels = sum(len(s.rows) for s in own)
    y = np.concatenate([s.about.ravel() for s in own])
    for degree in DEGREES:
        powers = [np.stack([(s.time / span) ** d for d in range(1, degree + 1)], axis=2) for s in own]
        X = np.concatenate([(p - p.mean(axis=1, keepdims=True)).reshape(-1, degree) for p in powers])
        rest = y - X @ np.linalg.lstsq(X, y, rcond=ROUNDING)[0]
        parts = np.split(rest, np.cumsum([s.rows.size for s in own])[:-1])
        left = [part.reshape(s.rows.shape) for part, s in zip(parts, own, strict=True)]
        foreseen = _foreseen(left, levels + degree)
        if foreseen < least:
            best, least = [replace(s, left=x) for s, x in zip(own, left, strict=True)], foreseen
    return best


def _foreseen(left: Sequence[Array], taken: float) -> float:
    """K² by which records are foreseen from the others, by generalised cross-validation.

    n Σ left² / (n − taken)²   (Craven, Wahba, Numer. Math. 31, 1979)
    """
    n = sum(x.size for x in left)
    return n * sum(float(np.sum(x**2)) for x in left) / (n - taken) ** 2


def _beside_polynomials(time: Array, y: Array, degree: int) -> Array:
    """(G, m) what polynomials of one degree over the times (G, m) leave of y (G, m)."""
    t = time - time.mean(axis=1, keepdims=True)
    t /= np.maximum(np.abs(t).max(axis=1, keepdims=True), 1.0)
    powers = np.stack([t**d for d in range(degree, -1, -1)], axis=2)
    length = np.linalg.norm(powers, axis=1, keepdims=True)
    u, s, _ = np.linalg.svd(powers / np.where(length > 0, length, 1.0), full_matrices=False)
    u *= (s > ROUNDING * s[:, :1])[:, None, :]
    left = y[:, :, None]
    for _ in range(2):  # once leaves rounding of the first values
        left = left - u @ (np.swapaxes(u, 1, 2) @ left)
    return np.asarray(left[:, :, 0])


def _steepness(c: Channel) -> Array:
    """(n,) dy/dT of the declared tables, each along a smooth curve through its nodes."""
    from scipy.interpolate import CubicSpline

    t = c.model.conditions.temperature_degc
    total = np.zeros(len(t))
    for (name, term), place in tables(c.model).items():
        if len(place) < LEAST_NODES:
            continue
        column = _drive(c, name, term)
        nodes = np.array([c.model.columns()[i].node_degc for i in place])
        order = np.argsort(nodes)
        curve = CubicSpline(nodes[order], c.theta[place][order])
        total += curve(np.clip(t, nodes.min(), nodes.max()), 1) * column
    return total


def _steepness_at_few_nodes(c: Channel, starts: NDArray[np.int64]) -> Array:
    """(n,) dy/dT of the tables with too few nodes for a curve, as the rows about each node show it.

    Only of a unit that warms itself: of a soaked one noise over noise would be the slope. Within power-ons,
    where each has its own bias and scale factor: 50 ppm of these are twice what 60 ppm/K make of 0.4 K.
    """
    t, total = c.model.conditions.temperature_degc, np.zeros(len(c.r))
    few = {of: place for of, place in tables(c.model).items() if len(place) < LEAST_NODES}
    for (name, term), place in few.items():
        nodes = np.array([c.model.columns()[i].node_degc for i in place])
        ahead, back = (fitting_hats(t + side, nodes, REACH_K) for side in (_STEP_K, -_STEP_K))
        total += (ahead - back) @ c.theta[place] / (2.0 * _STEP_K) * _drive(c, name, term)
    slopes = np.any(c.steep, axis=0)
    if not (few and slopes.any()):
        return total
    across = np.delete(sensed(c.sensor, c.model.conditions), c.axis, axis=1)
    inside = _beside_level_and_gain(np.column_stack([c.J[:, slopes], across, c.r]), c.u, starts)
    coefficients, _ = least_squares(inside[:, :-1], inside[:, -1], TOLD)
    return np.asarray(total + c.steep[:, slopes] @ coefficients[: slopes.sum()])


def _beside_level_and_gain(columns: Array, u: Array, starts: NDArray[np.int64]) -> Array:
    """(n, k) what a level and a multiple of the input u (n,) of each power-on leave of columns."""
    left = columns.copy()
    for rows in np.split(np.arange(len(u)), starts[1:]):
        own = orthonormal(np.column_stack([np.ones(len(rows)), u[rows]]), ROUNDING)
        left[rows] -= own @ (own.T @ left[rows])
    return left


def _drive(c: Channel, name: str, term: str) -> Array:
    """(n,) what a table's effect adds to the channel's reading per unit of the table's value."""
    effect = catalog.effects()[name]
    index = [x.name for x in effect.terms(c.sensor)].index(term)
    seen = c.driven if effect.group == "scale_factor" else c.model.conditions
    return np.asarray(effect.regressors(c.sensor, seen)[:, c.axis, index])
