"""What the estimate of one coefficient adds, and that of another takes away again.

Where records see a gyro's scale factor and what follows the load at 1 g only, each is told to half of itself
and their sum to a ten-thousandth: at 1 g nothing of it flies. But a linear combination knows no products, and
what an accelerometer errs by, times half of a rate, is one: where 416 m were taken away, 56.6 m were promised
and 236 flew. Campaigns are asked to tell each coefficient so well that little needs to be taken away.
"""

from __future__ import annotations

import numpy as np

from planner.errors import InputError
from planner.information.promise import Promise
from planner.nouns.array import Array

TRUSTED = 0.2  # of the limit, that others may take away of what one adds; ordinary plans have a hundredth


def leaves_products_small(promise: Promise, counts: Array) -> bool:
    """Whether of a campaign (g,) estimates take little away of what others add, beside the limits."""
    limits = np.array([a.limit for a in promise.asked])
    return bool(np.all(promise.taken_away(counts[None])[0] <= TRUSTED * limits))


def refuse_what_only_cancels(promise: Promise, counts: Array) -> None:
    """Raises InputError where what is promised of a campaign (g,) is a small difference of large estimates.

    Of a campaign made by hand, whose limits may be anything: held against what is promised.
    """
    away, promised = promise.taken_away(counts[None])[0], promise.figures(counts[None])[0].max(axis=0)
    k = int(np.argmax(away / promised))
    if away[k] > TRUSTED * promised[k]:
        raise InputError(
            "the campaign that is fixed by hand tells some errors only together: the estimate of one adds "
            f"{away[k] / promised[k]:.2g} times what requirement {k + 1} is promised, and others take it "
            "away again; no linear combination foretells their products; add motions, loads or temperatures "
            "that tell them apart"
        )
