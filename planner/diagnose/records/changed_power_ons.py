"""Of which power-ons a reference may be another one: from one on, those of a day, a few in turn, one alone.

A unit that is taken off a bench and put back stands otherwise from that power-on on. One that was set up for
a day, on another fixture or by another hand, stands otherwise in the power-ons of that day, and those before
and after it agree: from any power-on on, a part of what was wrong is then said, at a wrong size. So do those
about one that was put back before the day was over. One power-on that is off by itself is a part of all that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array

SIDE = 2  # power-ons on either side, of six or more: one that is off has a name of its own
LEAST_RUNS = 3  # power-ons: of two either is otherwise than the other
AS_MUCH = 1e-3  # of the most that is explained, which columns that are linear in a change miss of it
CHI2_95 = 3.84  # of one degree of freedom, by which one set is better than another by chance

LONGEST = 8  # power-ons in turn, that are neither a day's nor all behind one
Span = Literal["throughout", "on", "day", "while", "alone", "drift"]
ORDER: tuple[Span, ...] = ("on", "day", "while", "alone")


def sets_of(day: Array, first_day: bool) -> tuple[NDArray[np.bool_], list[Span]]:
    """(w, g) power-ons that may have another reference, first all of them; how each set is to be said.

    day: (g,) of the power-ons, in their order; first_day: whether the first one is asked too. Of what the
    declared model takes up where all have it, as leans do a mounting, it is the question of those behind it
    """
    g, whole, begin = len(day), np.floor(day), 0 if first_day else 1
    side = min(SIDE, g // LEAST_RUNS)
    days = np.unique(whole)[begin:, None] == whole
    held = np.count_nonzero(days, axis=1)
    ends = {first: min(first + LONGEST, g - side) for first in range(begin, g)}
    sets: dict[Span, NDArray[np.bool_]] = {
        "throughout": np.ones((1, g), dtype=bool),
        "on": _in_turn([(k, g) for k in range(side, g - side + 1)], g),
        "day": days[(held >= SIDE) & (held <= g - side)],
        "while": _in_turn([(k, end) for k in ends for end in range(k + SIDE, ends[k] + 1)], g),
        "alone": np.eye(g, dtype=bool),
    }
    return np.concatenate([*sets.values()]), [span for span, some in sets.items() for _ in some]


def _in_turn(ends: Sequence[tuple[int, int]], g: int) -> NDArray[np.bool_]:
    """(w, g) power-ons from each first one to before each last."""
    first, last = np.array(ends, dtype=np.int64).reshape(-1, 2).T[:, :, None]
    return np.asarray((np.arange(g) >= first) & (np.arange(g) < last))


def sums_over(sets: NDArray[np.bool_]) -> Callable[[Array], Array]:
    """(g, …) what each power-on says -> (w, …) its sums over sets of them, (w, g), which are looked at once.

    Of power-ons that follow each other a sum is a difference of two.
    """
    first, count = np.argmax(sets, axis=1), np.count_nonzero(sets, axis=1)
    behind = sets.shape[1] - np.argmax(sets[:, ::-1], axis=1)
    apart = np.flatnonzero((count != behind - first) & (count > 0))
    others = sets[apart].astype(float)

    def sums(each: Array) -> Array:
        before = np.concatenate([np.zeros((1, *each.shape[1:])), np.cumsum(each, axis=0)])
        found = np.asarray(before[first + count] - before[first])
        found[apart] = np.tensordot(others, each, axes=1)
        return found

    return sums


def most(delta: Array, spans: Sequence[Span]) -> int:
    """The set but the first that explains most (w,): from one power-on on, unless another does better."""
    which = np.array(spans)
    least = float(delta[1:].max()) * (1.0 - AS_MUCH) - CHI2_95
    best = [int(np.argmax(np.where(which == one, delta, -np.inf))) for one in ORDER if one in spans]
    return next(k for k in best if delta[k] >= least)


def said(span: Span, runs: NDArray[np.int64]) -> dict[str, str]:
    """How a set of power-ons is named: `when` in a sentence; `before` which and `there`, of a mounting."""
    first, last = int(runs[0]), int(runs[-1])
    if span == "alone":
        return {"when": f"in run {first} alone", "before": f"before run {first}", "there": "in that one"}
    if span == "day":
        which = f"runs {first} to {last}, those of one day"
        return {"when": f"in {which},", "before": f"for {which}", "there": "in these"}
    if span == "drift":
        grows = f"from run {first} to {last}, growing from day to day,"
        return {"when": grows, "before": grows, "there": "at last "}
    if span == "while":
        return {
            "when": f"in runs {first} to {last}",
            "before": f"for runs {first} to {last}",
            "there": "in these",
        }
    return {"when": f"from run {first} on", "before": f"before run {first}", "there": "from there on"}
