"""Whether a campaign can lose any one record and still determine everything that flies.

Records of visits that are made at least twice have another one like them. Of the others each is left out in
turn: as a kind of its own, with the columns that are left. Weights are not taken, nor what an error does to
the others of which nothing is fitted: a coefficient is untold where the others tell it a hundred times worse.
Without its only turn at 200 deg/s a scale factor is told by the Earth's rate, which is as good as nothing.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from planner.information.kinds import ChannelKinds, Kinds
from planner.information.promise import Promise
from planner.nouns.array import Array

UNTOLD = 100.0  # times the sigma, from which on a loss leaves a coefficient untold


def survives_any_loss(promise: Promise, counts: Array) -> bool:
    """Whether whatever record of counts (g,) is lost, no coefficient that flies is undetermined by it."""
    alone = np.flatnonzero(counts == 1)
    lost = [(int(k), i) for k in alone for i in range(_records(promise.kinds, int(k)))]
    if not lost:
        return True
    g = len(counts)
    tried = np.zeros((1 + len(lost), g + len(lost)))  # the first one loses nothing
    tried[:, :g] = counts
    for i, (k, _) in enumerate(lost):
        tried[1 + i, k], tried[1 + i, g + i] = 0.0, 1.0
    kinds = Kinds(
        (*promise.kinds.kinds, *(promise.kinds.kinds[k] for k, _ in lost)),
        tuple(_without(c, lost) for c in promise.kinds.channels),
    )
    plain = replace(promise, kinds=kinds, families={"": {}}, means={}, smooth=None, misread=None)
    known = plain.estimated(tried)
    return bool(np.all(known[1:] <= UNTOLD**2 * known[0]))


def _records(kinds: Kinds, kind: int) -> int:
    c = kinds.channels[0]
    return int(np.diff(np.append(c.starts, len(c.rows)))[kind])


def _without(c: ChannelKinds, lost: list[tuple[int, int]]) -> ChannelKinds:
    """The channel with kinds that lack a record each; information without weights."""
    b, q = c.rows.shape[1], len(c.sigma)
    ends = np.append(c.starts, len(c.rows))
    each = [c.rows[a:z] for a, z in pairwise(ends)]
    each += [np.delete(each[k], i, axis=0) for k, i in lost]
    inputs = [c.inputs[a:z] for a, z in pairwise(ends)]
    inputs += [np.delete(inputs[k], i) for k, i in lost]
    information = np.zeros((len(each), b + q, b + q))
    information[:, :b, :b] = [x.T @ x for x in each]
    sizes = [len(x) for x in each]
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64)
    rows, size = np.concatenate(each), np.concatenate(inputs)
    return replace(
        c,
        information=information,
        unfitted=(),
        astray=np.zeros((len(each), b + q, 0)),
        rows=rows,
        inputs=size,
        starts=starts,
        strayed={},
    )
