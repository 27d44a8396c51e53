"""Nonlinear parameters of believed effects, at their best between the values of the grid."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.learn.diagnosis.candidates import Block, effect_blocks
from planner.learn.diagnosis.channels import Channel
from planner.learn.diagnosis.pool import Pool, extended, given, pool_of, score
from planner.records import Array

NEAR = 1.9  # by which a value may leave its neighbour; the ratio of the grid is smaller
NEAR_DAYS = 12  # on both sides, so that steps meet halfway between two days of the grid


@dataclass(frozen=True)
class Values:
    """What nonlinear parameters can be. time_constants: shortest and longest seen, s; days: (k,) of steps."""

    time_constants: tuple[float, float]
    days: Array


def refined(
    pool: Pool,
    believed: Sequence[int],
    b: int,
    channels: Sequence[Channel],
    cuts: NDArray[np.int64],
    values: Values,
) -> tuple[Pool, int]:
    """The block at the best value of its parameter near the one it has (variable projection).

    A step's day is known to lie between two days of the table; every such middle nearby is tried.
    """
    block = pool.blocks[b]
    ((name, value),) = block.nonlinear.items()
    others = [i for i in believed if i != b]

    def gain(at: float) -> float:
        moved = _at(block, name, at, channels)
        return 0.0 if moved is None else _gain(pool, others, pool_of(pool.state, [moved], cuts))

    best = _best_day(gain, value, values.days) if name == "day" else _best_tau(gain, value, values)
    moved = _at(block, name, best, channels)
    if moved is None or gain(best) <= score(given(pool, others), [b]).delta + 1e-9:
        return pool, b
    return extended(pool, moved, cuts), len(pool.blocks)


def _best_tau(gain: Callable[[float], float], value: float, values: Values) -> float:
    from scipy.optimize import minimize_scalar

    shortest, longest = values.time_constants
    ends = np.log(max(value / NEAR, shortest)), np.log(min(value * NEAR, longest))
    if not ends[0] < ends[1]:
        return value
    found = minimize_scalar(
        lambda log: -gain(float(np.exp(log))), bounds=ends, method="bounded", options={"xatol": 1e-3}
    )
    return float(np.exp(found.x))


def _best_day(gain: Callable[[float], float], value: float, days: Array) -> float:
    near = days[np.argsort(np.abs(days - value))[:NEAR_DAYS]]
    return float(max(near, key=gain)) if len(near) else value


def _at(block: Block, name: str, value: float, channels: Sequence[Channel]) -> Block | None:
    """The block at another value; none where its columns vanish."""
    mine = [c for c in channels if c.axis in block.columns]
    found = [x for x in effect_blocks(mine, block.name, {name: value}) if x.key == block.key]
    return found[0] if found else None


def _gain(pool: Pool, others: Sequence[int], one: Pool) -> float:
    """Δ of a block of another pool beside some blocks of this one."""
    k = pool.columns(others)
    cross = np.zeros((len(k), len(one.h)))
    for axis, C in one.parts.items():
        place = {int(g): i for i, g in enumerate(pool.axes[axis])}
        for row, column in enumerate(k):
            if int(column) in place:
                cross[row, one.axes[axis]] += pool.parts[axis][:, place[int(column)]] @ C
    inverse = np.linalg.pinv(pool.gram[np.ix_(k, k)], rcond=1e-8, hermitian=True)
    h = one.h - cross.T @ inverse @ pool.h[k]
    gram = one.gram - cross.T @ inverse @ cross
    return float(h @ np.linalg.pinv(gram, rcond=1e-8, hermitian=True) @ h)
