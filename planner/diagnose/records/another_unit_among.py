"""Another unit's accelerometers in some power-ons here and there: two units that were on the bench in turn.

No place in the campaign divides them, and no few power-ons in turn are the other's. Power-ons fall into two
groups by the leans m_g of the three accelerometers that each tells by itself (`leans_change`): two means,

    Σ_g min_k |W (m_g − μ_k)|² → min,   W the inverse of the median spread about the nearer mean

after Lloyd, Least squares quantization in PCM, 1982. Of 2^runs groups one is the best by chance too; that is
counted. The groups then say all but a tenth of what leans differ by (`leans_of_sets`), on every channel, and
neither a rotation nor a tilt of one of them does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.records.leans_change import leans_of_each
from planner.diagnose.records.leans_of_sets import leans_of_sets, of_both
from planner.nouns.array import Array

SIDE = 3  # power-ons of either unit, of many; of nine
FEW_RUNS = 9  # below which two that agree are a group
FEW_SIDE = 2  # one of five or more that is off by itself has a name of its own (`off_power_on`); of four none
LEAST_RUNS = 4  # of which three say how leans scatter
LEFT_OVER = 0.1  # of the gain, that leans may differ by within the groups
ROUNDS = 20  # of Lloyd's; a dozen power-ons need three


def in_two_groups(
    y: Array, u: Array, run: NDArray[np.int64], temperature: Array
) -> tuple[float, float, NDArray[np.bool_]] | None:
    """Log p of all channels, log p of the weakest, (runs,) the smaller group; None where there are no two.

    y, u: (n, 3) readings and references of accelerometers at rest, run by run; run: (n,) 0 … runs − 1
    """
    runs = int(run.max(initial=-1)) + 1
    side = SIDE if runs >= FEW_RUNS else FEW_SIDE if runs > LEAST_RUNS else 1
    if runs < LEAST_RUNS:
        return None
    m, told = _each(y, u, run)
    there = np.zeros(runs, dtype=bool)
    there[told] = _two_means(m[told], side) if np.count_nonzero(told) >= max(2 * side, LEAST_RUNS) else False
    if min(np.count_nonzero(there), np.count_nonzero(told & ~there)) < side:
        return None
    kept = told[run] & of_both(u, there[run])
    number, again = np.unique(run[kept], return_inverse=True)
    mine = there[number]
    if min(np.count_nonzero(mine), np.count_nonzero(~mine)) < side:
        return None
    log, left = leans_of_sets(y[kept], u[kept], again, temperature[kept], mine[None, :])
    if left.max() > LEFT_OVER:
        return None
    groups = runs * np.log(2.0)
    smaller = there if 2 * np.count_nonzero(there) <= np.count_nonzero(told) else told & ~there
    return float(log.sum() + groups), float(log.max()), smaller


def _each(y: Array, u: Array, run: NDArray[np.int64]) -> tuple[Array, NDArray[np.bool_]]:
    """(runs, 6) leans that every power-on says, and (runs,) which ones say all of them."""
    leans, told = [], np.ones(int(run.max()) + 1, dtype=bool)
    for a in range(3):
        x = leans_of_each(y[:, a], u, a, run)
        A, h = x.gram[:, :2, :2], x.gram[:, :2, 2:]
        whole = np.linalg.eigvalsh(A)[:, 0] > x.least
        A = np.where(whole[:, None, None], A, np.eye(2))
        leans.append(np.linalg.solve(A, h)[:, :, 0])
        told &= whole
    return np.column_stack(leans), told


def _two_means(m: Array, side: int) -> NDArray[np.bool_]:
    """(g,) the group of each of m (g, k), of `side` at least; begun along what they differ by most."""
    about = m - np.median(m, axis=0)
    way = np.linalg.svd(about, full_matrices=False)[2][0]
    along = np.sort(about @ way)
    widest = int(np.argmax(np.diff(along)[side - 1 : len(along) - side])) + side - 1
    there: NDArray[np.bool_] = np.asarray(about @ way > 0.5 * (along[widest] + along[widest + 1]))
    for _ in range(ROUNDS):
        if there.all() or not there.any():
            break
        means = np.array([m[~there].mean(axis=0), m[there].mean(axis=0)])
        spread = np.median(np.abs(m - means[there.astype(int)]), axis=0)
        weight = 1.0 / np.maximum(spread, 1e-3 * max(float(spread.max()), 1e-300))
        far = np.sum(((m[:, None, :] - means) * weight) ** 2, axis=2)
        new = np.asarray(far[:, 1] < far[:, 0])
        if np.array_equal(new, there):
            break
        there = new
    return there


def of_either(
    y: Array,
    u: Array,
    run: NDArray[np.int64],
    temperature: Array,
    one: NDArray[np.bool_],
    two: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """(n,) rows of power-ons that read as the second unit does, of two that rests tell (n,) each.

    Of turns the accelerometers tell it as well, of loads their leans: y = u + b + (c₁, c₂)·(T, T²) + K u by
    either unit's rests, the power-on to that which leaves the smaller square.
    """
    t = (temperature - np.mean(temperature)) / 50.0
    X = np.column_stack([np.ones_like(t), t, t**2, u])
    left = [
        np.sum((y - u - X @ np.linalg.lstsq(X[rows], (y - u)[rows], rcond=1e-6)[0]) ** 2, axis=1)
        for rows in (one, two)
    ]
    number, inverse = np.unique(run, return_inverse=True)
    first, second = (np.bincount(inverse, x, minlength=len(number)) for x in left)
    known = np.bincount(inverse, one) + np.bincount(inverse, two) > 0
    theirs = np.where(known, np.bincount(inverse, two) > 0, second < first)
    return np.asarray(theirs[inverse])
