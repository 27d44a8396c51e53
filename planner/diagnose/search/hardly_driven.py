"""Effects whose input hardly acts in any record: what would tell them is said, and they get no name."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from planner.campaign.channel_model import EXCITING
from planner.diagnose.hypotheses.pool import Pool
from planner.diagnose.references.references import hypothesis
from planner.measurement import input_size

DRIVEN = 0.5  # of what tells an effect that multiplies an input, that records with such an input must tell


def hardly_driven(pool: Pool, library: Iterable[int]) -> set[int]:
    """Blocks that multiply an input and of which the records with hardly any input tell the most.

    At rest the Earth's rate shows a gyro's scale factor: so does a wrong reference or a curve of the bias.
    Such records tell what the columns have in them: a rest between loads is the level from which these count.
    And blocks of an effect that says of its conditions that they do not drive it (`driven`).
    """
    out = set()
    for b in library:
        block = pool.blocks[b]
        acts = getattr(hypothesis(block.name), "driven", None)
        if acts is not None and not acts(next(iter(pool.state.values())).channel.model.conditions):
            out.add(b)
        elif not (block.reference or hypothesis(block.name).group == "bias"):
            driven, undriven = _told_by_input(pool, b)
            if driven < DRIVEN * (driven + undriven):
                out.add(b)
    return out


def _told_by_input(pool: Pool, b: int) -> tuple[float, float]:
    """Squares of a block's columns where there is an input, and where hardly, whitened and as in the pool."""
    size = pool.size[pool.places[b]]
    scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
    told = np.zeros(2)
    for axis, x in pool.blocks[b].columns.items():
        c = pool.state[axis].channel
        driven = (input_size(c.sensor, c.model.conditions) >= EXCITING[c.sensor])[:, None]
        parts = (x * driven, x * ~driven)
        left = pool.state[axis].clear_of_declared(parts).left
        told += np.sum((left * np.tile(scale, 2)) ** 2, axis=0).reshape(2, -1).sum(axis=1)
    return float(told[0]), float(told[1])
