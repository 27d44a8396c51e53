"""Records that are not what the table says: a face label that is turned, rows of another unit.

Both are asked before any error model: they are of the size of the reading, not of its errors.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.hypotheses.prepared import LEAST_OF_MANY
from planner.diagnose.hypotheses.references import loaded
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect, RowLeftOut
from planner.nouns.dwell_table import DwellTable
from planner.temperature_table import hats, temperature_nodes
from planner.units import STANDARD_GRAVITY_MPS2

FAR_OFF_G = 0.2  # ten times the bias and the lean of a unit before calibration: no error of a sensor
NEARER = 0.3  # of that distance, at which another label explains the reading
LEAST_RATE = float(np.radians(3.0))  # below which a bias may be as large as a rate
FAR_OFF_RATE = 0.2  # share of the rate, as FAR_OFF_G of gravity
MOST_ROWS = 20_000  # of which another unit is asked; 1e6 take minutes and gigabytes
ANOTHER = 1e-9  # p of an F test, over all places at which another unit's rows could begin
LEAST_RATIO = 2.0  # of the squares before to those after: no curve that a model misses a little
LEAST_SIDE = 0.15  # share of the rows on each side of the place
_TURNS: tuple[Array, ...] = tuple(
    np.diag(signs)[list(order)]
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
)


@dataclass(frozen=True)
class Screened:
    """kept: (n,) rows of the table that go on; what was found about the others."""

    kept: NDArray[np.bool_]
    left_out: tuple[RowLeftOut, ...]
    suspects: tuple[ReferenceSuspect, ...]
    notes: tuple[str, ...]


def screened(table: DwellTable) -> Screened:
    """Look at labels, then at whose rows these are."""
    turned = _turned(table)
    left = tuple(_rows_out(table, turned))
    suspects = [_label_suspect(table, turned)] if turned else []
    kept = np.ones(len(table), dtype=bool)
    kept[list(turned)] = False
    other = _another_unit(table, kept)
    notes = []
    if other is not None:
        suspects.append(other.suspect)
        notes.append(other.note)
        kept &= other.kept
    return Screened(kept, left, tuple(suspects), tuple(notes))


# ---------------------------------------------------------------- labels


def _turned(table: DwellTable) -> dict[int, Array]:
    """row -> the signed permutation of the axes under which the reading would be that of its label."""
    found: dict[int, Array] = {}
    for y, u, least, far in _judged(table):
        size = np.linalg.norm(u, axis=1)
        scale = np.maximum(size, least)
        off = np.linalg.norm(y - u, axis=1) / scale
        for i in np.flatnonzero((size >= least) & (off > far)).tolist():
            if i in found:
                continue
            best = min(_TURNS, key=lambda turn: float(np.linalg.norm(y[i] - turn @ u[i])))
            if np.linalg.norm(y[i] - best @ u[i]) / scale[i] < NEARER * off[i]:
                found[i] = best
    return found


def _judged(table: DwellTable) -> Iterator[tuple[Array, Array, float, float]]:
    """Reading and reference of each sensor that has both, the least input that tells, and what is far off."""
    if table.acc is not None and table.ref_acc is not None:
        yield table.acc, table.ref_acc, 0.5 * STANDARD_GRAVITY_MPS2, FAR_OFF_G
    if table.gyro is not None and table.ref_rate is not None:
        yield table.gyro, table.ref_rate, LEAST_RATE, FAR_OFF_RATE


def _rows_out(table: DwellTable, turned: dict[int, Array]) -> Iterator[RowLeftOut]:
    for i, turn in sorted(turned.items()):
        step = "" if table.step is None else str(table.step[i])
        said = _guess(table, i, turn)
        yield RowLeftOut(int(table.run[i]), step, "all", float("inf"), said, _condition(table, i))


def _guess(table: DwellTable, i: int, turn: Array) -> str:
    u = table.ref_acc[i] if table.ref_acc is not None else np.zeros(3)
    if not np.any(u):
        return f"run {int(table.run[i])}: the reading looks like another axis or direction of the turn"
    return f"run {int(table.run[i])} looks as if face {_face(u)} were {_face(turn @ u)}"


def _face(u: Array) -> str:
    axis = int(np.argmax(np.abs(u)))
    return f"{'+' if u[axis] > 0 else '−'}{AXES[axis]}"


def _condition(table: DwellTable, i: int) -> str:
    return f"{table.temperature_degc[i]:.1f} degC, {table.time_on[i]:.0f} s since power-on"


def _label_suspect(table: DwellTable, turned: dict[int, Array]) -> ReferenceSuspect:
    runs = sorted({int(table.run[i]) for i in turned})
    count = float(len(turned))
    where = ", ".join(map(str, runs[:5]))
    return ReferenceSuspect(
        "wrong_label", count, count, count, "rows", _channels(table), 0.0, float("inf"),
        f"look up the faces of run {where} in the bench's log; they are left out until then", float("inf"),
    )  # fmt: skip


def _channels(table: DwellTable) -> tuple[str, ...]:
    sensors = [s for s, y in (("gyro", table.gyro), ("accelerometer", table.acc)) if y is not None]
    return tuple(f"{s}_{a}" for s in sensors for a in AXES)


# ---------------------------------------------------------------- rows of another unit


@dataclass(frozen=True)
class _Another:
    kept: NDArray[np.bool_]
    suspect: ReferenceSuspect
    note: str


def _another_unit(table: DwellTable, kept: NDArray[np.bool_]) -> _Another | None:
    """Whether scale factors and leans of all channels of a sensor become others at one power-on.

    From readings about the means of power-ons, off the centrifuge: turn-on changes of the bias say nothing.
    """
    rows = np.flatnonzero(kept & ~loaded(table.conditions()))
    rows = rows[_of_some_runs(table.run[rows])]
    order = rows[np.lexsort((table.time_on[rows], table.run[rows]))]
    _, run = np.unique(table.run[order], return_inverse=True)
    if len(order) < 60 or run.max() < 8:
        return None
    best, p = None, np.zeros(0)
    for y, u in _inputs(table):
        three = [
            _split_p(y[order, axis], u[order], table.temperature_degc[order], run, axis) for axis in range(3)
        ]
        weakest = np.max(three, axis=0)
        if weakest.min() < np.log(ANOTHER) and (best is None or weakest.min() < p[best]):
            best, p = int(np.argmin(weakest)), weakest
    if best is None:
        return None
    later = run > best
    judged = np.unique(table.run[order])
    first = int(judged[best + 1])
    out = table.run > judged[best] if later.sum() <= len(order) / 2 else table.run < first
    suspect = ReferenceSuspect(
        "mixed_units", float(first), float(first), float(first), "run", _channels(table),
        float(np.exp(max(p[best], -700.0))), float("inf"),
        f"compare the serial numbers before and from run {first} on", float("inf"),
    )  # fmt: skip
    note = (
        f"from run {first} on scale factors and misalignments are others: rows of another unit, or this one "
        f"mounted anew; {int(out.sum())} rows are not judged"
    )
    return _Another(~out, suspect, note)


def _of_some_runs(run: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n,) rows of evenly chosen power-ons, about MOST_ROWS: another unit shows in a few of them."""
    every = np.unique(run)
    keep = max(LEAST_OF_MANY, int(len(every) * MOST_ROWS / max(len(run), 1)))
    if keep >= len(every):
        return np.ones(len(run), dtype=bool)
    return np.isin(run, every[np.linspace(0, len(every) - 1, keep).round().astype(int)])


def _inputs(table: DwellTable) -> Sequence[tuple[Array, Array]]:
    found = []
    if table.gyro is not None and table.ref_rate is not None:
        found.append((table.gyro, table.ref_rate))
    if table.acc is not None and table.ref_acc is not None:
        found.append((table.acc, table.ref_acc))
    return found


def _split_p(y: Array, u: Array, t: Array, run: NDArray[np.int64], axis: int) -> Array:
    """(runs − 1,) log p that coefficients before and after each power-on are the same; 0 where none tells.

    Once with leans that stay and once with leans that are free over temperature, the larger of both: what a
    unit does from one temperature to the next, products included, is no other unit, though a campaign take
    its temperatures one after the other; and many columns follow the bends of a curve better in two halves.
    """
    own, weights = u[:, [axis]], hats(t, temperature_nodes(t), 0.0)
    across = np.delete(u, axis, axis=1)
    target = y[:, None] - own
    stays = np.column_stack([across, weights * own, target])
    free = np.column_stack([*(weights * v[:, None] for v in across.T), weights * own, target])
    return np.maximum(_split_of(stays, run), _split_of(free, run))


def _split_of(X: Array, run: NDArray[np.int64]) -> Array:
    """The same for columns X (n, k + 1), the last of which is what the others are to explain."""
    from planner.diagnose.hypotheses.whitened import log_p

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
