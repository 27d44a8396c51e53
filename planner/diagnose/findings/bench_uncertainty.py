"""Whether an effect is smaller than what a good bench itself does not know."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.diagnose.channels.channel import Channel
from planner.diagnose.hypotheses.estimates import Estimate
from planner.diagnose.search.sensor import SensorFound
from planner.nouns.array import Array

ANGLE = 5e-5  # rad, 10 arc seconds: axis position and squareness of a two-axis table
SHARE = 1e-5  # of the rate, and of a centrifuge's load


def below_bench(s: SensorFound, blocks: Sequence[int], sizes: Sequence[Estimate]) -> bool:
    """Whether the records that show the effect show less of it than the bench's uncertainty there.

    Uncertainty of a record: ANGLE times what lies across the channel, SHARE times what lies along it.
    A record counts by what the effect adds to it, squared, over its noise.
    """
    below = total = 0.0
    for b in blocks:
        for c in s.channels:
            if c.axis in s.found.pool.blocks[b].columns:
                adds = _adds(s, b, c, sizes)
                counts = adds**2 / s.found.pool.state[c.axis].noise.spread ** 2
                below += float(counts[np.abs(adds) <= _uncertainty(c)].sum())
                total += float(counts.sum())
    return below > total / 2.0


def _adds(s: SensorFound, b: int, c: Channel, sizes: Sequence[Estimate]) -> Array:
    """(n,) what a block adds to a channel."""
    block = s.found.pool.blocks[b]
    gamma = {e.term: e.value for e in sizes if e.block == b}
    named = [i for i, term in enumerate(block.terms) if term]
    values = np.array([gamma[block.terms[i]] for i in named])
    return np.asarray(block.columns[c.axis][:, named] @ values)


def _uncertainty(c: Channel) -> Array:
    return np.asarray(np.hypot(ANGLE * c.across, SHARE * np.abs(c.u)))
