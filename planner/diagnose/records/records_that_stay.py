"""Records of one attitude that are off, each by its own amount, and that nobody left out.

A cable that is loose in one attitude, now and then, is off in a few records of it. The search refuses the
attitude as a variable, or finds none, and the noise has taken the records up for what moves within power-ons,
far beyond its budget. Neither is then said, and "nothing is missing" is no answer. It follows the attitude
where the search refused that for a few records, or where the rests of one attitude scatter by far more than
those of all others, about the means of power-ons:

    F = s₁² / s²   of n₁ and n rows,   p < 1e-6 over all attitudes,   s₁ > 3 s

What moves within power-ons moves in any attitude; of records left out as spikes the noise has nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.noise.whitened import Whitened, log_p
from planner.diagnose.records.leans_of_sets import SAME_FACE
from planner.diagnose.references.bench_directions import at_rest
from planner.diagnose.search.sensor import SensorFound
from planner.diagnose.vetoes.verdicts import A_FEW
from planner.dwells.table_rows import alike
from planner.nouns.diagnosed_spreads import Assumption
from planner.nouns.diagnosis import Unknown
from planner.nouns.sensor import channel_name
from planner.units import STANDARD_GRAVITY_MPS2

FAR = 5.0  # budgets, at the low end of the interval
CHANCE = 1e-6  # of as much by the budget
LEAST = 1e-300
ATTITUDE = "orientation"
FARTHER = 3.0  # times the scatter of the other attitudes, that a fit spreads what is off over as well
FEWEST = 4  # degrees of freedom of an attitude
FACES = 4  # attitudes, of which three say what is usual
LEAST_RESTS = 24  # rests, below which a few records are all there is


def records_that_stay(
    found: Sequence[SensorFound],
    every: Sequence[Assumption],
    told: Sequence[str],
    starts: NDArray[np.int64],
) -> Iterator[Unknown]:
    """What records follow on channels whose spread within power-ons has them.

    told: channels of which something is said already; starts: (g,) first rows of power-ons
    """
    far = {
        a.channel: a.chance
        for a in every
        if a.part == "in_run" and a.assumed and a.low > FAR * a.assumed and a.chance < CHANCE
    }
    for s in found:
        blocks = s.found.pool.blocks
        for veto in s.refused:
            block = blocks[veto.block]
            channels = tuple(channel_name(s.sensor, a) for a in sorted(block.columns))
            mine = all(c in far for c in channels) and any(c not in told for c in channels)
            if veto.why == A_FEW and block.generic and mine:
                told = [*told, *channels]
                yield _of(channels, block.name, max(far[c] for c in channels))
        for w in s.found.pool.state.values():
            name = w.channel.name
            if name in far and name not in told and _one_attitude_scatters(w, starts):
                yield _of((name,), ATTITUDE, far[name])


def _of(channels: tuple[str, ...], variable: str, p: float) -> Unknown:
    return Unknown(channels, variable, p, math.sqrt(-2.0 * math.log(max(p, LEAST))))


def _one_attitude_scatters(w: Whitened, starts: NDArray[np.int64]) -> bool:
    """Whether the rests of one attitude scatter by far more than those of all others."""
    here = w.channel.model.conditions
    rest = at_rest(here)
    run = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(w.z))))[rest]
    if np.count_nonzero(rest) < LEAST_RESTS:
        return False
    _, face = alike(np.round(here.specific_force[rest] / (SAME_FACE * STANDARD_GRAVITY_MPS2)))
    left = w.channel.r[rest]
    left = left - (np.bincount(run, left) / np.maximum(np.bincount(run), 1))[run]
    mean = np.bincount(face, left) / np.bincount(face)
    square, rows = np.bincount(face, (left - mean[face]) ** 2), np.bincount(face) - 1.0
    enough = rows >= FEWEST
    if np.count_nonzero(enough) < FACES:
        return False
    k = int(np.argmax(np.where(enough, square / np.maximum(rows, 1.0), -1.0)))
    others, freedom = square[enough].sum() - square[k], rows[enough].sum() - rows[k]
    ratio = square[k] / rows[k] / max(others / freedom, LEAST)
    log = float(log_p(square[k], int(rows[k]), freedom, max(others / freedom, LEAST)))
    return bool(ratio > FARTHER**2 and log + math.log(np.count_nonzero(enough)) < math.log(CHANCE))
