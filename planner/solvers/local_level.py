"""A random walk seen through noise, with regressors on top: the augmented Kalman filter, many series at once.

    y_i = α_i + x_i·β + n_i,   α_i = α_{i−1} + w_i,   var w_i = λ Δt_i,   var n_i = v_i,   α_0 diffuse

Filtering y and every column of X by the same scalar filter gives innovations e (of y) and E (of X) with
variances F, and with them everything that β and the marginal likelihood need (de Jong, Annals of Statistics
19, 1991, 1073):

    −2 log p(y | β) = Σ log F_i + Σ (e_i − E_i β)² / F_i
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array


@dataclass(frozen=True)
class Filtered:
    """U series under L variances. gram: (U, L, 1+p, 1+p) Σ z zᵀ/F of z = (e, E); log_f: (U, L) Σ log F

    level: (U, L, 1+p) what the last level is made of: level_y − level_X·β; variance: (U, L) of it
    count: (U,) innovations
    """

    gram: Array
    log_f: Array
    level: Array
    variance: Array
    count: Array


def filtered(
    day: Array, columns: Array, noise: Array, used: NDArray[np.bool_], fresh: NDArray[np.bool_], walk: Array
) -> Filtered:
    """Filter day (U, n), columns (U, n, 1+p) with y first, noise (U, L, n) variances, walk (L,) a day.

    used: (U, n) flags of values that count, of padding none; fresh: (U, n) flags where the level starts anew
    """
    U, n, width = columns.shape
    L = len(walk)
    a, P = np.zeros((U, L, width)), np.zeros((U, L))
    gram, log_f, count = np.zeros((U, L, width, width)), np.zeros((U, L)), np.zeros(U)
    begun = np.zeros(U, dtype=bool)
    apart = np.diff(day, axis=1, prepend=day[:, :1])
    for i in range(n):
        P += walk * apart[:, i, None]
        z, v = columns[:, i, None], noise[:, :, i]
        tells = used[:, i] & begun & ~fresh[:, i]
        starts = used[:, i] & ~tells
        F = P + v
        inverse = tells[:, None] / np.where(F > 0, F, 1.0)
        e = z - a
        gram += (e * inverse[..., None])[..., :, None] * e[..., None, :]
        log_f += np.where(tells[:, None], np.log(np.where(F > 0, F, 1.0)), 0.0)
        gain = np.where(starts[:, None], 1.0, P * inverse)
        a += gain[..., None] * e
        P = np.where(starts[:, None], v, P * (1 - gain))
        begun |= used[:, i]
        count += tells
    return Filtered(gram, log_f, a, P, count)
