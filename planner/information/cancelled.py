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
    return bool(np.all(taken_away(promise, counts[None])[0] <= TRUSTED * limits))


def refuse_what_only_cancels(promise: Promise, counts: Array) -> None:
    """Raises InputError where what is promised of a campaign (g,) is a small difference of large estimates.

    Of a campaign made by hand, whose limits may be anything: held against what is promised.
    """
    away, promised = taken_away(promise, counts[None])[0], promise.figures(counts[None])[0].max(axis=0)
    k = int(np.argmax(away - TRUSTED * promised))
    if away[k] > TRUSTED * promised[k]:
        raise InputError(
            "the campaign that is fixed by hand tells some errors only together: the estimate of one adds "
            f"{away[k] / promised[k]:.2g} times what requirement {k + 1} is promised, and others take it "
            "away again; no linear combination foretells their products; add motions, loads or temperatures "
            "that tell them apart"
        )


def taken_away(promise: Promise, counts: Array) -> Array:
    """(B, requirements) the most that estimates take away of what another one of their channel adds, SI.

    max √(Σ_c rᵢCᵢᵢrᵢᵀ − r C rᵀ) over terms i, channels, temperatures and instants, r what d takes from the
    coefficients of a channel with covariance C; 0 where no term adds more than all together.
    """
    most = np.zeros((len(counts), len(promise.asked)))
    for rows, seen, found in promise.seen(counts):
        R = seen.reads(found)
        whole = _squares(R, found.covariance)
        own = np.array([_squares(R[..., p], found.covariance[..., p, p]) for p in found.places])
        for k, a in enumerate(promise.asked):
            if a.index not in rows:
                continue
            mine, c = rows[a.index], a.response.shape[2]
            together, each = (x[..., mine].reshape(*x.shape[:-1], -1, c).sum(axis=-1) for x in (whole, own))
            beyond = (each.max(axis=0) - together).max(axis=(0, 2, 3))
            most[:, k] = np.maximum(most[:, k], np.sqrt(np.maximum(beyond, 0.0)))
    return most


def _squares(R: Array, C: Array) -> Array:
    """(a, B, S, ρ) the diagonal of R C Rᵀ; R: (a, B, S, ρ, p), C: (a, B, p, p)."""
    return np.asarray(((R @ C[:, :, None]) * R).sum(axis=-1))
