"""Odd and even: a curve over an input is two, f(u) − f(−u) and f(u) + f(−u), told apart by both signs.

A cubic and an asymmetry of |u| are both along the input, and no bends of one curve: the one has all of what
changes sign with the input, the other all of what does not. A load that saturates is a cubic and u |u|,
roughly: both of one half.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner import catalog
from planner.diagnose.hypotheses.pool import Pool
from planner.nouns.conditions import Conditions, Swinging

EQUAL = 1e-6  # of the largest value of a column, within which two are the same


def unlike_parity(pool: Pool, blocks: Sequence[int]) -> bool:
    """Whether two blocks of one channel each answer the mirrored input by −1 and by +1 of what they are."""
    found = {_parity(pool, b) for b in blocks}
    return found == {-1.0, 1.0}


def _parity(pool: Pool, b: int) -> float:
    """±1 of a block whose columns all are f(−u) = ±f(u); 0 of any other."""
    block = pool.blocks[b]
    if block.generic or block.reference or block.nonlinear or len(block.columns) > 1:
        return 0.0
    (axis,) = block.columns
    c = pool.state[axis].channel
    effect, here = catalog.effects()[block.name], c.model.conditions
    own = [i for i, t in enumerate(effect.terms(c.sensor)) if t.name in block.terms]
    x, mirrored = (
        effect.regressors(c.sensor, k)[:, axis, own] for k in (here, _mirrored(here, c.sensor == "gyro"))
    )
    for sign in (-1.0, 1.0):
        if np.all(np.abs(mirrored - sign * x) <= EQUAL * np.abs(x).max(initial=0.0)):
            return sign
    return 0.0


def power(pool: Pool, b: int) -> float:
    """The power of the inputs by which a library's block grows, 2 of |f| ω and of f²; 0 without inputs."""
    block = pool.blocks[b]
    axis = min(block.columns)
    c, effect = pool.state[axis].channel, catalog.effects()[block.name]
    here = c.model.conditions
    twice = replace(here, rate=2.0 * here.rate, specific_force=2.0 * here.specific_force)
    if isinstance(twice, Swinging):
        twice = replace(twice, swing=2.0 * twice.swing)
    once, grown = (
        float(np.linalg.norm(effect.regressors(c.sensor, k, block.nonlinear)[:, axis])) for k in (here, twice)
    )
    return round(float(np.log2(grown / once)), 3) if once > 0.0 else 0.0


def _mirrored(conditions: Conditions, gyro: bool) -> Conditions:
    if gyro:
        return replace(conditions, rate=-conditions.rate)
    mirrored = replace(conditions, specific_force=-conditions.specific_force)
    return replace(mirrored, swing=-mirrored.swing) if isinstance(mirrored, Swinging) else mirrored
