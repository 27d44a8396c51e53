"""Whether an effect is smaller than what a good bench itself does not know."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.learn.diagnosis.estimates import Estimate
from planner.learn.diagnosis.sensor import SensorFound

ANGLE = 5e-5  # rad, 10 arc seconds: axis position and squareness of a two-axis table
SHARE = 1e-5  # of the rate, and of a centrifuge's load


def below_bench(s: SensorFound, blocks: Sequence[int], sizes: Sequence[Estimate]) -> bool:
    """Whether the effect adds less than the bench's uncertainty, weighted mean square over the records.

    Uncertainty of a record: ANGLE times what lies across the channel, SHARE times what lies along it.
    """
    pool = s.found.pool
    for b in blocks:
        gamma = {e.term: e.value for e in sizes if e.block == b}
        for c in s.channels:
            if c.axis not in pool.blocks[b].columns:
                continue
            k = [i for i, term in enumerate(pool.blocks[b].terms) if term]
            values = np.array([gamma[pool.blocks[b].terms[i]] for i in k])
            adds = pool.blocks[b].columns[c.axis][:, k] @ values
            u = s.sensed(c)
            across = np.linalg.norm(np.delete(u, c.axis, axis=1), axis=1)
            bench = np.hypot(ANGLE * across, SHARE * np.abs(u[:, c.axis]))
            weight = 1.0 / pool.state[c.axis].noise.covariance.diagonal  # records that tell most count most
            if float(weight @ adds**2) > float(weight @ bench**2):
                return False
    return True
