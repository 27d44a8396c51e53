"""Rows of another unit under the same name: all channels of a sensor are others from one power-on on.

It is asked before any error model. Within power-ons scale factors and leans tell it. Where a campaign takes
its temperatures one after the other they may be what a unit does from one temperature to the next; then the
levels of the power-ons decide, of which some share a temperature with those before.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.prepared import LEAST_OF_MANY
from planner.diagnose.channels.read_temperature import STILL_K_S
from planner.diagnose.noise.whitened import log_p
from planner.diagnose.records.another_unit_among import of_either
from planner.diagnose.records.another_unit_at_rest import another_at_rest, few_at_rest, some_at_rest
from planner.diagnose.records.leans_change import leans_change
from planner.diagnose.records.mounted_anew import mounted_anew, scaled_anew
from planner.diagnose.references.bench_directions import at_rest, horizontal, loaded
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable
from planner.solvers.least_squares import factors
from planner.temperature_table import hats, temperature_nodes

MOST_ROWS = 20_000  # of which another unit is asked; 1e6 take minutes and gigabytes
ANOTHER = 1e-9  # p of an F test, over all places at which another unit's rows could begin
LEAST_RATIO = 2.0  # of the squares before to those after: no curve that a model misses a little
EACH = 1e-3  # p of one channel's leans, held against those of power-ons, at a place that rows told
LIKELY = 1.92  # of log p, half of χ²'s 95 % point of one: places as far behind the best may be the one
ALONE = 1e-6  # p of one channel's step, over all places
LEAST_SIDE = 0.15  # share of the rows on each side of the place
MOST_SAID = 8  # numbers of power-ons in a sentence
TURNS = float(np.radians(3.0))  # from which on a power-on is one of turns, whose level may be its own


@dataclass(frozen=True)
class AnotherUnit:
    """kept: (n,) rows of the unit of which there are more."""

    kept: NDArray[np.bool_]
    suspect: ReferenceSuspect
    note: str


@dataclass(frozen=True)
class _Rows:
    """Rows off the centrifuge in the order of their power-ons. run: (n,) 0 … runs − 1, number: as read"""

    table: DwellTable
    order: NDArray[np.int64]
    run: NDArray[np.int64]
    number: NDArray[np.int64]

    @property
    def temperature(self) -> Array:
        return self.table.temperature_degc[self.order]

    @property
    def weights(self) -> Array:
        """(n, nodes) straight lines over temperature."""
        return hats(self.temperature, temperature_nodes(self.temperature), 0.0)

    @property
    def sensors(self) -> Sequence[tuple[Array, Array]]:
        """Reading and reference (n, 3) of each sensor that has both."""
        t, found = self.table, []
        if t.gyro is not None and t.ref_rate is not None:
            found.append((t.gyro[self.order], t.ref_rate[self.order]))
        if t.acc is not None and t.ref_acc is not None:
            found.append((t.acc[self.order], t.ref_acc[self.order]))
        return found

    def means(self, x: Array) -> Array:
        """(runs, k) of columns (n, k)."""
        return np.array([np.bincount(self.run, c) for c in x.T]).T / np.bincount(self.run)[:, None]


def another_unit(table: DwellTable, kept: NDArray[np.bool_]) -> AnotherUnit | None:
    """Whether scale factors and leans of all channels of a sensor become others at one power-on.

    From readings about the means of power-ons, off the centrifuge: a turn-on change of one bias says nothing.
    """
    rows = _rows(table, kept)
    if len(rows.order) < 60 or rows.run.max() < 8:
        return _at_rest(table, kept)
    surest: tuple[float, int] | None = None
    together = np.zeros(int(rows.run.max()))
    for y, u in rows.sensors:
        stays = _every_channel(y, u, rows, _stays)
        if stays is None:
            continue
        free = _every_channel(y, u, rows, _free)
        each = stays if free is None else np.maximum(stays, free)
        found = None if free is None else _sure(each)
        if found is None:
            each, found = stays, _sure(stays)
            found = found if found is not None and _levels_step(y, u, rows, found[1]) else None
        if found is not None and _leans_too(y, u, rows, found[1]):
            surest = min(surest or found, found)
            together += each.sum(axis=0)
    if surest is not None:
        first, best, last = _places(together)
        seen = rows.sensors, rows.weights, rows.run, best
        if mounted_anew(*seen) or scaled_anew(*seen):
            return None  # which power-on, and by how much, is told beside the error model
        return _said(rows, surest[0], best, "scale factors and misalignments", (first, last))
    stepped = _all_step(rows) or _all_step(rows, level_of_turns=False)
    return _at_rest(table, kept) if stepped is None else _said(rows, *stepped, "the biases of all channels")


def _at_rest(table: DwellTable, kept: NDArray[np.bool_]) -> AnotherUnit | None:
    """Whether the leans of all accelerometers become others, by their rests alone.

    Of power-ons at one temperature: on a ramp the bias moves from face to face, and few soaked ones before it
    scatter so.
    """
    if table.acc is None or table.ref_acc is None:
        return None
    moves = np.unique(table.run[np.abs(table.temperature_rate) > STILL_K_S])
    rows = _rows(table, kept & at_rest(table.conditions()) & ~np.isin(table.run, moves))
    if len(rows.order) == 0:
        return None
    north = horizontal(table.conditions().at(rows.order))[0]
    seen = table.acc[rows.order], table.ref_acc[rows.order], rows.run, north
    found, few = another_at_rest(*seen, rows.temperature), few_at_rest(*seen, rows.temperature)
    some = some_at_rest(*seen, rows.temperature)
    least = min((one[0] for one in (found, few, some) if one is not None), default=0.0)
    if found is not None and found[0] <= least:
        return _said(rows, *found, "misalignments of the accelerometers")
    if few is not None and few[0] <= least:
        return _said_of_a_few(rows, *few)
    return None if some is None else _said_of_some(rows, *some)


def channels_of(table: DwellTable) -> tuple[str, ...]:
    """Names of the channels that have readings."""
    sensors = [s for s, y in (("gyro", table.gyro), ("accelerometer", table.acc)) if y is not None]
    return tuple(f"{s}_{a}" for s in sensors for a in AXES)


def _sure(p: Array) -> tuple[float, int] | None:
    """Least log p of the weakest of three channels (3, runs − 1) and its place, if it is sure."""
    weakest = p.max(axis=0)
    place = int(np.argmin(weakest))
    return (float(weakest[place]), place) if weakest[place] < np.log(ANOTHER) else None


def _places(together: Array) -> tuple[int, int, int]:
    """First, best and last place (runs − 1,) that log p of all channels allow, summed over the sensors.

    A unit changes on all of them at once. Rests, between which nothing turns, tell the gyros' leans no place.
    """
    best = int(np.argmin(together))
    either = np.flatnonzero(together <= together[best] + LIKELY)
    return int(either[0]), best, int(either[-1])


def _said(rows: _Rows, p: float, best: int, others: str, span: tuple[int, int] | None = None) -> AnotherUnit:
    """span: the first and the last place that it may be; between them nobody knows whose the rows are."""
    low, high = (best, best) if span is None else span
    table, first = rows.table, int(rows.number[best + 1])
    of_one, of_other = table.run <= rows.number[low], table.run >= rows.number[high + 1]
    out = ~of_one if np.sum(rows.run <= low) >= np.sum(rows.run > high) else ~of_other
    suspect = ReferenceSuspect(
        "mixed_units", float(first), float(rows.number[low + 1]), float(rows.number[high + 1]), "run",
        channels_of(table), float(np.exp(max(p, -700.0))), float("inf"),
        f"compare the serial numbers before and from run {first} on", float("inf"),
    )  # fmt: skip
    note = (
        f"from run {first} on {others} are others: rows of another unit, or this one mounted anew or after a "
        f"shock; {int(out.sum())} rows are not judged"
    )
    return AnotherUnit(~out, suspect, note)


def _said_of_a_few(rows: _Rows, p: float, runs: NDArray[np.int64]) -> AnotherUnit:
    """runs: 0 …; what was moved between them is the same unit's."""
    first, last = int(rows.number[runs[0]]), int(rows.number[runs[-1]])
    out = (rows.table.run >= first) & (rows.table.run <= last)
    return _said_of_runs(rows.table, p, f"runs {first} to {last}", first, out)


def _said_of_some(rows: _Rows, p: float, there: NDArray[np.bool_]) -> AnotherUnit:
    """there: (runs,) power-ons whose rests are the other unit's; all others are told by these."""
    t, theirs = rows.table, there[rows.run]
    assert t.acc is not None
    assert t.ref_acc is not None
    one, two = np.zeros(len(t), dtype=bool), np.zeros(len(t), dtype=bool)
    one[rows.order[~theirs]], two[rows.order[theirs]] = True, True
    out = of_either(t.acc, t.ref_acc, t.run, t.temperature_degc, one, two)
    runs = np.unique(t.run[out])
    which = ", ".join(map(str, runs[:MOST_SAID])) + (" …" if len(runs) > MOST_SAID else "")
    return _said_of_runs(t, p, f"runs {which}", int(runs[0]), out)


def _said_of_runs(table: DwellTable, p: float, which: str, first: int, out: NDArray[np.bool_]) -> AnotherUnit:
    suspect = ReferenceSuspect(
        "mixed_units", float(first), float(first), float(first), "run", channels_of(table),
        float(np.exp(max(p, -700.0))), float("inf"),
        f"compare the serial numbers of {which} with those of the others", float("inf"),
    )  # fmt: skip
    note = (
        f"in {which} misalignments of the accelerometers are others: rows of another unit; "
        f"{int(out.sum())} rows are not judged"
    )
    return AnotherUnit(~out, suspect, note)


def _rows(table: DwellTable, kept: NDArray[np.bool_]) -> _Rows:
    rows = np.flatnonzero(kept)
    rows = rows[
        ~loaded(table.conditions().at(rows))
    ]  # what is asked of these goes with them: the table stays
    rows = rows[_of_some_runs(table.run[rows])]
    order = rows[np.lexsort((table.time_on[rows], table.run[rows]))]
    number, run = np.unique(table.run[order], return_inverse=True)
    return _Rows(table, order, run, number)


def _of_some_runs(run: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n,) rows of evenly chosen power-ons, about MOST_ROWS: another unit shows in a few of them."""
    every = np.unique(run)
    keep = max(LEAST_OF_MANY, int(len(every) * MOST_ROWS / max(len(run), 1)))
    if keep >= len(every):
        return np.ones(len(run), dtype=bool)
    return np.isin(run, every[np.linspace(0, len(every) - 1, keep).round().astype(int)])


# ---------------------------------------------------------------- within power-ons


def _every_channel(
    y: Array, u: Array, rows: _Rows, columns: Callable[[Array, Array, _Rows, int], Array]
) -> Array | None:
    """(3, runs − 1) log p that coefficients before and after each power-on are the same; 0 where none tells.

    Once with leans that stay and once with leans that are free over temperature; the larger of both counts:
    what a unit does from one temperature to the next, products included, is no other unit, though a campaign
    take its temperatures one after the other; and many columns follow the bends of a curve better in halves.
    None as soon as the channels cannot be sure of one place together, which is nearly always the first.
    """
    found = np.full((3, int(rows.run.max())), -np.inf)
    for axis in range(3):
        found[axis] = _split_of(columns(y[:, axis], u, rows, axis), rows.run)
        if _sure(found) is None:
            return None
    return found


def _free(y: Array, u: Array, rows: _Rows, axis: int) -> Array:
    """(n, 1 + 3 nodes) the same with leans over temperature."""
    across = np.delete(u, axis, axis=1)
    leans = (rows.weights * v[:, None] for v in across.T)
    return np.column_stack([*leans, _stays(y, u, rows, axis)[:, 2:]])


def _stays(y: Array, u: Array, rows: _Rows, axis: int) -> Array:
    """(n, 3 + nodes) leans, the scale factor over temperature, and what the reading is beyond its input."""
    own = u[:, [axis]]
    return np.column_stack([np.delete(u, axis, axis=1), rows.weights * own, y[:, None] - own])


def _split_of(X: Array, run: NDArray[np.int64]) -> Array:
    """The same for columns X (n, k + 1), the last of which is what the others are to explain."""
    n = len(X)
    means = np.array([np.bincount(run, c) for c in X.T]).T / np.bincount(run)[:, None]
    X = X - means[run]
    X = X / np.maximum(np.linalg.norm(X, axis=0), 1e-300)
    runs = int(run.max()) + 1
    starts = np.concatenate([[0], np.cumsum(np.bincount(run))[:-1]])
    grams = np.array([part.T @ part for part in np.split(X, starts[1:])])
    before, total = np.cumsum(grams, axis=0)[:-1], grams.sum(axis=0)
    whole, rank = _rest(total[None])
    first, last = _rest(before), _rest(total - before)
    split, freer = first[0] + last[0], first[1] + last[1] - rank[0]
    freedom = np.maximum(n - runs - rank[0] - freer, 5.0)
    counts = np.cumsum(np.bincount(run))[:-1]
    sides = np.minimum(counts, n - counts) >= LEAST_SIDE * n
    told = sides & (freer > 0) & (whole[0] > LEAST_RATIO * split)
    found = np.zeros(runs - 1)
    for k in np.flatnonzero(told).tolist():
        s2 = max(float(split[k]), 1e-30) / float(freedom[k])
        found[k] = float(log_p(float(whole[0] - split[k]), int(freer[k]), float(freedom[k]), s2))
    return found + np.where(told, np.log(runs), 0.0)


def _rest(grams: Array) -> tuple[Array, Array]:
    """(g,) what regression leaves of the last column's square, and (g,) the rank of the others."""
    G, h, s = grams[:, :-1, :-1], grams[:, :-1, -1], grams[:, -1, -1]
    value, vector = np.linalg.eigh(G)
    seen = value > 1e-9
    along = np.einsum("gij,gi->gj", vector, h)
    taken = np.sum(np.where(seen, along**2 / np.where(seen, value, 1.0), 0.0), axis=1)
    return np.asarray(np.maximum(s - taken, 0.0)), seen.sum(axis=1)


def _leans_too(y: Array, u: Array, rows: _Rows, place: int) -> bool:
    """Whether the leans of every channel change there by more than power-ons draw them."""
    each = [leans_change(y[:, axis], u, axis, rows.run)[place] for axis in range(3)]
    return bool(max(each) < np.log(EACH))


# ---------------------------------------------------------------- between power-ons


def _levels_step(y: Array, u: Array, rows: _Rows, place: int) -> bool:
    """Whether the levels of a sensor's power-ons become those of another curve over temperature there too.

    Levels are means of y − u less scale factor and leans of each side, as within its power-ons. Free on both
    sides together are a curve over temperature, the mean force and a level of turns: what other errors shift.
    """
    curve, others = _nuisance(rows)
    later = (np.arange(len(curve)) > place)[:, None]
    one, two = np.column_stack([curve, others]), np.column_stack([curve * ~later, curve * later, others])
    squares, log_p = np.zeros(2), 0.0
    for axis in range(3):
        level = _levels(_stays(y[:, axis], u, rows, axis), rows, place)
        (whole, rank), (split, freer) = _left(one, level), _left(two, level)
        squares += whole, split
        log_p += _gain_p(whole - split, freer - rank, split, len(level) - freer)
    return bool(squares[0] > LEAST_RATIO * squares[1] and log_p < np.log(ANOTHER))


def _all_step(rows: _Rows, level_of_turns: bool = True) -> tuple[float, int] | None:
    """Log p and place at which the levels of all channels of both sensors step at once, if they do.

    Beside a curve over temperature, the mean force, a level of turns and a drift over days. One channel may
    step by as little as it scatters. Without a level of turns where nothing else steps: a unit that was taken
    for all turns has one, but no error of a sensor gives it to both sensors at once.
    """
    channels = [(y[:, axis], u, axis) for y, u in rows.sensors for axis in range(3)]
    curve, others = _nuisance(rows)
    others = others if level_of_turns else others[:, :-1]
    days = rows.means(rows.table.day[rows.order][:, None])
    known = factors(np.column_stack([curve, others, days - days.mean()])).basis
    runs, freedom = len(known), len(known) - known.shape[1] - 1
    if len(channels) < 2 * len(AXES) or freedom < 5:
        return None
    levels = np.column_stack([_levels(_stays(y, u, rows, axis), rows, None) for y, u, axis in channels])
    step = (np.arange(runs)[:, None] > np.arange(runs - 1)).astype(float)
    levels, step = (x - known @ (known.T @ x) for x in (levels, step))
    length, whole = np.sum(step**2, axis=0)[:, None], np.sum(levels**2, axis=0)
    gain = np.where(length > LEAST_SIDE, (step.T @ levels) ** 2 / np.maximum(length, LEAST_SIDE), 0.0)
    rest = np.maximum(whole - gain, 1e-300)
    p = log_p(gain, 1, freedom, rest / freedom) + np.log(runs)
    sure = (p < np.log(ALONE)).sum(axis=1) >= len(channels) - 1
    for three in (slice(0, 3), slice(3, 6)):
        sure &= whole[three].sum() > LEAST_RATIO * rest[:, three].sum(axis=1)
    place = int(np.argmin(np.where(sure, p.sum(axis=1), 0.0)))
    found = float(p[place].sum())
    return (found, place) if sure[place] and found < np.log(ANOTHER) else None


def _gain_p(gain: float, columns: int, rest: float, freedom: int) -> float:
    return 0.0 if freedom < 5 else float(log_p(gain, columns, freedom, max(rest, 1e-300) / freedom))


def _nuisance(rows: _Rows) -> tuple[Array, Array]:
    """(runs, nodes) a curve over temperature; (runs, k) the mean force, whether the power-on is of turns."""
    table, others = rows.table, np.zeros((len(rows.order), 0))
    if table.ref_acc is not None:
        others = table.ref_acc[rows.order]
    if table.ref_rate is not None:
        turns = np.linalg.norm(table.ref_rate[rows.order], axis=1, keepdims=True) > TURNS
        others = np.column_stack([others, turns])
    return rows.means(rows.weights), rows.means(others)


def _levels(X: Array, rows: _Rows, place: int | None) -> Array:
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
