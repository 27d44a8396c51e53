"""Levels of power-ons that become others from one on, on all channels: rows of another unit.

Readings beyond their input, less scale factor and leans as within power-ons, are one level of each power-on
and channel. It is held against what levels scatter beside what a unit does from one to the next: F on the
columns of the step and the power-ons that are left.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.orthogonal import orthonormal
from planner.diagnose.noise.whitened import log_p
from planner.diagnose.records.power_ons_in_order import InOrder, that_stay
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.solvers.least_squares import factors

ANOTHER = 1e-9  # p of an F test, over all places at which another unit's rows could begin
LEAST_RATIO = 2.0  # of the squares before to those after: no curve that a model misses a little
ALONE = 1e-6  # p of one channel's step, over all places
EACH = 1e-3  # p of the second channel of a sensor, where temperatures have levels of their own
LEAST_SIDE = 0.15  # share of the rows on each side of the place; of a power-on's level, left of a step
LEAST_FREEDOM = 5  # power-ons that say how levels scatter
SIDE = 2  # power-ons on either side: one that is off by itself has a name of its own
TRIED = 12  # places, of those at which one step in all cells says most
TURNS = float(np.radians(3.0))  # from which on a power-on is one of turns, whose level may be its own


def levels_step(y: Array, u: Array, rows: InOrder, place: int) -> bool:
    """Whether the levels of a sensor's power-ons become those of another curve over temperature there too.

    Levels are means of y − u less scale factor and leans of each side, as within its power-ons. Free on both
    sides together are a curve over temperature, the mean force and a level of turns: what other errors shift.
    """
    curve, others = _nuisance(rows)
    later = (np.arange(len(curve)) > place)[:, None]
    one, two = np.column_stack([curve, others]), np.column_stack([curve * ~later, curve * later, others])
    squares, log_p = np.zeros(2), 0.0
    for axis in range(3):
        level = _levels(that_stay(y[:, axis], u, rows, axis), rows, place)
        (whole, rank), (split, freer) = _left(one, level), _left(two, level)
        squares += whole, split
        log_p += _gain_p(whole - split, freer - rank, split, len(level) - freer)
    return bool(squares[0] > LEAST_RATIO * squares[1] and log_p < np.log(ANOTHER))


def all_step(rows: InOrder) -> tuple[float, int] | None:
    """Log p and place at which the levels of all channels of both sensors step at once, if they do.

    Beside a curve over temperature, the mean force, a level of turns and a drift over days; without a level
    of turns where nothing else steps: a unit that was taken for all turns has one, but no error of a sensor
    gives it to both sensors at once. At last beside levels of each temperature, of rests and of turns, which
    a second unit has of its own too: those that have several power-ons on both sides of the place tell it.
    """
    channels = [(y[:, axis], u, axis) for y, u in rows.sensors for axis in range(3)]
    if len(channels) < 2 * len(AXES):
        return None
    curve, others = _nuisance(rows)
    days = rows.means(rows.table.day[rows.order][:, None])
    days = days - days.mean()
    levels = np.column_stack([_levels(that_stay(y, u, rows, axis), rows, None) for y, u, axis in channels])
    each = np.ones((len(levels), 1))
    cells = _cells(curve, others[:, -1] > 0.0)
    return (
        _step(levels, np.column_stack([curve, others, days]), each)
        or _step(levels, np.column_stack([curve, others[:, :-1], days]), each)
        or _step(levels, np.column_stack([cells, others[:, :-1], days]), cells)
    )


def _cells(curve: Array, turns: NDArray[np.bool_]) -> Array:
    """(runs, cells) 1 in the power-ons of rests, or of turns, at each temperature."""
    at = 2 * np.argmax(curve, axis=1) + turns
    return np.asarray(at[:, None] == np.unique(at), dtype=float)


def _step(levels: Array, known: Array, cells: Array) -> tuple[float, int] | None:
    """Log p and place of steps in cells (runs, c) of levels (runs, 6), beside what is known (runs, k).

    One channel may step by as little as it scatters.
    """
    basis, runs = factors(known).basis, len(levels)
    z = levels - basis @ (basis.T @ levels)
    whole, best = np.sum(z**2, axis=0), (0.0, -1)
    for place in _likely(z, basis):
        later = (np.arange(runs) > place)[:, None]
        X = cells * later
        X = X[:, (X.sum(axis=0) >= SIDE) & ((cells * ~later).sum(axis=0) >= SIDE)]
        X = X - basis @ (basis.T @ X)
        X = X[:, np.sum(X**2, axis=0) > LEAST_SIDE]
        Q = orthonormal(X, 1e-3)
        freedom = runs - basis.shape[1] - Q.shape[1]
        if Q.shape[1] == 0 or freedom < LEAST_FREEDOM:
            continue
        gain = np.sum((Q.T @ z) ** 2, axis=0)
        rest = np.maximum(whole - gain, 1e-300)
        p = np.array([log_p(g, Q.shape[1], freedom, r / freedom) for g, r in zip(gain, rest, strict=True)])
        p += np.log(runs)
        falls = (whole / rest).reshape(2, -1).mean(axis=1)  # each channel in units of what it scatters
        if _sure_of_both(p, falls) if cells.shape[1] > 1 else _sure(p, falls):
            best = min(best, (float(p.sum()), place))
    return best if best[0] < np.log(ANOTHER) else None


def _sure(p: Array, falls: Array) -> bool:
    """Whether all channels but one say it by themselves, log p (6,), by no little that a curve misses."""
    return bool(np.count_nonzero(p < np.log(ALONE)) >= len(p) - 1 and np.all(falls > LEAST_RATIO))


def _sure_of_both(p: Array, falls: Array) -> bool:
    """Whether either sensor says it, and two of its channels: without a curve there is none to miss.

    A tilt or a mounting is of the accelerometers' levels alone.
    """
    each = p.reshape(2, -1)
    two = np.sort(each, axis=1)[:, 1] < np.log(EACH)
    return bool(np.all(each.sum(axis=1) < np.log(ANOTHER)) and two.all() and falls.max() > LEAST_RATIO)


def _likely(z: Array, basis: Array) -> list[int]:
    """The places at which one step (runs, runs − 1) explains most of all channels' levels z (runs, c)."""
    runs = len(z)
    step = (np.arange(runs)[:, None] > np.arange(runs - 1)).astype(float)
    step -= basis @ (basis.T @ step)
    length = np.sum(step**2, axis=0)
    along = np.sum((step.T @ z) ** 2 / np.maximum(np.sum(z**2, axis=0), 1e-300), axis=1)
    share = np.where(length > LEAST_SIDE, along / np.maximum(length, LEAST_SIDE), 0.0)
    return [int(k) for k in np.argsort(-share)[:TRIED] if share[k] > 0.0]


def _gain_p(gain: float, columns: int, rest: float, freedom: int) -> float:
    return 0.0 if freedom < 5 else float(log_p(gain, columns, freedom, max(rest, 1e-300) / freedom))


def _nuisance(rows: InOrder) -> tuple[Array, Array]:
    """(runs, nodes) a curve over temperature; (runs, k) the mean force, whether the power-on is of turns."""
    table, others = rows.table, np.zeros((len(rows.order), 0))
    if table.ref_acc is not None:
        others = table.ref_acc[rows.order]
    if table.ref_rate is not None:
        turns = np.linalg.norm(table.ref_rate[rows.order], axis=1, keepdims=True) > TURNS
        others = np.column_stack([others, turns])
    return rows.means(rows.weights), rows.means(others)


def _levels(X: Array, rows: InOrder, place: int | None) -> Array:
    """(runs,) mean of the last column less what the others, fitted about the means of power-ons, say.

    Fitted on each side of the place by itself, or once.
    """
    means = rows.means(X)
    about, out = X - means[rows.run], means[:, -1].copy()
    side = np.arange(len(means)) > (len(means) if place is None else place)
    for one in (side, ~side):
        mine = one[rows.run]
        if mine.any():
            slope = np.linalg.lstsq(about[mine, :-1], about[mine, -1], rcond=1e-6)[0]
            out[one] -= means[one, :-1] @ slope
    return np.asarray(out)


def _left(X: Array, y: Array) -> tuple[float, int]:
    """Square that regression on X (n, k) leaves, and the rank of X."""
    beta, _, rank, _ = np.linalg.lstsq(X, y, rcond=1e-8)
    return float(np.sum((y - X @ beta) ** 2)), int(rank)
