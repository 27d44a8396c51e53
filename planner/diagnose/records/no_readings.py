"""Channels that do not follow their reference: stuck, at the end of their range, signs or digits lost.

Like the labels of `records` they are asked before any error model: what is off by a fifth of its input is no
error of a sensor, and a noise model that must hold it takes the unit for one that exceeds its budgets.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.nouns.sensor import channel_name
from planner.protocols import Sensor
from planner.units import STANDARD_GRAVITY_MPS2

FAR_OFF = 0.2  # of the input, as for a label: ten times what a unit is off by before calibration
LEAST_RATE = float(np.radians(3.0))  # below which a bias may be as large as a rate
LEAST_FORCE = 0.5 * STANDARD_GRAVITY_MPS2
LEVER_ARM_M = 0.5  # about the widest table: so far off the axis an accelerometer may feel its turns
REPEATS = 3  # readings of one value to the last digit: two may be alike by rounding
UNROUNDED = 0.9  # share of different values among the other rows: a resolution that repeats none by chance
CHANCE = 0.01  # of a table, that a repeated value is no more than rounding
SAME = 1e-6  # of the channel's range, to which references are one input
MOVES = 0.02  # of the channel's range, by which their references differ: no table is off by so much
ALIKE = 0.5  # share of a condition's rows in two power-ons or more: a range that ends is no accident
MOST = 0.5  # share of the judged rows: where more are off, the reference is no measure of the channel
FIT_ROWS = 20_000  # of which a line is asked
FIT_STEPS = 20  # of reweighting: each halves what rows far off still weigh, to 1e-6
KNOWN = 1e-4  # of the input, that no line leaves: noise and curves over temperature are larger
HINT = 0.03  # of the reading, to which a lost sign or digit explains it: bias and lean beside


@dataclass(frozen=True)
class NoReading:
    """Rows of one channel that say nothing of it. rows: (n,); stuck: one value to the last digit"""

    sensor: Sensor
    axis: int
    rows: NDArray[np.bool_]
    stuck: bool

    @property
    def channel(self) -> str:
        """`gyro_x` … `accelerometer_z`."""
        return channel_name(self.sensor, self.axis)


def stuck_readings(table: DwellTable, kept: NDArray[np.bool_]) -> list[NoReading]:
    """Rows whose channel repeats one value to the last digit while its reference moves.

    Readings of fine resolution repeat none at all, whatever the reference does; of noise that is a few times
    the last digit three records of one condition are alike now and then (`_by_rounding`, `_at_one_input`).
    The rows are either records after one another, or those at the channel's greatest or least reading,
    wherever they stand; or one at the greatest and one at the least, of one size to the last digit and both
    short (`_both_ends`).
    """
    found = []
    for sensor, axis, y, u, _, least in _channels(table):
        order = np.lexsort((table.time_on, table.run))
        order = order[kept[order] & np.isfinite(y[order])]
        apart = np.maximum(MOVES * np.ptp(u[order, axis]), FAR_OFF * least) if len(order) else np.inf
        rows = np.zeros(len(table), dtype=bool)
        stretches = [g for g in _stretches(y, order) if len(g) >= REPEATS]
        ends = [g for g in _ends(y, order) if len(g) >= REPEATS]
        groups = [*stretches, *ends]
        both = _both_ends(y, u[:, axis], order)
        rows[both] = True
        if not groups and not len(both):
            continue
        alive = len(order) - sum(map(len, groups))
        to_the_digit = len(np.unique(y[order])) > UNROUNDED * alive
        still = np.abs(np.diff(u[order, axis])) <= apart
        fresh = ~np.isin(order, np.concatenate([np.empty(0, dtype=np.int64), *groups]))
        for group in groups:
            if np.ptp(u[group, axis]) > apart:
                rows[group] = True
        for group in stretches if to_the_digit else ():
            if _by_rounding(y[order], still, fresh, len(group)) <= CHANCE:
                rows[group] = True
        for group in ends if to_the_digit else ():
            if _at_one_input(y, u[:, axis], order, group) <= CHANCE:
                rows[group] = True
        if 0 < rows.sum() <= MOST * len(order):  # a channel that is dead throughout has no rows to spare
            found.append(NoReading(sensor, axis, rows, True))
    return found


def off_their_reference(table: DwellTable, kept: NDArray[np.bool_]) -> list[NoReading]:
    """Rows further from their reference than any error of a sensor, in conditions where others are not."""
    found = []
    for sensor, axis, y, u, size, least in _channels(table):
        judged = kept & (size >= least) & np.isfinite(y)
        if judged.sum() < REPEATS:
            continue
        most = FAR_OFF * np.maximum(size, least) + _of_a_lever_arm(table, sensor)
        line = _line(y[judged], u[judged], most[judged] / FAR_OFF)
        off = np.abs(y - np.column_stack([u, np.ones(len(u))]) @ line)
        far = judged & (off > most)
        if not far.any() or far.sum() > MOST * judged.sum():
            continue
        far &= ~_alike(far, judged, _levels(table, sensor), table.run)
        if far.any():
            found.append(NoReading(sensor, axis, far, False))
    return found


def said_of(table: DwellTable, one: NoReading, i: int) -> str:
    """What a row's reading looks like, in words."""
    y, u, unit = _display(table, one)
    name = f"run {int(table.run[i])}: {one.channel.replace('_', ' ')}"
    if one.stuck:
        return f"{name} reads {y[i]:.5g} {unit} whatever its reference: stuck, or at the end of its range"
    return f"{name} reads {y[i]:.4g} where its reference says {u[i]:.4g} {unit}{_hint(y[i], u[i])}"


def _hint(y: float, u: float) -> str:
    """What would make the reading of its reference, in words."""
    if u != 0.0 and abs(y / u + 1.0) < HINT:
        return ", as if its sign were lost"
    power = np.log10(abs(y / u)) if y != 0.0 and u != 0.0 else 0.0
    if round(power) != 0 and abs(10.0 ** (power - round(power)) - 1.0) < HINT:
        return ", as if a digit were lost or doubled"
    return ""


# ---------------------------------------------------------------- channels


def _channels(table: DwellTable) -> Iterator[tuple[Sensor, int, Array, Array, Array, float]]:
    """Sensor, axis, reading (n,), reference (n, 3), its size (n,) and the least of it that tells."""
    if table.gyro is not None and table.ref_rate is not None:
        size = np.linalg.norm(table.ref_rate, axis=1)
        for axis in range(3):
            yield "gyro", axis, table.gyro[:, axis], table.ref_rate, size, LEAST_RATE
    if table.acc is not None and table.ref_acc is not None:
        size = np.linalg.norm(table.ref_acc, axis=1)
        for axis in range(3):
            yield "accelerometer", axis, table.acc[:, axis], table.ref_acc, size, LEAST_FORCE


def _display(table: DwellTable, one: NoReading) -> tuple[Array, Array, str]:
    """Reading and reference (n,) of the channel, and their unit, to be read by people."""
    per, unit = (float(np.radians(1.0)), "deg/s") if one.sensor == "gyro" else (STANDARD_GRAVITY_MPS2, "g")
    mine = (c for c in _channels(table) if c[:2] == (one.sensor, one.axis))
    _, axis, y, u, *_ = next(mine)
    return y / per, u[:, axis] / per, unit


def _of_a_lever_arm(table: DwellTable, sensor: Sensor) -> Array | float:
    if sensor == "gyro" or table.ref_rate is None:
        return 0.0
    return np.asarray(LEVER_ARM_M * np.sum(table.ref_rate**2, axis=1))


# ---------------------------------------------------------------- values that repeat


def _stretches(y: Array, order: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    """Rows after one another with the same reading."""
    if len(order) < REPEATS:
        return
    cuts = np.flatnonzero(np.diff(y[order]) != 0.0) + 1
    ends = np.concatenate([[0], cuts, [len(order)]])
    for k in np.flatnonzero(np.diff(ends) >= REPEATS):
        yield order[ends[k] : ends[k + 1]]


def _by_rounding(y: Array, still: NDArray[np.bool_], fresh: NDArray[np.bool_], length: int) -> float:
    """How many stretches of a length rounding makes of records after one another in one condition.

        N p^(length − 1),   p = (pairs that are alike + 1) / (N + 2)

    N pairs of neighbours that are fresh (n,), in no stretch in question, and of which the reference is still
    (n − 1,), p by Laplace's rule of succession: few pairs say little. Ninety in steps of 1e-5 g with noise of
    4e-5 g make a triple in every second campaign.
    """
    pairs = fresh[1:] & fresh[:-1] & still
    n, alike = int(pairs.sum()), int(np.sum(pairs & (np.diff(y) == 0.0)))
    return float(max(n, 1) * ((alike + 1.0) / (n + 2.0)) ** (length - 1))


def _at_one_input(y: Array, u: Array, order: NDArray[np.int64], group: NDArray[np.int64]) -> float:
    """How many groups as large as one at the end of the readings rounding makes of the rows of its inputs.

        n! / (m! (n − m)!) p^(m − 1),   p = (pairs that are alike + 1) / (N + 2)

    m rows alike of the n that have the inputs (n,) of the group; N pairs of other rows, wherever they stand,
    of one input each. The greatest of all readings is the face's that has the greatest input, and is alike
    there as often as anywhere.
    """
    from scipy.special import betaln

    at = np.unique(np.round(u[order] / max(SAME * float(np.ptp(u[order])), 1e-300)), return_inverse=True)[1]
    mine = np.isin(order, group)
    others = at[~mine]
    pairs = _pairs(np.bincount(others))
    alike = _pairs(np.unique(np.column_stack([others, y[order[~mine]]]), axis=0, return_counts=True)[1])
    n, m = int(np.isin(at, at[mine]).sum()), len(group)
    ways = -np.log(n + 1.0) - betaln(n - m + 1.0, m + 1.0)  # log of n! / (m! (n − m)!)
    return float(np.exp(min(ways + (m - 1) * np.log((alike + 1.0) / (pairs + 2.0)), 0.0)))


def _pairs(counts: NDArray[np.int64]) -> float:
    return float(np.sum(counts * (counts - 1.0)) / 2.0)


def _ends(y: Array, order: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    """Rows at the channel's greatest and at its least reading."""
    if len(order):
        yield order[y[order] == y[order].max()]
        yield order[y[order] == y[order].min()]


def _both_ends(y: Array, u: Array, order: NDArray[np.int64]) -> NDArray[np.int64]:
    """Rows at a greatest and a least reading of one size, both short of their references (n,): a range.

    Two readings of one turn either way are alike to a bias and an asymmetry, not to the last digit.
    """
    ends = order[np.abs(y[order]) == np.abs(y[order]).max(initial=0.0)]
    short = np.abs(y[ends]) < (1.0 - MOVES) * np.abs(u[ends])
    either = np.any(y[ends] > 0.0) and np.any(y[ends] < 0.0)
    found: NDArray[np.int64] = ends if either and np.all(short & (y[ends] * u[ends] > 0.0)) else ends[:0]
    return found


# ---------------------------------------------------------------- rows far from a line


def _line(y: Array, u: Array, size: Array) -> Array:
    """(4,) y ≈ m·u + b by least moduli of (y − m·u − b)/size, reweighted: half of the rows may be anything.

    size: (n,) that of which a share may be amiss: turns by which an accelerometer off the axis feels 0.3 g
    must not tell what rests read
    """
    step = -(-len(y) // FIT_ROWS)
    X, y, size = np.column_stack([u, np.ones(len(u))])[::step], y[::step], size[::step]
    X, y = X / size[:, None], y / size
    w: Array = np.ones(len(y))
    line: Array = np.zeros(4)
    for _ in range(FIT_STEPS):
        line = np.asarray(np.linalg.lstsq(X * w[:, None], y * w, rcond=1e-9)[0], dtype=float)
        w = np.asarray(1.0 / np.sqrt(np.maximum(np.abs(y - X @ line), KNOWN)), dtype=float)
    return line


def _levels(table: DwellTable, sensor: Sensor) -> Array:
    """(n, k) levels of what drives a sensor, to a tenth: turns too, which an arm makes a force."""
    driven = [] if table.ref_rate is None else [table.ref_rate / LEAST_RATE]
    if sensor == "accelerometer" and table.ref_acc is not None:
        driven.append(table.ref_acc / LEAST_FORCE)
    return np.column_stack([np.sign(u) * np.round(np.log1p(np.abs(u)) / 0.1) for u in driven])


def _alike(
    far: NDArray[np.bool_], judged: NDArray[np.bool_], levels: Array, run: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(n,) far rows of an input at which most are far, in more than one power-on: a shape, no accident."""
    cell = np.unique(levels, axis=0, return_inverse=True)[1].ravel()
    count, bad = np.bincount(cell, judged), np.bincount(cell, far)
    pairs = np.unique(np.column_stack([cell[far], run[far]]), axis=0)
    runs = np.bincount(pairs[:, 0], minlength=len(count))
    return np.asarray(far & ((bad >= ALIKE * count) & (runs > 1))[cell])
