"""Rows that a search left out, as findings: which record and channel, how far, what it may have been."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.search.sensor import SensorFound
from planner.nouns.diagnosis import ReferenceSuspect, RowLeftOut
from planner.nouns.sensor import channel_name

SEVERAL = 3  # channels of six, from which a row is off as a whole
MOST_COPIES = 1000  # rows, of which each is said
MOST = 0.5  # share of a power-on's rows, from which it is off as a whole


def left_out(found: Sequence[SensorFound], data: Prepared) -> list[RowLeftOut]:
    """One entry a row and channel, in the order of the rows."""
    table = data.table
    far = {(s.sensor, a): rows for s in found for a, rows in s.far.items()}
    if not any(rows.any() for rows in far.values()):
        return []
    count = np.sum(list(far.values()), axis=0)
    any_far = count > 0
    share = {int(run): _share(any_far[table.run == run]) for run in np.unique(table.run[any_far])}
    sizes = {(s.sensor, a): size for s in found for a, size in s.sizes.items()}
    out = []
    for i in np.flatnonzero(any_far).tolist():
        for key, rows in far.items():
            if rows[i]:
                out.append(
                    RowLeftOut(
                        run=int(table.run[i]),
                        step="" if table.step is None else str(table.step[i]),
                        channel=channel_name(*key),
                        size=float(sizes[key][i]),
                        guess=_guess(int(table.run[i]), int(count[i]), share[int(table.run[i])]),
                        condition=f"{table.temperature_degc[i]:.1f} degC, {table.time_on[i]:.0f} s on",
                    )
                )
    return out


def copies(data: Prepared) -> Iterator[RowLeftOut]:
    """Rows that repeat all readings of another one to the last digit: they count once."""
    table = data.full
    again = np.flatnonzero(np.bincount(data.once, minlength=len(table)) == 0)
    if len(again) > MOST_COPIES or len(data.table) != len(data.once):
        return  # a note says how many they are
    for i in again.tolist():
        run, first = int(table.run[i]), int(table.run[data.once[data.where[i]]])
        guess = f"run {run} repeats a record of run {first} to the last digit: written twice"
        step = "" if table.step is None else str(table.step[i])
        said = f"{table.temperature_degc[i]:.1f} degC, {table.time_on[i]:.0f} s on"
        yield RowLeftOut(run, step, "all", 0.0, guess, said)


def off_as_a_whole(left: Sequence[RowLeftOut]) -> Iterator[ReferenceSuspect]:
    """Power-ons of which most rows were left out: what they say is of no use, and why is to be looked up."""
    for run in dict.fromkeys(r.run for r in left):
        mine = [r for r in left if r.run == run and r.guess.startswith(off(run))]
        if mine:
            check = f"look up the unit's serial number, its mounting and the references of run {run}"
            yield ReferenceSuspect(
                "mixed_units", float(run), float(run), float(run), "run",
                tuple(dict.fromkeys(r.channel for r in mine)), 0.0, max(r.size for r in mine), check,
                float("inf"),
            )  # fmt: skip


def off(run: int) -> str:
    """How what is said of a power-on that is off as a whole begins."""
    return f"run {run} is off as a whole"


def whole_run(run: int, channels: Sequence[str] = (), or_runs: Sequence[int] = ()) -> str:
    """What is said of a power-on that is off as a whole.

    channels: the few on which alone it is, which may as well be the sensor's; or_runs: another one, which may
        be it instead
    """
    instead = "".join(f", or run {other} is" for other in or_runs)
    if not channels:
        return f"{off(run)}{instead}: another mounting, another unit, a shock, or a reference of another run"
    names = " and ".join(c.replace("_", " ") for c in channels)
    return (
        f"run {run} is off on {names} alone{instead}: a sign or an axis lost in its records, a reference "
        "that was another along this axis, or the sensor changed in it; repeating the run would tell"
    )


def _share(far: NDArray[np.bool_]) -> float:
    """Of a power-on's rows; of a single one nothing is said of the power-on."""
    return float(far.mean()) if len(far) > 1 else 0.0


def _guess(run: int, channels: int, share: float) -> str:
    if share > MOST:
        return whole_run(run)
    if channels >= SEVERAL:
        return "all is off in this record: a shock, a hand on the table, or a wrong reference"
    return "a spike of this channel"
