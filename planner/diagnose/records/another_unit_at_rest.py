"""Another unit's accelerometers at rest, where it has hardly a power-on off the centrifuge.

A campaign that ends on an arm may change units before its last tumbles. Those are too few rows for halves of
a campaign to differ (`another_unit`), and a search then blames loads, faces and days for it. The leans of all
three accelerometers become others at one power-on, by more than any power-on draws them, and not as one
rotation or one tilt of the base turns them: with Δ what each explains of the squares, at that place,

    Δ(3 angles), Δ(north, east) < 0.9 Δ(6 leans),   or < 0.97 where what they leave is no chance
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.orthogonal import about_means, clear, orthonormal
from planner.diagnose.noise.whitened import log_p
from planner.diagnose.records.another_unit_among import in_two_groups
from planner.diagnose.records.changed_power_ons import SIDE
from planner.diagnose.records.leans_of_a_few import few_in_turn
from planner.diagnose.records.leans_of_sets import leans_of_sets
from planner.nouns.array import Array

ANOTHER = 1e-9  # p of all channels' leans together, over all places
EACH = 1e-3  # p of the weakest channel's
OF_THE_BENCH = 0.9  # of what six leans explain: of six that are anything three angles explain half
ALL_OF_IT = 0.97  # from which what they leave is no more than small angles and a fixture's play
BY_CHANCE = 1e-9  # p of what they leave between these, by the rows' own noise
LEAST_RUNS = 4  # power-ons with rests, of which several say how leans scatter


def another_at_rest(
    y: Array, u: Array, run: NDArray[np.int64], north: Array, temperature: Array
) -> tuple[float, int] | None:
    """Log p and the last power-on before the other unit; None where all rests may be of one.

    y, u: (n, 3) readings and references at rest, run by run; run: (n,) 0 … runs − 1; north: (n, 3);
    temperature: (n,) degC
    """
    runs = int(run.max(initial=-1)) + 1
    if runs < LEAST_RUNS:
        return None
    order = np.arange(runs)
    firsts = order[SIDE : runs - SIDE + 1]
    each, _ = leans_of_sets(y, u, run, temperature, order >= firsts[:, None])
    best = int(np.argmin(each.sum(axis=0)))
    found, weakest = float(each[:, best].sum() + np.log(runs)), float(each[:, best].max() + np.log(runs))
    place = int(firsts[best]) - 1
    if found > np.log(ANOTHER) or weakest > np.log(EACH) or not _is_no_bench(y, u, run, north, run > place):
        return None
    return found, place


def few_at_rest(
    y: Array, u: Array, run: NDArray[np.int64], north: Array, temperature: Array
) -> tuple[float, NDArray[np.int64]] | None:
    """Log p and the few power-ons in turn (0 … runs − 1) that are another unit's; temperature: (n,) °C."""
    few = few_in_turn(y, u, run, temperature)
    if few is None or few.log_p > np.log(ANOTHER) or few.weakest > np.log(EACH):
        return None
    return (few.log_p, np.flatnonzero(few.there)) if _is_no_bench(y, u, run, north, few.there[run]) else None


def some_at_rest(
    y: Array, u: Array, run: NDArray[np.int64], north: Array, temperature: Array
) -> tuple[float, NDArray[np.bool_]] | None:
    """Log p and (runs,) power-ons here and there that are another unit's; the arguments of `few_at_rest`."""
    two = in_two_groups(y, u, run, temperature)
    if two is None or two[0] > np.log(ANOTHER) or two[1] > np.log(EACH):
        return None
    return (two[0], two[2]) if _is_no_bench(y, u, run, north, two[2][run]) else None


def _is_no_bench(y: Array, u: Array, run: NDArray[np.int64], north: Array, there: NDArray[np.bool_]) -> bool:
    """Whether neither a rotation nor a tilt, common to the channels, explains how the leans change."""
    later = there[:, None]
    turned = np.stack([np.cross(e, u) for e in np.eye(3)], axis=2)  # (n, 3, 3): channel, angle
    tilted = np.stack([north, np.cross(north, u / np.linalg.norm(u, axis=1, keepdims=True))], axis=2)
    leans, shared, left = [], [], []
    for a in range(3):
        own = np.column_stack([u[:, [a]] * later, u[:, [a]] * ~later, np.delete(u, a, axis=1)])
        base = orthonormal(about_means(own, run), 1e-6)
        X = np.column_stack([np.delete(u, a, axis=1), turned[:, a], tilted[:, a]]) * later
        z = clear(base, about_means(np.column_stack([X, y[:, a] - u[:, a]]), run))
        mine = np.zeros((len(z), 6))
        mine[:, 2 * a : 2 * a + 2] = z[:, :2]
        leans.append(mine)
        shared.append(z[:, 2:-1])
        left.append(z[:, -1])
    e = np.concatenate(left)
    every, rotation = _square(np.concatenate(leans), e), _square(np.concatenate(shared)[:, :3], e)
    bench = max(rotation, _square(np.concatenate(shared)[:, 3:], e))
    if bench < OF_THE_BENCH * every:
        return True
    freedom = float(len(e) - 3 * base.shape[1] - 3 * int(run.max() + 1) - 6)
    rest = max(float(e @ e) - every, 1e-300) / max(freedom, 1.0)
    by_chance = freedom < 1.0 or float(log_p(every - bench, 3, freedom, rest)) > np.log(BY_CHANCE)
    return bench < ALL_OF_IT * every and not by_chance


def _square(X: Array, e: Array) -> float:
    """What regression on X (n, k) explains of the square of e."""
    return float(np.sum((orthonormal(X, 1e-6).T @ e) ** 2))
