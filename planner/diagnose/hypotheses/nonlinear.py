"""Parameters of believed effects at their best between the values of the grid, by variable projection."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.channels.parameters import Range
from planner.diagnose.hypotheses.candidates import Block, effect_blocks
from planner.diagnose.hypotheses.pool import Pool, extended, given, pool_of
from planner.diagnose.hypotheses.scores import score
from planner.nouns.array import Array
from planner.protocols import Parameter
from planner.solvers.distributions import student_quantile
from planner.solvers.profile_interval import Held, ProfileIntervals, held_of, profile_intervals

NEAR_STEPS = 12  # on both sides, so that steps meet halfway between two values of the grid
OF_A_STEP = 7.35  # of Δ, within which the place of a step lies
BEYOND = 6  # places in a row that explain less, beyond which none is looked for
ROUNDS = 40  # of the search over several parameters together
SETTLED = 1e-3  # on the scale on which a fit carries a parameter

Point = dict[str, float]
Gain = Callable[[Point], float]


def refined(
    pool: Pool,
    believed: Sequence[int],
    b: int,
    channels: Sequence[Channel],
    cuts: NDArray[np.int64],
    ranges: Sequence[Range],
) -> tuple[Pool, int]:
    """The block at the best value of its parameters near those that it has.

    A parameter that steps is known to lie between two values of its condition; every such middle nearby is
    tried.
    """
    block = pool.blocks[b]
    others = [i for i in believed if i != b]

    def gain(at: Point) -> float:
        moved = _at(block, at, channels)
        return 0.0 if moved is None else _gain(pool, others, pool_of(pool.state, [moved], cuts))

    best = _best_steps(gain, dict(block.nonlinear), [r for r in ranges if r.parameter.stepped])
    best = _best_smooth(gain, best, [r for r in ranges if not r.parameter.stepped and r.low < r.high])
    moved = _at(block, best, channels)
    if moved is None or gain(best) <= score(given(pool, others), [b]).delta + 1e-9:
        return pool, b
    return extended(pool, moved, cuts), len(pool.blocks)


def as_likely_steps(
    pool: Pool,
    others: Sequence[int],
    b: int,
    channels: Sequence[Channel],
    cuts: NDArray[np.int64],
    r: Range,
) -> tuple[float, float]:
    """The ends between which a parameter steps at 95 %: of every place that explains nearly as much.

        Δ(best) − Δ(there) <= 7.35 s²

    which a place of a step keeps in 95 of 100 where its neighbours explain nearly the same (Hansen,
    Econometrica 68, 2000, 575); χ² has 3.84, for what is smooth. Fewer degrees of freedom lengthen it as they
    do Student's t. Places are tried outwards from the best one, until BEYOND of them in a row explain less.
    others: what is believed beside the block.
    """
    block, name = pool.blocks[b], r.parameter.name
    if not len(r.steps):
        return r.parameter.low, r.parameter.high
    here, beside = int(np.argmin(np.abs(r.steps - block.nonlinear[name]))), score(given(pool, others), [b])
    few = float(student_quantile(0.975, beside.freedom) / student_quantile(0.975, np.inf))
    least = beside.delta - OF_A_STEP * few**2 * beside.s2
    ends = [here, here]
    for side, step in enumerate((-1, 1)):
        place, missed = here + step, 0
        while 0 <= place < len(r.steps) and missed < BEYOND:
            moved = _at(block, {**block.nonlinear, name: float(r.steps[place])}, channels)
            good = moved is not None and _gain(pool, others, pool_of(pool.state, [moved], cuts)) >= least
            ends[side], missed = (place, 0) if good else (ends[side], missed + 1)
            place += step
    return float(r.gaps[ends[0], 0]), float(r.gaps[ends[1], 1])


def profiled(
    pool: Pool,
    others: Sequence[int],
    b: int,
    channels: Sequence[Channel],
    cuts: NDArray[np.int64],
    p: Parameter,
    half: float,
    reach: tuple[float, Array],
) -> ProfileIntervals | None:
    """The intervals of a block's only parameter, as it is carried, and of its sizes, SI (`profile_interval`).

    others: what is believed beside it; half: of the interval by slopes; reach: t of the parameter, of the
    sizes (k,), in standard errors of unit variance of the whitened rows
    """
    block = pool.blocks[b]

    def held(value: float) -> Held | None:
        moved = _at(block, {p.name: p.value(value)}, channels)
        if moved is None:
            return None
        one = pool_of(pool.state, [moved], cuts)
        if not one.size.all():
            return None
        h, gram = _beside(pool, others, one)
        here = held_of(gram, h, np.ones(len(h)))
        return here and Held(here.explained, here.size / one.size, here.error / one.size)

    return profile_intervals(held, p.carried(block.nonlinear[p.name]), half, p.bounds, *reach)


def _best_steps(gain: Gain, at: Point, ranges: Sequence[Range]) -> Point:
    """Every parameter that steps at the best of the values near the one it has, one after the other."""
    for r in ranges:
        name = r.parameter.name
        near = r.steps[np.argsort(np.abs(r.steps - at[name]))[:NEAR_STEPS]]
        if len(near):
            at = max(({**at, name: float(v)} for v in near), key=gain)
    return at


def _best_smooth(gain: Gain, at: Point, ranges: Sequence[Range]) -> Point:
    """The other parameters at the best values near those they have: one by a line, several by gradients."""
    if len(ranges) > 1:
        return _best_of_several(gain, at, ranges)
    return _best_of_one(gain, at, ranges[0]) if ranges else at


def _best_of_one(gain: Gain, at: Point, r: Range) -> Point:
    from scipy.optimize import minimize_scalar

    p = r.parameter
    here = p.carried(at[p.name])
    ends = max(here - r.step, r.low), min(here + r.step, r.high)
    if not ends[0] < ends[1]:
        return at
    found = minimize_scalar(
        lambda x: -gain({**at, p.name: p.value(float(x))}),
        bounds=ends,
        method="bounded",
        options={"xatol": SETTLED * min(1.0, r.high - r.low)},
    )
    return {**at, p.name: p.value(float(found.x))}


def _best_of_several(gain: Gain, at: Point, ranges: Sequence[Range]) -> Point:
    """Within the ranges, which become the unit cube; half a step to both sides gives the slopes' start."""
    from scipy.optimize import minimize

    low = np.array([r.low for r in ranges])
    size = np.array([r.high for r in ranges]) - low

    def point(x: NDArray[np.float64]) -> Point:
        carried = low + np.clip(x, 0.0, 1.0) * size
        return {
            **at,
            **{r.parameter.name: r.parameter.value(float(c)) for r, c in zip(ranges, carried, strict=True)},
        }

    start = (np.array([r.parameter.carried(at[r.parameter.name]) for r in ranges]) - low) / size
    found = minimize(
        lambda x: -gain(point(x)),
        np.clip(start, 0.0, 1.0),
        method="L-BFGS-B",
        bounds=[(0.0, 1.0)] * len(ranges),
        options={"maxiter": ROUNDS, "eps": 1e-5},
    )
    return point(found.x)


def _at(block: Block, at: Mapping[str, float], channels: Sequence[Channel]) -> Block | None:
    """The block at other values; none where its columns vanish."""
    mine = [c for c in channels if c.axis in block.columns]
    found = [x for x in effect_blocks(mine, block.name, at) if x.key == block.key]
    return found[0] if found else None


def _gain(pool: Pool, others: Sequence[int], one: Pool) -> float:
    """Δ of a block of another pool beside some blocks of this one."""
    h, gram = _beside(pool, others, one)
    return float(h @ np.linalg.pinv(gram, rcond=1e-8, hermitian=True) @ h)


def _beside(pool: Pool, others: Sequence[int], one: Pool) -> tuple[Array, Array]:
    """h (k,) and Gram (k, k) of a block of another pool, clear of some blocks of this one."""
    k = pool.columns(others)
    cross = np.zeros((len(k), len(one.h)))
    for axis, C in one.parts.items():
        place = {int(g): i for i, g in enumerate(pool.axes[axis])}
        for row, column in enumerate(k):
            if int(column) in place:
                cross[row, one.axes[axis]] += pool.parts[axis][:, place[int(column)]] @ C
    inverse = np.linalg.pinv(pool.gram[np.ix_(k, k)], rcond=1e-8, hermitian=True)
    return one.h - cross.T @ inverse @ pool.h[k], one.gram - cross.T @ inverse @ cross
