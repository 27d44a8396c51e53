"""Rows of another unit under the same name: all channels of a sensor are others from one power-on on.

It is asked before any error model. Within power-ons scale factors and leans tell it. Where a campaign takes
its temperatures one after the other they may be what a unit does from one temperature to the next; then the
levels of the power-ons decide, of which some share a temperature with those before.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.read_temperature import STILL_K_S
from planner.diagnose.noise.whitened import log_p
from planner.diagnose.records.another_unit_among import of_either
from planner.diagnose.records.another_unit_at_rest import another_at_rest, few_at_rest, some_at_rest
from planner.diagnose.records.another_unit_of_turns import turns_of_another
from planner.diagnose.records.leans_change import leans_change
from planner.diagnose.records.levels_step import ANOTHER, LEAST_RATIO, LEAST_SIDE, all_step, levels_step
from planner.diagnose.records.mounted_anew import mounted_anew, scaled_anew
from planner.diagnose.records.power_ons_in_order import InOrder, in_order, that_stay
from planner.diagnose.references.bench_directions import at_rest, horizontal
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable
from planner.temperature_table import temperature_nodes

EACH = 1e-3  # p of one channel's leans, held against those of power-ons, at a place that rows told
LIKELY = 1.92  # of log p, half of χ²'s 95 % point of one: places as far behind the best may be the one
MOST_SAID = 8  # numbers of power-ons in a sentence


@dataclass(frozen=True)
class AnotherUnit:
    """kept: (n,) rows of the unit of which there are more; log_p: of chance."""

    kept: NDArray[np.bool_]
    suspect: ReferenceSuspect
    note: str
    log_p: float


def another_unit(table: DwellTable, kept: NDArray[np.bool_]) -> AnotherUnit | None:
    """Whether scale factors and leans of all channels of a sensor become others at one power-on.

    From readings about the means of power-ons, off the centrifuge: a turn-on change of one bias says nothing.
    """
    rows = in_order(table, kept)
    if len(rows.order) < 60 or rows.run.max() < 8:
        return _at_rest(table, kept)
    surest: tuple[float, int] | None = None
    together = np.zeros(int(rows.run.max()))
    for y, u in rows.sensors:
        stays = _every_channel(y, u, rows, that_stay)
        if stays is None:
            continue
        free = _every_channel(y, u, rows, _free)
        each = stays if free is None else np.maximum(stays, free)
        found = None if free is None else _sure(each)
        if found is None:
            each, found = stays, _sure(stays)
            found = found if found is not None and levels_step(y, u, rows, found[1]) else None
        if found is not None and _leans_too(y, u, rows, found[1]):
            surest = min(surest or found, found)
            together += each.sum(axis=0)
    if surest is not None:
        first, best, last = _places(together)
        seen = rows.sensors, rows.weights, rows.run, best
        if (mounted_anew(*seen) or scaled_anew(*seen)) and all_step(rows) is None:
            return None  # which power-on, and by how much, is told beside the error model; biases stay then
        return _said(rows, surest[0], best, "scale factors and misalignments", (first, last))
    stepped, at_rest = all_step(rows), _at_rest(table, kept)
    if stepped is None and at_rest is None:
        return _of_turns(rows)
    if stepped is None or (at_rest is not None and at_rest.log_p < stepped[0]):
        return at_rest  # behind a few of another unit all levels step back
    return _said(rows, *stepped, "the biases of all channels")


def _at_rest(table: DwellTable, kept: NDArray[np.bool_]) -> AnotherUnit | None:
    """Whether the leans of all accelerometers become others, by their rests alone.

    Of power-ons at one temperature: on a ramp the bias moves from face to face, and few soaked ones before it
    scatter so.
    """
    if table.acc is None or table.ref_acc is None:
        return None
    moves = np.unique(table.run[np.abs(table.temperature_rate) > STILL_K_S])
    rows = in_order(table, kept & at_rest(table.conditions()) & ~np.isin(table.run, moves))
    if len(rows.order) == 0:
        return None
    north = horizontal(table.conditions().at(rows.order))[0]
    u = table.ref_acc[rows.order]
    seen = _about_curves(table.acc[rows.order], u, rows), u, rows.run, north
    found, few = another_at_rest(*seen, rows.temperature), few_at_rest(*seen, rows.temperature)
    some = some_at_rest(*seen, rows.temperature)
    least = min((one[0] for one in (found, few, some) if one is not None), default=0.0)
    if found is not None and found[0] <= least:
        return _said(rows, *found, "misalignments of the accelerometers")
    if few is not None and few[0] <= least:
        return _said_of_a_few(rows, *few)
    return None if some is None else _said_of_some(rows, *some)


def _of_turns(rows: InOrder) -> AnotherUnit | None:
    """Whether the turns are another unit's than the rests, where both have power-ons of their own."""
    found = turns_of_another(rows)
    if found is None:
        return None
    p, fewer = found
    number = rows.number[fewer]
    out = ~np.isin(rows.table.run, rows.number[~fewer])  # nor are loads: whose they are nobody knows
    which = ", ".join(map(str, number[:MOST_SAID])) + (" …" if len(number) > MOST_SAID else "")
    check = f"compare the serial numbers of power-ons that turn with those at rest (runs {which})"
    suspect = _suspect(rows.table, p, int(number[0]), (float(number[0]), float(number[0])), check)
    note = (
        "the biases of all channels are others in power-ons that turn than in those at rest: rows of another "
        f"unit; {int(out.sum())} rows are not judged"
    )
    return AnotherUnit(~out, suspect, note, p)


def _about_curves(y: Array, u: Array, rows: InOrder) -> Array:
    """(n, 3) readings less what they are beyond their input, on average, at each temperature of a power-on.

    Of one that goes through several, a bias's curve is noise of its leans: 2 mg of rows that have 0.05.
    """
    nodes = temperature_nodes(rows.temperature)
    at = np.argmin(np.abs(rows.temperature[:, None] - nodes), axis=1)
    _, cell = np.unique(rows.run * len(nodes) + at, return_inverse=True)
    if cell.max(initial=-1) <= rows.run.max(initial=-1):
        return y
    means = np.array([np.bincount(cell, c) for c in (y - u).T]) / np.bincount(cell)
    return np.asarray(y - means.T[cell])


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


def _said(
    rows: InOrder, p: float, best: int, others: str, span: tuple[int, int] | None = None
) -> AnotherUnit:
    """span: the first and the last place that it may be; between them nobody knows whose the rows are."""
    low, high = (best, best) if span is None else span
    table, first = rows.table, int(rows.number[best + 1])
    of_one, of_other = table.run <= rows.number[low], table.run >= rows.number[high + 1]
    out = ~of_one if np.sum(rows.run <= low) >= np.sum(rows.run > high) else ~of_other
    ends = float(rows.number[low + 1]), float(rows.number[high + 1])
    suspect = _suspect(table, p, first, ends, f"compare the serial numbers before and from run {first} on")
    note = (
        f"from run {first} on {others} are others: rows of another unit, or this one mounted anew or after a "
        f"shock; {int(out.sum())} rows are not judged"
    )
    return AnotherUnit(~out, suspect, note, p)


def _suspect(
    table: DwellTable, p: float, first: int, ends: tuple[float, float], check: str
) -> ReferenceSuspect:
    """p: log; ends: the first and the last power-on that may be the first of the other unit."""
    return ReferenceSuspect(
        "mixed_units", float(first), *ends, "run", channels_of(table), float(np.exp(max(p, -700.0))),
        float("inf"), check, float("inf"),
    )  # fmt: skip


def _said_of_a_few(rows: InOrder, p: float, runs: NDArray[np.int64]) -> AnotherUnit:
    """runs: 0 …; what was moved between them is the same unit's."""
    first, last = int(rows.number[runs[0]]), int(rows.number[runs[-1]])
    out = (rows.table.run >= first) & (rows.table.run <= last)
    return _said_of_runs(rows.table, p, f"runs {first} to {last}", first, out)


def _said_of_some(rows: InOrder, p: float, there: NDArray[np.bool_]) -> AnotherUnit:
    """there: (runs,) power-ons whose rests are the other unit's; all others are told by these."""
    t, theirs = rows.table, there[rows.run]
    assert t.acc is not None
    assert t.ref_acc is not None
    one, two = np.zeros(len(t), dtype=bool), np.zeros(len(t), dtype=bool)
    one[rows.order[~theirs]], two[rows.order[theirs]] = True, True
    out = of_either(t.acc, t.ref_acc, t.run, t.temperature_degc, one, two)
    runs = np.unique(t.run[out])
    which = ", ".join(map(str, runs[:MOST_SAID])) + (" …" if len(runs) > MOST_SAID else "")
    name = f"runs {which}" if len(runs) > 1 else f"run {which}"
    return _said_of_runs(t, p, name, int(runs[0]), out)


def _said_of_runs(table: DwellTable, p: float, which: str, first: int, out: NDArray[np.bool_]) -> AnotherUnit:
    check = f"compare the serial numbers of {which} with those of the others"
    suspect = _suspect(table, p, first, (float(first), float(first)), check)
    note = (
        f"in {which} misalignments of the accelerometers are others: rows of another unit; "
        f"{int(out.sum())} rows are not judged"
    )
    return AnotherUnit(~out, suspect, note, p)


# ---------------------------------------------------------------- within power-ons


def _every_channel(
    y: Array, u: Array, rows: InOrder, columns: Callable[[Array, Array, InOrder, int], Array]
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


def _free(y: Array, u: Array, rows: InOrder, axis: int) -> Array:
    """(n, 1 + 3 nodes) the same with leans over temperature."""
    across = np.delete(u, axis, axis=1)
    leans = (rows.weights * v[:, None] for v in across.T)
    return np.column_stack([*leans, that_stay(y, u, rows, axis)[:, 2:]])


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


def _leans_too(y: Array, u: Array, rows: InOrder, place: int) -> bool:
    """Whether the leans of every channel change there by more than power-ons draw them."""
    each = [leans_change(y[:, axis], u, axis, rows.run)[place] for axis in range(3)]
    return bool(max(each) < np.log(EACH))
