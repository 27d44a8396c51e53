"""Rows that a search left out, as findings: which record and channel, how far, what it may have been."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from planner.diagnose.hypotheses.prepared import Prepared
from planner.diagnose.hypotheses.sensor import SensorFound
from planner.measurement import AXES
from planner.nouns.diagnosis import ReferenceSuspect, RowLeftOut

SEVERAL = 3  # channels of six, from which a row is off as a whole
MOST = 0.5  # share of a power-on's rows, from which it is off as a whole


def left_out(found: Sequence[SensorFound], data: Prepared) -> list[RowLeftOut]:
    """One entry a row and channel, in the order of the rows."""
    table = data.table
    far = {(s.sensor, a): rows for s in found for a, rows in s.far.items()}
    if not any(rows.any() for rows in far.values()):
        return []
    count = np.sum(list(far.values()), axis=0)
    any_far = count > 0
    share = {int(run): float(any_far[table.run == run].mean()) for run in np.unique(table.run[any_far])}
    sizes = {(s.sensor, a): size for s in found for a, size in s.sizes.items()}
    out = []
    for i in np.flatnonzero(any_far).tolist():
        for key, rows in far.items():
            if rows[i]:
                out.append(
                    RowLeftOut(
                        run=int(table.run[i]),
                        step="" if table.step is None else str(table.step[i]),
                        channel=f"{key[0]}_{AXES[key[1]]}",
                        size=float(sizes[key][i]),
                        guess=_guess(int(table.run[i]), int(count[i]), share[int(table.run[i])]),
                        condition=f"{table.temperature_degc[i]:.1f} degC, {table.time_on[i]:.0f} s on",
                    )
                )
    return out


def off_as_a_whole(left: Sequence[RowLeftOut]) -> Iterator[ReferenceSuspect]:
    """Power-ons of which most rows were left out: what they say is of no use, and why is to be looked up."""
    runs = {r.run: whole_run(r.run) for r in left}
    for run, said in runs.items():
        mine = [r for r in left if r.run == run and r.guess == said]
        if mine:
            check = f"look up the unit's serial number, its mounting and the references of run {run}"
            yield ReferenceSuspect(
                "mixed_units", float(run), float(run), float(run), "run",
                tuple(dict.fromkeys(r.channel for r in mine)), 0.0, max(r.size for r in mine), check,
                float("inf"),
            )  # fmt: skip


def whole_run(run: int) -> str:
    """What is said of a power-on that is off as a whole."""
    return f"run {run} is off as a whole: another mounting, another unit, or a reference of another run"


def _guess(run: int, channels: int, share: float) -> str:
    if share > MOST:
        return whole_run(run)
    if channels >= SEVERAL:
        return "all is off in this record: a shock, a hand on the table, or a wrong reference"
    return "a spike of this channel"
