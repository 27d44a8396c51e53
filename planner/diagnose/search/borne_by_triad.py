"""Whether what hides in a channel's noise hides there still beside what the other channels say of the noise.

Of a dozen power-ons and a step on any day between them, one step leaves a channel almost no spread from
power-on to power-on: chosen for that, tested by what it left, it is thirteen sigma where it was four. Three
channels know their noise three times as well. Where they may all have the same without what hides in one, it
must explain enough beside that,

    Δ − m log g > DECISIVE,   Δ = yᵀP_0 y − yᵀP y,  V by the restricted likelihood of all channels together

g power-ons: as many readings there are of what changes between them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.diagnose.channels.orthogonal import explained
from planner.diagnose.hypotheses.lack_of_fit import DECISIVE
from planner.diagnose.noise.channel_noise import TOLD, ChannelNoise, Readings
from planner.diagnose.noise.noise_of_triad import noise_in_common


def borne_by_triad(before: Sequence[Readings], after: Sequence[Readings]) -> list[Readings]:
    """The readings of a sensor's channels, `after`, without hidden columns that are noise for the triad.

    before: the same without what hides. Where a channel without it differs from the others with theirs, what
    it hides is its own.
    """
    return [
        a if a is b or _borne(b, [*after[:i], b, *after[i + 1 :]], a, i) else b
        for i, (b, a) in enumerate(zip(before, after, strict=True))
    ]


def _borne(before: Readings, triad: Sequence[Readings], after: Readings, i: int) -> bool:
    common = noise_in_common(triad)
    return common is None or _explains(before, after, common[i])


def _explains(before: Readings, after: Readings, noise: ChannelNoise) -> bool:
    """Whether the columns that one has more than the other explain enough in noise of this size."""
    known = np.column_stack([before.declared, before.candidates, noise.fixed_runs])
    more = after.candidates[:, before.candidates.shape[1] :]
    y = noise.whiten(before.channel.r[:, None])[:, 0]
    delta, m = explained(noise.whiten(known), noise.whiten(more), y, TOLD)
    return bool(delta - m * np.log(len(noise.starts)) > DECISIVE)
