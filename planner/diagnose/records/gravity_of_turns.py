"""Gravity that the references of turns lack, or have upside down: a load entered alone, a sign lost.

    a · (y − u) = k g,   a along the axis of the turn;   k = ±1 where a · u = 0, ∓2 where a · u = ±g

By its size it is no error of a sensor, and it is asked before any error model: one would take it for a step
of the accelerometers' bias between the benches, a thousand sigma strong, or for power-ons that exceed the
budget. The table goes on with gravity put right.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.records.another_unit import channels_of
from planner.effects._bench_frame import turning
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable
from planner.solvers.distributions import TWO_SIDED
from planner.units import STANDARD_GRAVITY_MPS2

NAME = "local_gravity"
NEAR = 0.2  # of g, within which a share of it counts: ten times the bias and the lean of a unit
LEAN = 0.01  # of the load, 0.6 deg, that a unit not yet calibrated lets through along the axis
FOLLOWS = 0.2  # of the rate, within which the gyros confirm the axis of the turn and its sense
SEVERAL = 3  # rows, from which what is off is no single accident
MOST = 0.5  # of a power-on's turns, from which its references are meant and not single rows
BIAS = 0.01  # of g, of a unit before calibration: what the least loads are off by, beside their lean


@dataclass(frozen=True)
class GravityOfTurns:
    """What the references of some rows lack. table: put right; rows: (n,) of them

    share, half: of g, with its 95 % interval; inverted: whether the sign was wrong
    """

    table: DwellTable
    rows: NDArray[np.bool_]
    share: float
    half: float
    inverted: bool

    @property
    def suspect(self) -> ReferenceSuspect:
        """As it is reported."""
        runs = np.unique(self.table.run[self.rows])
        named = ", ".join(map(str, runs[:5].tolist())) + (", …" if len(runs) > 5 else "")
        how = "points down instead of up" if self.inverted else "is missing"
        check = (
            f"look up ref_acc of the turns in run {named}: gravity {how} along the axis of the turn in "
            f"{int(self.rows.sum())} records; they are judged with it put right"
        )
        channels = tuple(c for c in channels_of(self.table) if c.startswith("acc"))
        return ReferenceSuspect(
            NAME, self.share, self.share - self.half, self.share + self.half, "1", channels,
            0.0, float("inf"), check, float("inf"),
        )  # fmt: skip


def gravity_of_turns(table: DwellTable) -> GravityOfTurns | None:
    """The turns whose reference lacks gravity, or has it upside down; None where it is as it should be."""
    if table.acc is None or table.ref_acc is None or table.ref_rate is None:
        return None
    size = np.linalg.norm(table.ref_rate, axis=1, keepdims=True)
    axis = table.ref_rate / np.maximum(size, 1e-300)
    off = (table.acc - table.ref_acc) / STANDARD_GRAVITY_MPS2
    along, told = np.sum(off * axis, axis=1), np.sum(table.ref_acc * axis, axis=1) / STANDARD_GRAVITY_MPS2
    room = NEAR + LEAN * np.linalg.norm(table.ref_acc, axis=1) / STANDARD_GRAVITY_MPS2
    judged = turning(table.conditions()) & np.isfinite(along) & _followed(table)
    judged &= np.linalg.norm(off - along[:, None] * axis, axis=1) < 2.0 * room
    for inverted, lacks in _kinds(along, told, room):
        if np.count_nonzero(judged & lacks) < SEVERAL:
            continue
        rows = _of_whole_runs(judged & lacks, judged, table.run)
        if rows.sum() >= SEVERAL:
            added = (2.0 if inverted else 1.0) * np.sign(along) * rows * _local_gravity(table)
            right = replace(table, ref_acc=table.ref_acc + added[:, None] * axis)
            return GravityOfTurns(right, rows, *_share(np.abs(along), rows, room, table.run), inverted)
    return None


def _share(size: Array, rows: NDArray[np.bool_], room: Array, run: NDArray[np.int64]) -> tuple[float, float]:
    """Mean of g over the rows, those of small loads counting most, and half its interval by power-ons.

    What leans lets a load through in proportion to it, and what bends with it as its square.
    """
    weight = rows / (BIAS**2 + (room - NEAR) ** 2)
    mean = float(weight @ size / weight.sum())
    parts = np.bincount(np.unique(run, return_inverse=True)[1], weight * (size - mean))
    return mean, TWO_SIDED * max(float(np.linalg.norm(parts) / weight.sum()), BIAS / TWO_SIDED)


def _kinds(along: Array, told: Array, room: Array) -> Iterator[tuple[bool, NDArray[np.bool_]]]:
    """Whether gravity is inverted, and the rows (n,) that look so; that it is missing comes first."""
    yield False, np.asarray((np.abs(told) < NEAR) & (np.abs(np.abs(along) - 1.0) < room))
    upside_down = np.abs(told * np.sign(along) + 1.0) < NEAR
    yield True, np.asarray(upside_down & (np.abs(np.abs(along) - 2.0) < room))


def _followed(table: DwellTable) -> NDArray[np.bool_]:
    """(n,) whether the gyros, where there are any, turn as the reference says: else a label is wrong."""
    assert table.ref_rate is not None  # asked by the caller
    if table.gyro is None:
        return np.ones(len(table), dtype=bool)
    off = np.linalg.norm(table.gyro - table.ref_rate, axis=1)
    return np.asarray(off < FOLLOWS * np.linalg.norm(table.ref_rate, axis=1))


def _of_whole_runs(
    rows: NDArray[np.bool_], judged: NDArray[np.bool_], run: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(n,) the rows of power-ons of whose turns most look so."""
    which = np.unique(run, return_inverse=True)[1]
    most = np.bincount(which, rows) > MOST * np.bincount(which, judged)
    return np.asarray(rows & most[which])


def _local_gravity(table: DwellTable) -> float:
    """m/s², what the references of rests say of it; the standard's where there are none."""
    assert table.ref_acc is not None  # asked by the caller
    size = np.linalg.norm(table.ref_acc[~turning(table.conditions())], axis=1)
    near = size[np.abs(size / STANDARD_GRAVITY_MPS2 - 1.0) < NEAR]
    return float(np.median(near)) if len(near) else STANDARD_GRAVITY_MPS2
