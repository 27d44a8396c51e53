"""Another unit's turns beside one unit's rests, where each have power-ons of their own.

No place in the campaign divides them, and a search finds the accelerometers mounted by a degree and the
gyros' levels following whatever turns and rests differ in. Levels are what readings are beyond their input,
less scale factor and leans as within power-ons, and less whatever else of one unit is felt by turns and not
by rests: on either sensor the specific force (g-sensitivity), |ω| along the channel (an asymmetry) and the
squares of the rates (arms and rectification). Beside one curve over temperature the levels of all three
gyros have another one in turns, and those of two accelerometers,

    F = Δ(curve of turns) / k : left / freedom,   left < half of what it was,   p < 1e-3 of each,

of either sensor's channels together 1e-9: a unit has one curve, and what turns heat or shake goes with |ω|
or ω².

What one unit feels has to be told by records within power-ons as far as turns have more of it than rests: at
one speed about each axis nothing tells a square of all rates from another level, and an asymmetric scale
factor looked like another unit's. Directions that the Earth's rate alone makes (2e-5 of a turn) tell nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.orthogonal import orthonormal
from planner.diagnose.noise.whitened import log_p
from planner.diagnose.records.levels_step import ANOTHER, EACH, LEAST_FREEDOM, LEAST_SIDE, TURNS
from planner.diagnose.records.power_ons_in_order import InOrder, that_stay
from planner.nouns.array import Array

SIDE = 3  # power-ons of turns, and of rests
TWO = 2  # accelerometers that must say it: the third may have the same bias by chance
SEEN = 1e-3  # of the largest direction within power-ons
MORE = 0.05  # of what turns have more than rests, that no direction within power-ons tells
ROUNDING = 1e-9  # of a column: what is left of one that is the same in all rows of a power-on


def turns_of_another(rows: InOrder) -> tuple[float, NDArray[np.bool_]] | None:
    """Log p of all channels, and (runs,) power-ons of turns or of rests, the fewer; None of one unit."""
    t = rows.table
    if t.ref_rate is None or t.ref_acc is None or len(rows.sensors) < 2:
        return None
    rate, force = t.ref_rate[rows.order], t.ref_acc[rows.order]
    fast = np.linalg.norm(rate, axis=1) > TURNS
    share = np.bincount(rows.run, fast) / np.bincount(rows.run)
    turns = share > 0.0
    if np.any(turns & (share < 1.0)) or min(np.count_nonzero(turns), np.count_nonzero(~turns)) < SIDE:
        return None
    curve = rows.means(rows.weights)
    logs = []
    for (y, u), other in zip(rows.sensors, (force, rate), strict=True):
        for axis in range(3):
            felt = np.column_stack([other, np.abs(rate[:, axis]), rate**2])
            stays = that_stay(y[:, axis], u, rows, axis)
            level = _levels(np.column_stack([felt, stays[:, :-1]]), stays[:, -1:], rows, turns)
            if level is None:
                return None
            logs.append(_log_p(level, curve, turns))
    gyros, accs = np.array(logs[:3]), np.array(logs[3:])
    if max(gyros.sum(), accs.sum()) > np.log(ANOTHER):
        return None
    if max(gyros.max(), np.sort(accs)[TWO - 1]) > np.log(EACH):
        return None
    rows_of = np.bincount(rows.run)
    return float(np.sum(logs)), turns if rows_of[turns].sum() <= rows_of[~turns].sum() else ~turns


def _levels(felt: Array, left: Array, rows: InOrder, turns: NDArray[np.bool_]) -> Array | None:
    """(runs,) mean of what is left (n, 1) less what is felt (n, k), fitted about the means of power-ons.

        A = (felt − means) / size = U S Vᵀ,   m̄ = means / size,   level = mean − m̄ᵀ V S⁻¹ Uᵀ (left − mean)

    None where of m̄ of turns less that of rests more than MORE is no direction that V has.
    """
    means, mean = rows.means(felt), rows.means(left)[:, 0]
    about = felt - means[rows.run]
    size = np.linalg.norm(about, axis=0)
    told = size > ROUNDING * np.linalg.norm(felt, axis=0)
    if not np.any(told):
        return mean
    U, S, Vt = np.linalg.svd(about[:, told] / size[told], full_matrices=False)
    seen = SEEN * S[0] < S
    m = means[:, told] / size[told]
    more = m[turns].mean(axis=0) - m[~turns].mean(axis=0)
    untold = more - Vt[seen].T @ (Vt[seen] @ more)
    if np.linalg.norm(untold) > MORE * np.linalg.norm(more):
        return None
    slope = Vt[seen].T @ ((U[:, seen].T @ (left[:, 0] - mean[rows.run])) / S[seen])
    return np.asarray(mean - m @ slope)


def _log_p(level: Array, curve: Array, turns: NDArray[np.bool_]) -> float:
    """Log p that turns have the curve (runs, nodes) over temperature that rests have; 0: no matter."""
    basis = orthonormal(curve)
    clear = np.column_stack([level, curve * turns[:, None]])
    clear = clear - basis @ (basis.T @ clear)
    z, X = clear[:, 0], clear[:, 1:]
    X = orthonormal(X[:, np.sum(X**2, axis=0) > LEAST_SIDE])
    freedom = len(level) - basis.shape[1] - X.shape[1]
    if X.shape[1] == 0 or freedom < LEAST_FREEDOM:
        return 0.0
    gain = float(np.sum((X.T @ z) ** 2))
    rest = max(float(z @ z) - gain, 1e-300)
    return float(log_p(gain, X.shape[1], freedom, rest / freedom)) if gain > rest else 0.0
