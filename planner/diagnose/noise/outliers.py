"""Rows of a channel that are no readings of this campaign: spikes, a wrong file, a hand on the table.

How far a row may lie is asked of the rows themselves: in units of what drives the noise of each (REML under
the declared model) the middle of their residuals gives the scale, the ratio of two quantiles the tails
(Student's t), and a row is left out
that one campaign in fifty would have by chance under that law. What many records of one condition have in
common is a structure, not an accident, and stays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.channels.orthogonal import clear
from planner.diagnose.noise.components import finest
from planner.diagnose.noise.whitened import SEEN
from planner.nouns.array import Array
from planner.solvers.distributions import student_quantile
from planner.solvers.group_batches import sums_of_groups
from planner.solvers.least_squares import Factors, factors
from planner.solvers.triangles import inverse_of_triangle

FAR_WEIGHT = 1e-4  # of such a row: 40 sigma then count as 0.4
CHANCE = 0.02  # rows a channel and campaign that are left out by chance
LEAST_FAR = 5.0  # sigma: no channel has so few rows that less would be far
MIDDLE, OUTER = (
    0.68,
    0.95,
)  # the quantiles whose ratio tells the tails; accidents are fewer than one in twenty
UNSURE = 2.0  # over √n: a standard error and more of that ratio, to the side on which fewer rows go
NORMAL_MIDDLE = 0.99446  # sigma, within which that share of a normal law lies
ALIKE = 0.5  # share of a condition's rows, in two power-ons or more, from which they are no accidents
LEAST_ROWS = 20
FEWEST = 2  # rows of a power-on, of which no mean is taken off: one of them would be nothing then
ROUNDS = 4
STEPS = 30  # of leaving out rows: each takes those within half of the largest, 1e9 to 1
MOST_FAR = 0.1  # share of the rows that may be left out at first sight: beyond it nothing stands out
LEAST_FREE = 0.03  # of a row's variance that the fit leaves: of less nothing is told about the row
MOST_TAKEN = 0.97  # of a row's variance by the fit: of one that takes more nothing is left that tells
SINGULAR = 1e-6  # of the largest combination of rows left out, below which the others do not tell one
FEW_FAR = 60  # rows left out, up to which the fit of all rows says what the others leave
LEAST_TOLD = 0.1  # of every combination of them that the fit of all rows must leave
MOST_MOVED = 100.0  # of what is left, by which they may have moved another row
NOTHING = 1e-9  # of a column's length, below which what is left about the means of power-ons is rounding
PROJECTED = 2  # times, for a basis that is orthonormal to 1e-4
OUTSIDE = 1e-3  # share of a row's columns that the rows seen may not determine, beyond which it is not judged


@dataclass(frozen=True)
class Far:
    """rows: (n,) that are left out; size: (n,) of every row, in sigma."""

    rows: NDArray[np.bool_]
    size: Array


def outliers(
    c: Channel,
    candidates: Array,
    starts: NDArray[np.int64],
    spread: Array,
    cells: NDArray[np.int64] | None = None,
    scatter: Array | float = 0.0,
    draws: Array | None = None,
    shared: Array | None = None,
) -> Far:
    """Rows that lie far off even where every candidate may bend, about the means of power-ons.

    spread: (n,) what the noise of the rows is in proportion to; cells: (n,) number of each row's condition
    scatter: (n,) one sigma, in the reading's unit, by which a row may be off beside its noise and stay
    draws: (n, t) the same of each term that every power-on draws anew, so that its rows are off together
    shared: (n,) one sigma of what a row has in common with its power-on, by the noise; None: nothing
    """
    n = len(c.r)
    least = _least_scale(c, starts, spread, shared)
    far = np.zeros(n, dtype=bool)
    if n < LEAST_ROWS:
        return Far(far, np.zeros(n))
    columns, size = np.column_stack([c.J, candidates]), np.zeros(n)
    columns /= spread[:, None]
    r = c.r / spread
    about = _within(columns, r, starts, ~far)
    found = factors(about[0], SEEN, roughly=True)
    left, freedom = _left(*about, ~far, found)
    far = largest_first(found.basis, about[1], starts)
    known = {bytes(len(far)): (left, freedom)}  # rows left out -> the fit: rounds come back to the same ones
    whole: Array | None = found.basis
    for _ in range(ROUNDS):
        key = far.tobytes()
        fit = known.get(key) or (None if whole is None else _without(whole, about[1], starts, far))
        left, freedom = fit or _left(*_within(columns, r, starts, ~far), ~far)
        known[key] = left, freedom
        if freedom < (~far).sum() / 4.0:
            known.clear()  # of other columns
            columns = c.J / spread[:, None]
            if whole is not None:  # beside so many columns nothing stood out: it may beside these
                about = _within(columns, r, starts, np.ones(n, dtype=bool))
                far = largest_first(factors(about[0], SEEN, roughly=True).basis, about[1], starts)
            whole = None
            left, _ = _left(*_within(columns, r, starts, ~far), ~far)
        size = _sigma(left, starts, least)
        now = size > max(LEAST_FAR, _farthest(size))
        if cells is not None:
            now &= ~_structure(now, cells, starts)
        if np.array_equal(now, far):
            break
        far = now
    if far.any():
        far = far & (_sigma(left, starts, least, scatter / spread) > LEAST_FAR)
    if far.any() and draws is not None:
        far &= _beyond_draws(left, draws / spread[:, None], _scale(left, starts, least), starts, far)
    return Far(far, size)


def largest_first(basis: Array, r: Array, starts: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n,) rows that stand out, found by leaving out the largest, then what is largest without them, …

    All at once would not do: a far row bends the fit, and among those that it drags along it may be hidden.
    basis: (n, k) orthonormal columns about the means of power-ons; r: (n,) the reading about them. Rows D
    left out change the residual e by H_D (1 − H_DD)⁻¹ e_D, H of columns and means together (Cook, Weisberg,
    Residuals and Influence in Regression, 1982, 3.4).
    """
    sizes = np.diff(np.append(starts, len(r)))
    run = np.repeat(np.arange(len(starts)), sizes)
    of_mean = np.where(sizes > FEWEST, 1.0 / sizes, 0.0)[run]
    share = np.einsum("nk,nk->n", basis, basis) + of_mean
    e = clear(basis, r)
    left, free, far = e, 1.0 - share, np.zeros(len(r), dtype=bool)
    d, H = np.empty(0, dtype=np.int64), np.empty((len(r), 0))
    for _ in range(STEPS):
        size = np.where(far, 0.0, np.abs(left) / np.sqrt(np.maximum(free, LEAST_FREE)))
        scale = float(np.quantile(size[~far], MIDDLE)) / NORMAL_MIDDLE
        now = (size > max(LEAST_FAR * scale, size.max() / 2.0)) & (free > LEAST_FREE)
        if not now.any() or np.count_nonzero(far | now) > MOST_FAR * len(r):
            break
        far |= now
        more = np.flatnonzero(now)
        same = np.where(run[:, None] == run[more], of_mean[:, None], 0.0)
        d, H = np.append(d, more), np.column_stack([H, basis @ basis[more].T + same])
        turned = H @ _inverse(np.eye(len(d)) - H[d])
        left = e + turned @ e[d]
        free = 1.0 - share - np.einsum("nd,nd->n", turned, H)
    return far


def _inverse(A: Array) -> Array:
    """A⁺ of a symmetric A (d, d) whose eigenvalues are between zero and one.

    By Cholesky's factor L where nothing of it counts as zero: the trace of A⁻¹ = L⁻ᵀL⁻¹ is more than its
    largest eigenvalue.
    """
    try:
        root = inverse_of_triangle(np.linalg.cholesky(A))
        if np.sum(root**2) < 0.1 / SINGULAR:
            return np.asarray(root.T @ root)
    except np.linalg.LinAlgError:
        pass
    return np.asarray(np.linalg.pinv(A, rcond=SINGULAR, hermitian=True))


def _without(
    basis: Array, r: Array, starts: NDArray[np.int64], far: NDArray[np.bool_]
) -> tuple[Array, float] | None:
    """What `_left` says with rows D left out, from the fit of all: a tenth of the work of fitting anew.

        e + H_D G e_D,   H + H_D G H_Dᵀ,   G = (1 − H_DD)⁻¹

    basis, r: as in `largest_first`. None where they are many, or the others tell one of them or the rest of a
    power-on badly: a basis that is orthonormal to 1e-4 is not enough then.
    """
    sizes, d = np.diff(np.append(starts, len(r))), np.flatnonzero(far)
    run = np.repeat(np.arange(len(starts)), sizes)
    counts = np.bincount(run, ~far)
    if not 0 < len(d) <= FEW_FAR or ((counts == 0) & (sizes > FEWEST)).any():
        return None
    mean, seen_mean = (np.where(sizes > FEWEST, 1.0 / np.maximum(m, 1), 0.0)[run] for m in (sizes, counts))
    H = basis @ basis[d].T + np.where(run[:, None] == run[d], mean[:, None], 0.0)
    value, vector = np.linalg.eigh(np.eye(len(d)) - H[d])
    if value[0] < LEAST_TOLD:
        return None
    G = (vector / value) @ vector.T
    e, turned = clear(basis, r), H @ G
    moved = turned @ e[d]
    left = e + moved
    if np.abs(moved[~far]).max(initial=0.0) > MOST_MOVED * np.std(left[~far]):
        return None
    share = np.einsum("nk,nk->n", basis, basis) + mean + np.einsum("nd,nd->n", turned, H) - seen_mean
    left[~far] /= np.sqrt(1.0 - np.minimum(share[~far], MOST_TAKEN))
    left[d] /= np.sqrt(np.maximum(np.diag(G) - seen_mean[d], 1.0))
    return left, float(np.count_nonzero(~far) - share[~far].sum())


def _farthest(size: Array) -> float:
    """Beyond what of n rows of Student's t there are CHANCE; t's freedom by the ratio of two quantiles."""
    ratio = float(np.quantile(size, OUTER)) / max(float(np.quantile(size, MIDDLE)), 1e-12)
    ratio *= 1.0 + UNSURE / np.sqrt(len(size))
    nus = np.array([1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0, 20.0, 1e3])
    middle = student_quantile(0.5 + MIDDLE / 2.0, nus)
    ends = student_quantile(0.5 + OUTER / 2.0, nus) / middle
    nu = float(np.interp(-ratio, -ends, nus))
    unit = float(np.quantile(size, MIDDLE)) / student_quantile(0.5 + MIDDLE / 2.0, nu)
    return float(-student_quantile(CHANCE / len(size) / 2.0, nu) * unit)


def _structure(
    far: NDArray[np.bool_], cells: NDArray[np.int64], starts: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(n,) rows of a condition of which most are far, in more than one power-on."""
    run = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(cells))))
    count, bad = np.bincount(cells), np.bincount(cells, far)
    pairs = np.unique(np.column_stack([cells[far], run[far]]), axis=0)
    runs = np.bincount(pairs[:, 0], minlength=len(count)) if len(pairs) else np.zeros(len(count))
    return np.asarray(((bad >= ALIKE * count) & (runs > 1))[cells])


def _left(
    columns: Array, r: Array, seen: NDArray[np.bool_], found: Factors | None = None
) -> tuple[Array, float]:
    """(n,) what least squares over the rows seen leaves, at its full size, and the degrees of freedom.

    A row that the fit has not seen is off by the fit's own error as well, √(1 + h) of the noise; nothing is
    left of one of which the others do not tell what it should be, as of the only one in an attitude.
    """
    found = found or factors(columns[seen], SEEN, roughly=True)
    share, left = np.einsum("nk,nk->n", found.basis, found.basis), r
    for _ in range(PROJECTED):
        left = left - columns @ (found.to_coefficients @ (found.basis.T @ left[seen]))
    left[seen] /= np.sqrt(1.0 - np.minimum(share, MOST_TAKEN))
    if not seen.all():
        others = columns[~seen]
        left[~seen] /= np.sqrt(1.0 + np.sum((others @ found.to_coefficients) ** 2, axis=1))
        scaled = others / found.scale
        outside = np.linalg.norm(scaled @ found.null_space, axis=1)
        left[~seen] *= outside <= OUTSIDE * np.linalg.norm(scaled, axis=1)
    return left, float(seen.sum() - share.sum())


def _within(
    columns: Array, r: Array, starts: NDArray[np.int64], seen: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """(n, k) columns and (n,) reading about their means over the rows seen of each power-on.

    A column that is one value a power-on is nothing then: scaled up, what rounding leaves of it would explain
    a random share of every reading.
    """
    A, sizes = np.column_stack([columns, r]), np.diff(np.append(starts, len(r)))
    counted = A if seen.all() else A * seen[:, None]
    length = np.sqrt(np.einsum("nk,nk->k", counted, A))
    counts = np.maximum(np.add.reduceat(seen.astype(float), starts), 1.0)
    means = sums_of_groups(counted, starts) / counts[:, None]
    A -= np.repeat(np.where(sizes[:, None] > FEWEST, means, 0.0), sizes, axis=0)
    about = A if seen.all() else A[seen]
    rounding = np.sqrt(np.einsum("nk,nk->k", about, about)) <= NOTHING * length
    if rounding.any():
        A[:, rounding] *= ~seen[:, None]
    some = ~rounding[:-1]
    some[~some] = A[~seen][:, :-1][:, ~some].any(axis=0)
    return A[:, :-1] if some.all() else A[:, :-1][:, some], A[:, -1]


def _beyond_draws(
    left: Array, draws: Array, scale: Array, starts: NDArray[np.int64], far: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """(n,) far rows that are far too from what the others of their power-on say that it drew.

        e_f − D_f m,   m = (I + D_oᵀ D_o)⁻¹ D_oᵀ e_o,   variance 1 + D_f (I + D_oᵀ D_o)⁻¹ D_fᵀ

    D (n, t) draws of one sigma and e (n,) the rest, about their means over the others o of the power-on, in
    units of the rows' scale (n,).
    """
    out = far.copy()
    D, e = draws / scale[:, None], left / scale
    for mine in np.split(np.arange(len(left)), starts[1:]):
        f, o = mine[far[mine]], mine[~far[mine]]
        if not len(f):
            continue
        mean = D[o].mean(axis=0) if len(o) else 0.0
        here, there = D[o] - mean, D[f] - mean
        A = np.linalg.inv(np.eye(D.shape[1]) + here.T @ here)
        expected = there @ (A @ (here.T @ e[o]))
        variance = 1.0 + np.einsum("ft,ts,fs->f", there, A, there)
        out[f] = np.abs(e[f] - expected) > LEAST_FAR * np.sqrt(variance)
    return out


def _sigma(left: Array, starts: NDArray[np.int64], least: Array, scatter: Array | float = 0.0) -> Array:
    """(n,) sizes in robust sigma: rows in units of what drives their noise, on the scale of their middle."""
    return np.asarray(_about(left, starts) / np.hypot(_scale(left, starts, least), scatter))


def _about(left: Array, starts: NDArray[np.int64]) -> Array:
    """(n,) sizes of what is left; a mean of m rows took one of m degrees of freedom."""
    sizes = np.diff(np.append(starts, len(left)))
    counted = np.where(sizes > FEWEST, np.sqrt(1.0 - 1.0 / np.maximum(sizes, FEWEST)), 1.0)
    return np.asarray(np.abs(left) / np.repeat(counted, sizes))


def _scale(left: Array, starts: NDArray[np.int64], least: Array) -> Array:
    """(n,) one sigma of what is left: of the middle row, and never less than `_least_scale`."""
    return np.asarray(np.maximum(float(np.quantile(_about(left, starts), MIDDLE)) / NORMAL_MIDDLE, least))


def _least_scale(c: Channel, starts: NDArray[np.int64], spread: Array, shared: Array | None) -> Array:
    """(n,) no row is told to less than this: than a reading can be, and, where it has all that its power-on

    drew still in it (no mean is taken off one or two rows), than that and its noise together. Among thousands
    of rows about the means of theirs a few alone in their power-ons were all far, by their levels.
    """
    told = finest(c) / spread
    if shared is None:
        return told
    sizes = np.diff(np.append(starts, len(spread)))
    whole = np.repeat(sizes <= FEWEST, sizes) & (shared > 0.0)
    return np.where(whole, np.maximum(told, np.hypot(1.0, shared / spread)), told)
