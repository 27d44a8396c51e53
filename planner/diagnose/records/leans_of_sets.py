"""Whether the leans of some power-ons are those of another unit, beside leans that go with temperature.

With A_g and h_g = A_g m_g what power-on g says of the two leans m of a channel (`leans_change`), a curve
c p(T) of them over the power-ons' temperatures, and δ of those in the set,

    Σ_g (m_g − c p(T_g) − δ [g in the set])ᵀ A_g (m_g − c p(T_g) − δ [g in the set]) → min,   p = (1, T, T²)

the gain of δ is held against what the leans still differ by. Of four temperatures or fewer each has leans of
its own. A few power-ons say hardly how leans scatter; then the three channels of a sensor say it together,

    ρ = Σ_a left_a / s_a² / Σ_a freedom_a,   s_a² the square of a row of channel a

since one mounting and one kind of element make all of them; and all but a tenth is explained, Σ left/s² being
small beside Σ gain/s²: one power-on of six that is off makes no two units.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.noise.whitened import log_p
from planner.diagnose.records.changed_power_ons import sums_over
from planner.diagnose.records.leans_change import leans_of_each
from planner.dwells.table_rows import alike
from planner.nouns.array import Array
from planner.temperature_table import temperature_nodes
from planner.units import STANDARD_GRAVITY_MPS2

LEAST_TEMPERATURES = 5  # from which a parabola leaves something of what is no parabola
FEW = 12.0  # degrees of freedom, below which the scatter of one channel is known to a fifth only
SAME_K = 3.0  # within which means of power-ons tell no slope of a lean
LEFT_OVER = 0.1  # of the gain, that leans may still differ by, where power-ons are few
SAME_FACE = 0.05  # of gravity: attitudes that others have too
RANK = 1e-6  # of the largest square


@dataclass(frozen=True)
class _Channel:
    """Of every set (w,): gain of leans over m columns, what is left over freedom; within: of a row."""

    gain: Array
    columns: NDArray[np.int64]
    left: Array
    freedom: NDArray[np.int64]
    within: float


def leans_of_sets(
    y: Array,
    u: Array,
    run: NDArray[np.int64],
    temperature: Array,
    sets: NDArray[np.bool_],
    axes: tuple[int, ...] = (0, 1, 2),
) -> tuple[Array, Array]:
    """(3, w) log p of every channel that a set's leans are the others', (3, w) share of the gain left over.

    y, u: (n, 3) readings and inputs, run by run; run: (n,) 0 … runs − 1; sets: (w, runs)
    """
    mean = np.bincount(run, temperature) / np.bincount(run)
    p = _curve(mean, temperature)
    sums = sums_over(sets)
    each = [_channel(y[:, a], u, a, run, p, sums) for a in axes]
    freedom = np.sum([c.freedom for c in each], axis=0)
    within = [max(c.within, 1e-300) for c in each]
    ratio = np.sum([c.left / w for c, w in zip(each, within, strict=True)], axis=0) / np.maximum(freedom, 1)
    gain = np.sum([c.gain / w for c, w in zip(each, within, strict=True)], axis=0)
    clearly = ratio * freedom <= LEFT_OVER * gain
    log = np.zeros((len(each), len(sets)))
    for k, c in enumerate(each):
        few = c.freedom < FEW
        s2 = np.where(few, ratio * within[k], c.left / np.maximum(c.freedom, 1))
        dof = np.where(few, freedom, c.freedom)
        told = (dof > 0) & (clearly | ~few)
        for m in range(1, int(c.columns.max(initial=0)) + 1):
            i = told & (c.columns == m)
            log[k, i] = log_p(c.gain[i], m, dof[i], np.maximum(s2[i], within[k]))
    return log, np.array([c.left / np.maximum(c.gain, 1e-300) for c in each])


def of_both(u: Array, there: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) rows at rest in attitudes that rows in the set (n,) and others have: u is (n, 3).

    What a face of its own adds is no lean.
    """
    _, face = alike(np.round(u / (SAME_FACE * STANDARD_GRAVITY_MPS2)))
    return np.isin(face, np.intersect1d(face[there], face[~there]))


def _curve(mean: Array, temperature: Array) -> Array:
    """(g, k) a parabola over the temperatures of power-ons; one constant each where these are few.

    Power-ons that all go through the same temperatures have the same mean, and one constant. Where each has a
    temperature of its own and they are few, a straight line: of bends all channels' leans say too little.
    """
    if np.ptp(mean) <= SAME_K:
        return np.ones((len(mean), 1))
    nodes = temperature_nodes(temperature)
    alone = len(nodes) == len(mean)
    if len(nodes) < LEAST_TEMPERATURES and not alone:
        return np.asarray(np.eye(len(nodes))[np.argmin(np.abs(mean[:, None] - nodes), axis=1)])
    x = (mean - mean.mean()) / max(float(np.ptp(mean)), 1e-9)
    return np.stack([np.ones_like(x), x, x**2][: 2 if len(nodes) < LEAST_TEMPERATURES else 3], axis=1)


def _channel(
    y: Array, u: Array, axis: int, run: NDArray[np.int64], p: Array, sums: Callable[[Array], Array]
) -> _Channel:
    x = leans_of_each(y, u, axis, run)
    A, h, k = x.gram[:, :2, :2], x.gram[:, :2, 2], 2 * p.shape[1]
    along = np.einsum("gp,gij->gpij", p, A)
    value, vector = np.linalg.eigh(np.einsum("gq,gpij->qjpi", p, along).reshape(k, k))
    told = value > RANK * value.max()
    way = (vector[:, told] / value[told]) @ vector[:, told].T
    v = np.einsum("gp,gi->pi", p, h).ravel()
    W = sums(along).reshape(-1, k, 2)
    gram = sums(A) - np.einsum("sqi,qr,srj->sij", W, way, W)
    rest = sums(h) - np.einsum("sqi,qr,r->si", W, way, v)
    value, vector = np.linalg.eigh(gram)
    seen = value > x.least
    square = np.einsum("sij,si->sj", vector, rest) ** 2
    gain = np.sum(np.where(seen, square / np.where(seen, value, 1.0), 0.0), axis=1)
    columns = seen.sum(axis=1)
    freedom = x.dims.sum() - int(told.sum()) - columns
    left = np.maximum(x.each.sum() - float(v @ way @ v) - gain, 0.0)
    usable = (x.rows > 0) & (freedom > 0)
    return _Channel(gain, np.where(usable, columns, 0), left, np.maximum(freedom, 0), x.within)
