"""Another unit's accelerometers in a few power-ons in turn, behind which the first one is back.

Where the few have a temperature of their own the declared curve takes their levels up: what ramps through
that temperature say was then a table over the rate of temperature, beside unknowns of every channel. Leans
are told within power-ons. With A_g and h_g = A_g m_g what power-on g says of the two leans m of a channel
(`leans_change`), a curve c p(T) of them over temperature, and δ of the few,

    Σ_g (m_g − c p(T_g) − δ [g of the few])ᵀ A_g (m_g − c p(T_g) − δ [g of the few]) → min,   p = (1, T, T²)

the gain of δ is beyond chance on every channel, and hardly any of it is left over: a curve that a parabola
does not follow leaves as much at other temperatures. Of four temperatures or fewer each has leans of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.noise.whitened import log_p
from planner.diagnose.records.changed_power_ons import LONGEST, SIDE, sums_over
from planner.diagnose.records.leans_change import leans_of_each
from planner.dwells.table_rows import alike
from planner.nouns.array import Array
from planner.temperature_table import temperature_nodes
from planner.units import STANDARD_GRAVITY_MPS2

LEAST_OTHERS = 6  # power-ons of the unit before and behind
LEAST_TEMPERATURES = 5  # from which a parabola leaves something of what is no parabola
LEFT_OVER = 0.1  # of the gain, that leans of all others may differ by
SAME_FACE = 0.05  # of gravity: attitudes that others have too
RANK = 1e-6  # of the largest square


@dataclass(frozen=True)
class Few:
    """log_p: of three channels together, over all places; weakest: of one; there: (runs,) which power-ons"""

    log_p: float
    weakest: float
    there: NDArray[np.bool_]


def few_in_turn(y: Array, u: Array, run: NDArray[np.int64], temperature: Array) -> Few | None:
    """The few power-ons in turn whose leans differ most; None where none differ by most of what there is.

    y, u: (n, 3) readings and references of accelerometers at rest, run by run; run: (n,) 0 … runs − 1
    Asked again by the attitudes that others have too: what a face of its own adds is no lean.
    """
    runs = int(run.max(initial=-1)) + 1
    sets = _sets(runs)
    if runs < LEAST_OTHERS + SIDE or len(sets) == 0:
        return None
    first = _each(y, u, run, temperature, sets)
    place = int(np.argmin(first[0].sum(axis=0)))
    there = sets[place]
    _, face = alike(np.round(u / (SAME_FACE * STANDARD_GRAVITY_MPS2)))
    kept = np.isin(face, np.intersect1d(face[there[run]], face[~there[run]]))
    number, again = np.unique(run[kept], return_inverse=True)
    mine = there[number]
    if np.count_nonzero(mine) < SIDE or np.count_nonzero(~mine) < LEAST_OTHERS:
        return None
    log, left = _each(y[kept], u[kept], again, temperature[kept], mine[None, :])
    if left.max() > LEFT_OVER:
        return None
    places = np.log(len(sets))
    return Few(float(log.sum() + places), float(log.max() + places), there)


def _sets(runs: int) -> NDArray[np.bool_]:
    """(w, runs) a few power-ons in turn, neither the first nor the last."""
    spans = [
        (a, b)
        for a in range(1, runs - SIDE)
        for b in range(a + SIDE, min(a + LONGEST, runs - 1) + 1)
        if runs - (b - a) >= LEAST_OTHERS
    ]
    order = np.arange(runs)
    return np.array([(order >= a) & (order < b) for a, b in spans], dtype=bool).reshape(-1, runs)


def _each(
    y: Array, u: Array, run: NDArray[np.int64], temperature: Array, sets: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """(3, w) log p of every channel, and (3, w) the share of its gain that is left over."""
    mean = np.bincount(run, temperature) / np.bincount(run)
    p = _curve(mean, temperature_nodes(temperature))
    both = [_channel(y[:, a], u, a, run, p, sets) for a in range(3)]
    return np.array([log for log, _ in both]), np.array([left for _, left in both])


def _curve(mean: Array, nodes: Array) -> Array:
    """(g, k) a parabola over the temperatures of power-ons; one constant each where these are few."""
    if len(nodes) < LEAST_TEMPERATURES:
        return np.asarray(np.eye(len(nodes))[np.argmin(np.abs(mean[:, None] - nodes), axis=1)])
    x = (mean - mean.mean()) / max(float(np.ptp(mean)), 1e-9)
    return np.stack([np.ones_like(x), x, x**2], axis=1)


def _channel(
    y: Array, u: Array, axis: int, run: NDArray[np.int64], p: Array, sets: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """(w,) log p of one channel and what is left over of its gain."""
    x = leans_of_each(y, u, axis, run)
    A, h, k = x.gram[:, :2, :2], x.gram[:, :2, 2], 2 * p.shape[1]
    along = np.einsum("gp,gij->gpij", p, A)
    value, vector = np.linalg.eigh(np.einsum("gq,gpij->qjpi", p, along).reshape(k, k))
    told = value > RANK * value.max()
    way = (vector[:, told] / value[told]) @ vector[:, told].T
    v = np.einsum("gp,gi->pi", p, h).ravel()
    W = sums_over(sets, along).reshape(len(sets), k, 2)
    gram = sums_over(sets, A) - np.einsum("sqi,qr,srj->sij", W, way, W)
    rest = sums_over(sets, h) - np.einsum("sqi,qr,r->si", W, way, v)
    value, vector = np.linalg.eigh(gram)
    seen = value > x.least
    square = np.einsum("sij,si->sj", vector, rest) ** 2
    gain = np.sum(np.where(seen, square / np.where(seen, value, 1.0), 0.0), axis=1)
    m, freedom = seen.sum(axis=1), x.dims.sum() - int(told.sum()) - seen.sum(axis=1)
    left = np.maximum(x.each.sum() - float(v @ way @ v) - gain, 0.0)
    log = np.zeros(len(sets))
    for i in np.flatnonzero((m > 0) & (freedom > 0) & (x.rows > 0)).tolist():
        s2 = max(float(left[i]) / float(freedom[i]), x.within, 1e-300)
        log[i] = float(log_p(float(gain[i]), int(m[i]), float(freedom[i]), s2))
    return log, left / np.maximum(gain, 1e-300)
