"""Which rows are held out together: whole power-ons, or, where there are too few, branches or blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.dwells.table_rows import alike
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions, asked_once
from planner.nouns.diagnosis import Split
from planner.temperature_table import temperature_nodes
from planner.units import STANDARD_GRAVITY_MPS2

FOLDS = 5  # as in vetoes.verdicts
LEAST_RUNS = 4  # with a repeat: fewer cannot be left out and still be predicted
BLOCKS = 20  # of time, four a fold: each fold is spread over the whole record
TURN_K = 8.0  # kelvins that a temperature must come back before a branch ends


@dataclass(frozen=True)
class Folds:
    """fold: (n,) of every row, −1 for a row that stays in every fit; group: (n,) what a row belongs to.

    split: whether whole power-ons, branches of the temperature or blocks of time are held out; how: in words
    """

    fold: NDArray[np.int64]
    group: NDArray[np.int64]
    split: Split
    how: str


def folds_of(conditions: Conditions, starts: NDArray[np.int64]) -> Folds:
    """Folds for rows that stand run by run from `starts`.

    Whole power-ons with a repeat (same temperature, motion and load in another one) where there are such;
    else the branches of a temperature that goes up and down; else blocks of time.
    """
    n = len(conditions.day)
    run = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, n)))
    of_run = _folds_of_runs(cells_of(conditions), starts, run)
    if (of_run >= 0).sum() >= LEAST_RUNS:
        alone = int((of_run < 0).sum())
        what = "power-on" if alone == 1 else "power-ons"
        stay = f"; {alone} {what} without a repeat in every fit" if alone else ""
        count = int(of_run.max()) + 1
        return Folds(of_run[run], run, "runs", f"{count} folds of whole power-ons held out{stay}")
    branch = branches(conditions.temperature_degc)
    if branch.max(initial=0) > 0:
        how = (
            f"too few power-ons to hold any out: {branch.max() + 1} branches of the temperature instead, "
            "each predicted from the others"
        )
        return Folds(branch, _pieces(branch, run), "branches", how)
    return block_folds(n, starts, "too few power-ons to hold any out")


def block_folds(rows: int, starts: NDArray[np.int64], why: str) -> Folds:
    """Folds of blocks of time; why: what keeps whole power-ons or branches from being held out."""
    blocks = np.minimum(np.arange(rows) * BLOCKS // max(rows, 1), BLOCKS - 1)
    run = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, rows)))
    how = (
        f"{why}: {FOLDS} folds of blocks of time instead, whose neighbours are in the fit, so these figures "
        "flatter"
    )
    return Folds(blocks % FOLDS, _pieces(blocks, run), "blocks", how)


def _pieces(part: NDArray[np.int64], run: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) number of the piece of one power-on that lies in one part: every power-on has its own level."""
    both = np.column_stack([part, run])
    return np.asarray(np.unique(both, axis=0, return_inverse=True)[1].ravel())


@asked_once
def cells_of(conditions: Conditions) -> NDArray[np.int64]:
    """(n,) number of the condition of every row: rows of one number were made to be alike.

    Temperature point, its rate (K/min), rate and load of each axis to about five per cent.
    """
    nodes = temperature_nodes(conditions.temperature_degc)
    at = np.argmin(np.abs(conditions.temperature_degc[:, None] - nodes[None, :]), axis=1)
    columns = [
        at[:, None],
        np.round(conditions.temperature_rate * 60.0)[:, None],
        _levels(np.degrees(conditions.rate), 0.5),
        _levels(conditions.specific_force / STANDARD_GRAVITY_MPS2, 0.05),
    ]
    return alike(np.concatenate(columns, axis=1))[1]


def _levels(x: Array, least: float) -> Array:
    """Signed logarithmic levels; below `least` all is one."""
    return np.sign(x) * np.round(np.log1p(np.abs(x) / least) / 0.1) * (np.abs(x) > least)


def _folds_of_runs(
    cell: NDArray[np.int64], starts: NDArray[np.int64], run: NDArray[np.int64]
) -> NDArray[np.int64]:
    """(g,) fold of every run, −1 where no other run has its conditions.

    Every condition begins at another fold, so that what came late in the campaign is in every fold.
    """
    keys = [tuple(sorted(set(rows.tolist()))) for rows in np.split(cell, starts[1:])]
    number = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    count = np.bincount([number[key] for key in keys])
    folds = int(min(FOLDS, count.max(initial=0)))
    seen = np.zeros(len(number), dtype=np.int64)
    out = np.full(len(keys), -1, dtype=np.int64)
    for i, key in enumerate(keys):
        k = number[key]
        if count[k] > 1:
            out[i] = (seen[k] + k) % folds
            seen[k] += 1
    return out


def branches(temperature_degc: Array) -> NDArray[np.int64]:
    """(n,) number of the branch: between two turns of the temperature; all 0 when it never turns."""
    out = np.zeros(len(temperature_degc), dtype=np.int64)
    if len(temperature_degc) < 20:
        return out
    turns, direction = [0], 0.0
    extreme, at = temperature_degc[0], 0
    for i, t in enumerate(temperature_degc):
        if direction == 0.0 and abs(t - extreme) > TURN_K:
            direction, extreme, at = float(np.sign(t - extreme)), t, i
        elif direction != 0.0 and (t - extreme) * direction >= 0:
            extreme, at = t, i
        elif direction != 0.0 and (extreme - t) * direction > TURN_K:
            turns.append(at)
            direction, extreme, at = -direction, t, i
    for k, first in enumerate(turns):
        out[first:] = k
    return out
