"""Records that are not what the table says: units of measurement, readings, labels, times, whose rows.

All are asked before any error model: they are of the size of the reading, not of its errors.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.records.another_unit import another_unit, channels_of
from planner.diagnose.records.bias_of_temperatures import bias_of_temperatures
from planner.diagnose.records.channel_of_a_run import off_at_rest, with_their_power_ons
from planner.diagnose.records.no_readings import NoReading, off_their_reference, said_of, stuck_readings
from planner.diagnose.records.other_scale import OtherScale, other_scales
from planner.diagnose.records.still_thermometer import still_thermometer
from planner.diagnose.records.times_of_records import OutOfOrder, out_of_order
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect, RowLeftOut
from planner.nouns.dwell_table import DwellTable
from planner.units import STANDARD_GRAVITY_MPS2

FAR_OFF_G = 0.2  # ten times the bias and the lean of a unit before calibration: no error of a sensor
NEARER = 0.3  # of that distance, at which another label explains the reading
SEVERAL = 3  # rows of a power-on, from which what is off is no single accident
LEAST_RATE = float(np.radians(3.0))  # below which a bias may be as large as a rate
FAR_OFF_RATE = 0.2  # share of the rate, as FAR_OFF_G of gravity
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
    """Look at units of measurement, channels that are stuck, labels, readings; then at whose rows these are.

    Raises InputError where every power-on reads in another unit than its heading says.
    """
    scaled = other_scales(table)
    kept = ~np.any([s.rows for s in scaled], axis=0) if scaled else np.ones(len(table), dtype=bool)
    stuck = stuck_readings(table, kept)
    kept &= ~_any(table, stuck)
    level = _without_bias(table)
    turned = _with_their_power_ons(level, {i: turn for i, turn in _turned(level).items() if kept[i]})
    kept[list(turned)] = False
    beside = _beside_swapped(level, turned)
    kept &= ~beside
    off = with_their_power_ons(level, kept, off_their_reference(level, kept))
    kept &= ~_any(table, off)
    off = [*off, *off_at_rest(table, kept)]
    kept &= ~_any(table, off)
    none = (*stuck, *off)
    still = still_thermometer(table)
    kept &= ~np.isin(table.run, still)
    left = (
        *_scaled_out(table, scaled),
        *_rows_out(table, turned),
        *_beside_out(table, beside),
        *_none_out(table, none),
        *_still_out(table, still),
    )
    suspects = [_scale_suspect(table, s) for s in scaled] + (
        [_label_suspect(table, turned)] if turned else []
    )
    suspects += [_none_suspect(table, one) for one in none if one.stuck or _of_a_run(table, one)]
    if still:
        suspects.append(_run_suspect(table, still, "stuck_channel", _still(still)))
    astray = out_of_order(table)
    if astray is not None:
        suspects.append(_run_suspect(table, astray.runs, "wrong_label", _astray(astray)))
    other = another_unit(table, kept)
    notes = []
    if other is not None:
        suspects.append(other.suspect)
        notes.append(other.note)
        kept &= other.kept
    return Screened(kept, left, tuple(suspects), tuple(notes))


def _without_bias(table: DwellTable) -> DwellTable:
    """The table with what its gyros read at each temperature whatever the rate taken off."""
    return table if table.gyro is None else replace(table, gyro=table.gyro - bias_of_temperatures(table))


# ---------------------------------------------------------------- units of measurement


def _scaled_out(table: DwellTable, scaled: Sequence[OtherScale]) -> Iterator[RowLeftOut]:
    for s in scaled:
        for i in np.flatnonzero(s.rows).tolist():
            said = _condition(table, i)
            yield RowLeftOut(s.run, _step(table, i), "all", float("inf"), s.guess, said)


def _scale_suspect(table: DwellTable, s: OtherScale) -> ReferenceSuspect:
    every, run = channels_of(table), float(s.run)
    channels = tuple(c for c in every if c.startswith(s.sensor)) or every
    check = f"look up in which unit of measurement run {s.run} was written; {s.what}"
    return ReferenceSuspect(
        "mixed_units", run, run, run, "run", channels, 0.0, float("inf"),
        check, float("inf"),
    )  # fmt: skip


# ---------------------------------------------------------------- days, times and temperatures


def _still(runs: Sequence[int]) -> str:
    if len(runs) == 1:
        where = f"run {runs[0]}: it reads one value in all of it; its rows are"
    else:
        where = f"runs {runs[0]} to {runs[-1]}: it reads one value in all of them; their rows are"
    return f"look at the thermometer of {where} left out"


def _still_out(table: DwellTable, runs: Sequence[int]) -> Iterator[RowLeftOut]:
    for i in np.flatnonzero(np.isin(table.run, runs)).tolist():
        said = f"run {int(table.run[i])}: the temperature stands still, to the last digit"
        yield RowLeftOut(int(table.run[i]), _step(table, i), "all", float("inf"), said, _condition(table, i))


def _astray(one: OutOfOrder) -> str:
    runs = " and ".join(map(str, one.runs))
    return (
        f"look up the {one.what} of run {runs}: the others are numbered in the order in which they were "
        "switched on; what changes with it rests on them"
    )


def _run_suspect(table: DwellTable, runs: Sequence[int], hypothesis: str, check: str) -> ReferenceSuspect:
    first, every = float(runs[0]), channels_of(table)
    return ReferenceSuspect(
        hypothesis, first, first, first, "run", every, 0.0, float("inf"), check, float("inf")
    )


# ---------------------------------------------------------------- no readings


def _any(table: DwellTable, found: Sequence[NoReading]) -> NDArray[np.bool_]:
    return np.asarray(np.any([np.zeros(len(table), dtype=bool), *(one.rows for one in found)], axis=0))


def _none_out(table: DwellTable, found: Sequence[NoReading]) -> Iterator[RowLeftOut]:
    for one in found:
        for i in np.flatnonzero(one.rows).tolist():
            said = said_of(table, one, i)
            yield RowLeftOut(
                int(table.run[i]), _step(table, i), one.channel, float("inf"), said, _condition(table, i)
            )


def _of_a_run(table: DwellTable, one: NoReading) -> bool:
    """Whether some power-on has several such rows, or none else: one row by itself is an accident."""
    runs, count = np.unique(table.run[one.rows], return_counts=True)
    every = np.array([np.count_nonzero(table.run == run) for run in runs])
    return bool(np.any((count >= SEVERAL) | (count > every / 2)))


def _none_suspect(table: DwellTable, one: NoReading) -> ReferenceSuspect:
    count = float(one.rows.sum())
    runs = ", ".join(map(str, sorted({int(r) for r in table.run[one.rows]})[:5]))
    check = f"look at the recording of {one.channel.replace('_', ' ')} in run {runs}; these rows are left out"
    return ReferenceSuspect(
        "stuck_channel" if one.stuck else "wrong_record", count, count, count, "rows", (one.channel,), 0.0,
        float("inf"), check, float("inf"),
    )  # fmt: skip


# ---------------------------------------------------------------- labels


def _turned(table: DwellTable) -> dict[int, Array]:
    """row -> the signed permutation of the axes under which the reading would be that of its label.

    A row that is off as all rows are is off by the unit's bias: 0.24 g of a cheap one in every attitude, of
    which another label would have taken a part (22 good rows of 672).
    """
    found: dict[int, Array] = {}
    for y, u, least, far in _judged(table):
        size = np.linalg.norm(u, axis=1)
        scale = np.maximum(size, least)
        off = np.linalg.norm(y - u, axis=1) / scale
        common = np.median(y - u, axis=0)
        alone = np.linalg.norm(y - u - np.where(np.abs(common) < least, common, 0.0), axis=1) / scale
        for i in np.flatnonzero((size >= least) & (off > far) & (alone > far)).tolist():
            if i in found:
                continue
            best = min(_TURNS, key=lambda turn: float(np.linalg.norm(y[i] - turn @ u[i])))
            if np.linalg.norm(y[i] - best @ u[i]) / scale[i] < NEARER * off[i]:
                found[i] = best
    return found


def _with_their_power_ons(table: DwellTable, turned: dict[int, Array]) -> dict[int, Array]:
    """The same with the rows of a unit upside down that read as if upright: those along the turn's axis.

    Where one turn explains every turned row of a power-on, and no other row of it speaks against that. Such a
    row is small there only: its leans are those of the other side. So are those of a sensor of which two
    channels were swapped or one lost its sign: in the faces of the third axis their biases are the other's.
    """
    found = dict(turned)
    for run in sorted({int(table.run[i]) for i in turned}):
        rows = np.flatnonzero(table.run == run)
        mine = [i for i in rows.tolist() if i in turned]
        if SEVERAL <= len(mine) < len(rows):
            stands = next((t for t in _TURNS if _stood_so(table, t, rows, mine)), None)
            found |= {} if stands is None else dict.fromkeys(set(rows.tolist()) - set(mine), stands)
    return found


def _stood_so(table: DwellTable, turn: Array, rows: NDArray[np.int64], turned: Sequence[int]) -> bool:
    """Whether a turn of the unit explains all its sensors read, or two swapped channels all that one does."""
    each = [(_explains(one, turn, rows, turned), one) for one in _judged(table)]
    if np.linalg.det(turn) > 0.0:
        return all(explains for explains, _ in each)
    mine = list(turned)
    moves = (bool(np.any(_moves(one, turn)[mine])) for _, one in each)
    return _of_channels(turn) and any(e and m for (e, _), m in zip(each, moves, strict=True))


def _moves(judged: tuple[Array, Array, float, float], turn: Array) -> NDArray[np.bool_]:
    """(n,) rows whose reference another one is by a turn."""
    _, u, least, far = judged
    return np.asarray(
        np.linalg.norm(u @ turn.T - u, axis=1) > far * np.maximum(np.linalg.norm(u, axis=1), least)
    )


def _beside_swapped(table: DwellTable, turned: dict[int, Array]) -> NDArray[np.bool_]:
    """(n,) rows of power-ons that cannot tell whether channels are swapped in them, beside some that are.

    Two channels of a sensor that are swapped in several power-ons, by one harness or one file, are so in
    those between them too: rests do not turn. Only between two that tell is one as it should be.
    """
    out = np.zeros(len(table), dtype=bool)
    runs = np.unique(table.run)
    for judged in _judged(table):
        y, u, least, far = judged
        size = np.linalg.norm(u, axis=1)
        off = np.linalg.norm(y - u, axis=1) > far * np.maximum(size, least)
        mine = {i: turn for i, turn in turned.items() if off[i] and _of_channels(turn)}
        for turn in np.unique(list(mine.values()), axis=0) if mine else ():
            same = [i for i, t in turned.items() if np.array_equal(t, turn)]
            rows = np.isin(np.arange(len(table)), same)
            whole = runs[[bool(rows[table.run == run].all()) for run in runs]]
            swapped = np.intersect1d(whole, table.run[list(mine)])
            tells = np.isin(runs, table.run[_moves(judged, turn) & (size >= least)])
            if len(swapped) >= SEVERAL:
                out |= np.isin(table.run, runs[_nearest_is(np.isin(runs, swapped), tells)])
    out[list(turned)] = False
    return out


def _nearest_is(swapped: NDArray[np.bool_], tells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(g,) power-ons that do not tell, before or behind which the nearest that tells is swapped."""
    order = np.arange(len(tells))
    before = np.maximum.accumulate(np.where(tells, order, -1))
    behind = np.minimum.accumulate(np.where(tells, order, len(order))[::-1])[::-1]
    known = np.append(swapped, False)  # −1 and g: none
    return np.asarray(~tells & (known[before] | known[behind]))


def _beside_out(table: DwellTable, rows: NDArray[np.bool_]) -> Iterator[RowLeftOut]:
    for i in np.flatnonzero(rows).tolist():
        said = f"run {int(table.run[i])} is beside power-ons with swapped channels, and does not tell"
        yield RowLeftOut(int(table.run[i]), _step(table, i), "all", float("inf"), said, _condition(table, i))


def _of_channels(turn: Array) -> bool:
    """Whether it swaps two channels, or takes a sign from one: a unit is not mirrored."""
    return bool(np.linalg.det(turn) < 0.0 and np.array_equal(turn, turn.T) and np.trace(turn) == 1.0)


def _explains(
    judged: tuple[Array, Array, float, float], turn: Array, rows: NDArray[np.int64], turned: Sequence[int]
) -> bool:
    """Whether a turn makes a reading that of its label in turned rows, and is nothing in others."""
    y, u, least, far = judged
    scale = np.maximum(np.linalg.norm(u, axis=1), least)
    moves = _moves(judged, turn)[rows]
    off = np.linalg.norm(y[rows] - u[rows] @ turn.T, axis=1) > far * scale[rows]
    among = np.isin(rows, turned)
    return not (np.any(moves & ~among) or np.any(off & among))


def _judged(table: DwellTable) -> Iterator[tuple[Array, Array, float, float]]:
    """Reading and reference of each sensor that has both, the least input that tells, and what is far off."""
    if table.acc is not None and table.ref_acc is not None:
        yield table.acc, table.ref_acc, 0.5 * STANDARD_GRAVITY_MPS2, FAR_OFF_G
    if table.gyro is not None and table.ref_rate is not None:
        yield table.gyro, table.ref_rate, LEAST_RATE, FAR_OFF_RATE


def _rows_out(table: DwellTable, turned: dict[int, Array]) -> Iterator[RowLeftOut]:
    for i, turn in sorted(turned.items()):
        said = _guess(table, i, turn)
        yield RowLeftOut(int(table.run[i]), _step(table, i), "all", float("inf"), said, _condition(table, i))


def _guess(table: DwellTable, i: int, turn: Array) -> str:
    u = table.ref_acc[i] if table.ref_acc is not None else np.zeros(3)
    if not np.any(u):
        return f"run {int(table.run[i])}: the reading looks like another axis or direction of the turn"
    if _face(u) == _face(turn @ u):
        return f"run {int(table.run[i])} looks as if the unit stood turned over about {_face(u)}"
    return f"run {int(table.run[i])} looks as if face {_face(u)} were {_face(turn @ u)}"


def _face(u: Array) -> str:
    axis = int(np.argmax(np.abs(u)))
    return f"{'+' if u[axis] > 0 else '−'}{AXES[axis]}"


def _step(table: DwellTable, i: int) -> str:
    return "" if table.step is None else str(table.step[i])


def _condition(table: DwellTable, i: int) -> str:
    return f"{table.temperature_degc[i]:.1f} degC, {table.time_on[i]:.0f} s since power-on"


def _label_suspect(table: DwellTable, turned: dict[int, Array]) -> ReferenceSuspect:
    runs = sorted({int(table.run[i]) for i in turned})
    count = float(len(turned))
    where = ", ".join(map(str, runs[:5]))
    return ReferenceSuspect(
        "wrong_label", count, count, count, "rows", channels_of(table), 0.0, float("inf"),
        f"look up the faces of run {where} in the bench's log; they are left out until then", float("inf"),
    )  # fmt: skip
