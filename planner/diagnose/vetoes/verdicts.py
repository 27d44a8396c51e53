"""The evidence's veto: what is believed must predict power-ons that it has not seen, and rest on several.

In whitened rows clear of the declared model and of all else that is believed, C the block's columns, z what
is left:  γ₋ₖ = (Σ_{j≠k} CⱼᵀCⱼ)⁺ Σ_{j≠k} Cⱼᵀzⱼ  over all power-ons but those of fold k, and

    gain = Σ_k |z_k|² − |z_k − C_k γ₋ₖ|² > 0,     Δ without any one power-on still significant (`_rests_on`)

and of one coefficient the power-ons themselves must not scatter about it as if it were none:

    t = Σ_k hₖ / √(Σ_k (hₖ − gₖ γ)²),  hₖ = Cₖᵀzₖ, gₖ = CₖᵀCₖ  (Liang, Zeger, Biometrika 73, 1986)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.diagnose.channels.orthogonal import clear, explained, orthonormal
from planner.diagnose.channels.unseen_runs import branches
from planner.diagnose.hypotheses.candidates import follows_any_drift
from planner.diagnose.hypotheses.found import SINGLE, Found
from planner.diagnose.hypotheses.pool import Pool, inverse
from planner.diagnose.hypotheses.scores import Score, score
from planner.diagnose.noise.whitened import SEEN, log_p
from planner.diagnose.vetoes.few_records import a_few_records_explain
from planner.nouns.array import Array
from planner.solvers.distributions import chi_square_tail, student_tail

FOLDS = 5  # the usual number: Hastie, Tibshirani, Friedman, Elements of Statistical Learning, 7.10
LEAST_RUNS = 3  # power-ons, below which none can be left out
OF_A_TABLE = (
    0.5  # of what a table explains: its many values follow struck rows, a true one predicts 0.7 of it
)
FOLLOWS_DRIFT = ("time_on_and_temperature",)  # without a name: what wanders within power-ons looks like it
MOVED = ("rate", "specific_force", "orientation", "rate_and_specific_force")  # set record by record
LEAST_OF_SCATTER = 8.0  # power-ons that tell a coefficient, from which their scatter is one
ALONE = "it rests on one power-on alone"
MOSTLY = 0.5  # of what is explained, less of which the others have: then their fit is made without that one
A_FEW = "a few records, each off by itself, explain it as well"
SCATTERS = "the power-ons scatter about it by more than their noise"
AGREE = 0.01  # p of the others alone, and of a power-on that is as they are
TAIL = 1e-3  # of a block's square that power-ons may have and still count as telling nothing of it


@dataclass(frozen=True)
class Veto:
    """Why a block does not stand; run: the power-on on which it rests alone, or −1."""

    block: int
    why: str
    run: int = -1


def vetoed(found: Found, b: int, starts: NDArray[np.int64]) -> Veto | None:
    """The veto of the power-ons on a believed block; None where it stands, or where they are too few."""
    if len(starts) < LEAST_RUNS:
        return None
    here = found.without(b, *_tables_beside(found, b))
    gram, h = per_power_on(here, [b], starts)
    one = told_by_branches(here, b, starts)
    if one >= 0:
        return _by_branches(found, here, b, starts, one) or _by_records(found, b)
    s = score(here, [b]) if is_table(found, b) else found.share(b)
    worst, least, repeats = _without_the_worst(found, here, b, starts, s)
    if s.m and not repeats and _rests_on(gram, h, worst, float(log_p(least, s.m, s.freedom, s.s2))):
        return Veto(b, ALONE, int(worst))
    if not here.blocks[b].generic and _scatter(gram, h) > SINGLE:
        return Veto(b, SCATTERS)
    few = _by_records(found, b)
    if few is not None:
        return few
    wanders = here.blocks[b].name in FOLLOWS_DRIFT
    least_gain = OF_A_TABLE * score(here, [b]).delta if wanders or is_table(found, b) else 0.0
    must = wanders or not here.blocks[b].generic
    if must and len(_telling(gram)) >= LEAST_RUNS and predicted(gram, h) <= least_gain:
        return Veto(b, "it does not predict power-ons that its fit has not seen")
    return None


def repeats_in_one(found: Found, b: int, starts: NDArray[np.int64]) -> bool:
    """Whether one power-on alone can tell a block, and its own records repeat what they say of it."""
    here = found.without(b)
    return _without_the_worst(found, here, b, starts, score(here, [b]))[2]


def _without_the_worst(
    found: Found, here: Pool, b: int, starts: NDArray[np.int64], s: Score
) -> tuple[int, float, bool]:
    """The power-on without which least is explained, how much that is, and `repeats_in_one`.

    Others can tell a block where they had shown it, were it as large as all together say: γᵀ G γ.
    """
    gram, h = per_power_on(here, [b], starts)
    worst, least = _without_one(gram, h, _telling(gram))
    G, H = gram.sum(axis=0), h.sum(axis=0)
    if worst < 0 or least >= MOSTLY * _square(G, H):
        return worst, least, False
    rows = _rows_of(starts, worst, here)
    others, seen = _fitted_without(found, here, b, rows)
    gamma = inverse(G) @ H
    shown = float(log_p(float(gamma @ others @ gamma), max(s.m, 1), s.freedom, s.s2)) <= np.log(AGREE)
    repeats = not shown and _repeats_within(found, here, b, rows, s)
    return worst, _square(others, seen), repeats


def _telling(gram: Array) -> NDArray[np.int64]:
    """Places of the power-ons that tell a block at all."""
    told = np.trace(gram, axis1=1, axis2=2)
    return np.flatnonzero(told > TAIL / len(gram) * told.sum())


def told_by_branches(here: Pool, b: int, starts: NDArray[np.int64]) -> int:
    """The power-on that alone has what a block goes with, and in which the temperature turns; or −1.

    The block's own columns say it: clear of curves over temperature every power-on has a share of them.
    """
    squares = [
        np.add.reduceat(np.square(x), starts, axis=0) for x in here.blocks[b].columns.values() if x.size
    ]
    each = np.column_stack(squares) if squares else np.empty((len(starts), 0))
    each = each[:, each.any(axis=0)]
    most = each.argmax(axis=0)
    if not len(most) or np.any(most != most[0]):
        return -1
    one = int(most[0])
    alone = bool(np.all(each[one] >= (1.0 - TAIL) * each.sum(axis=0)))
    return one if alone and _branches_of(here, _rows_of(starts, one, here)).max() > 0 else -1


def _branches_of(here: Pool, rows: slice) -> NDArray[np.int64]:
    """(rows,) number of the branch of the temperature, from 0."""
    temperature = next(iter(here.state.values())).channel.model.conditions.temperature_degc
    return branches(temperature[rows])


def _by_records(found: Found, b: int) -> Veto | None:
    if a_few_records_explain(found, b):
        return Veto(b, A_FEW)
    return None


def _by_branches(found: Found, here: Pool, b: int, starts: NDArray[np.int64], run: int) -> Veto | None:
    """The veto on what one power-on alone can tell: a chamber went up and down in it, and in no other.

    The others neither say it nor deny it. Each branch of the temperature, with coefficients of its own beside
    those of the rest, must say it by itself, and a name's must predict the others', as those of power-ons
    must where several tell it: a table has values that go with one branch alone.
    """
    rows = _rows_of(starts, run, here)
    branch = np.full(len(next(iter(here.state.values())).z), -1)
    branch[rows] = _branches_of(here, rows)
    s, last = found.share(b), int(branch.max())
    for part in range(last + 1):
        delta, rank = _of_rows(found, b, branch == part)
        if log_p(delta, rank, s.freedom, s.s2) > np.log(SINGLE):
            return Veto(b, ALONE, run)
    if here.blocks[b].generic:
        return None
    firsts = rows.start + np.append(0, np.flatnonzero(np.diff(branch[rows])) + 1)
    parts = np.unique(np.concatenate([starts, firsts]))
    squares = [np.add.reduceat(np.square(x), parts, axis=0) for x in here.blocks[b].columns.values()]
    if any(np.any(each.max(axis=0) > (1.0 - TAIL) * each.sum(axis=0)) for each in squares):
        return Veto(b, ALONE, run)  # a coefficient that no other branch has
    gram, h = (x[np.isin(parts, firsts)] for x in per_power_on(here, [b], parts))
    alike = predicted(gram, h) > OF_A_TABLE * _square(gram.sum(axis=0), h.sum(axis=0))
    return None if alike else Veto(b, ALONE, run)


def _of_rows(found: Found, b: int, mine: NDArray[np.bool_]) -> tuple[float, int]:
    """Δ of a block's columns in some rows (n,), beside the same in the others and all else; their rank."""
    pool, total, ranks = found.pool, 0.0, 0
    for axis, x in pool.blocks[b].columns.items():
        w = pool.state[axis]
        others = [pool.blocks[o].columns[axis] for o in found.all if o != b and axis in found.axes(o)]
        beside = w.noise.whiten(np.column_stack([x * ~mine[:, None], *others]))
        delta, rank = explained(np.column_stack([w.Q, beside]), w.noise.whiten(x * mine[:, None]), w.z, SEEN)
        total, ranks = total + delta, ranks + rank
    return total, ranks


def is_table(found: Found, b: int) -> bool:
    """Whether a block is a table of many values over what changes within a power-on."""
    block = found.pool.blocks[b]
    known = not block.generic and not block.reference
    return known and follows_any_drift(catalog.effects()[block.name])


def _tables_beside(found: Found, b: int) -> list[int]:
    """Other tables on a table's channels: two that follow one struck row each make the other look sound."""
    if not is_table(found, b):
        return []
    return [i for i in found.on(found.axes(b)) if i != b and is_table(found, i)]


def per_power_on(here: Pool, blocks: Sequence[int], starts: NDArray[np.int64]) -> tuple[Array, Array]:
    """(g, k, k) CᵀC and (g, k) Cᵀz of every power-on, C the columns of blocks on the same channels."""
    k = np.concatenate([here.places[b] for b in blocks])
    gram, h = np.zeros((len(starts), len(k), len(k))), np.zeros((len(starts), len(k)))
    for axis in here.blocks[blocks[0]].columns:
        C, z = here.seen(axis, k), here.remainder(axis)
        gram += np.add.reduceat(C[:, :, None] * C[:, None, :], starts)
        h += np.add.reduceat(C * z[:, None], starts)
    return gram, h


def _without_one(gram: Array, h: Array, told: NDArray[np.int64]) -> tuple[int, float]:
    """The power-on without which least is explained, and how much that is."""
    if len(told) == 0:
        return -1, 0.0
    G, H = gram.sum(axis=0), h.sum(axis=0)
    left = [_square(G - gram[r], H - h[r]) for r in told]
    worst = int(np.argmin(left))
    return int(told[worst]), float(left[worst])


def _rows_of(starts: NDArray[np.int64], run: int, here: Pool) -> slice:
    """Rows of a power-on."""
    n = len(next(iter(here.state.values())).z)
    return slice(int(starts[run]), int(starts[run + 1]) if run + 1 < len(starts) else n)


def _fitted_without(found: Found, here: Pool, b: int, rows: slice) -> tuple[Array, Array]:
    """(k, k) CᵀC and (k,) Cᵀz of a block, neither what is declared nor believed fitted to rows.

    What is off in a record of them bends the declared curves, and others at that temperature seem to follow.
    """
    k = here.places[b]
    others = here.columns(i for i in found.all if i != b)
    G, H = np.zeros((len(k), len(k))), np.zeros(len(k))
    for axis in here.blocks[b].columns:
        w, kept = here.state[axis], np.ones(len(here.state[axis].z), dtype=bool)
        kept[rows] = False
        beside = here.parts[axis][:, np.isin(here.axes[axis], others)]
        basis = orthonormal(np.column_stack([w.Q, beside])[kept], SEEN)
        C, z = clear(basis, here.seen(axis, k)[kept]), clear(basis, w.z[kept])
        G, H = G + C.T @ C, H + C.T @ z
    return G, H


def _repeats_within(found: Found, here: Pool, b: int, rows: slice, s: Score) -> bool:
    """Whether records of one power-on say the same of what has no name and goes with how the unit moved.

    Where one power-on alone turns about an axis no other can say what its rate does, and none contradicts.
    But at 20 deg/s either way, and at 40 as between 20 and 60, its records repeat each other. Some bins or
    curve over the variable must predict half of what the declared model, and a level of the power-on, leave
    of every fifth of them, fitted to all other rows; more than chance does for a single test. What time or
    temperature makes of one power-on is that one's own course, and repeats itself as well.
    """
    block = here.blocks[b]
    if not block.generic or block.name not in MOVED or len(block.columns) > 1:
        return False
    (axis,) = block.columns
    w, inside = here.state[axis], np.arange(rows.start, rows.stop)
    level = np.zeros((len(w.z), 1))
    level[inside] = 1.0
    believed = here.parts[axis][:, np.isin(here.axes[axis], here.columns(found.others(b)))]
    beside = np.column_stack([w.Q, believed, w.noise.whiten(level)])
    same = [i for i, x in enumerate(here.blocks) if x.generic and x.key == block.key]
    plain = _press(beside, w.z, inside)
    each = (_press(np.column_stack([beside, here.seen(axis, here.places[i])]), w.z, inside) for i in same)
    least = min(each, default=plain)
    gain = plain - least
    return gain >= OF_A_TABLE * plain and bool(log_p(gain, 1, s.freedom, s.s2) <= np.log(SINGLE))


def _press(columns: Array, z: Array, inside: NDArray[np.int64]) -> float:
    """Square of what a fit of columns (n, k) to all other rows leaves of each fold of some rows of z (n,)."""
    fold, total = np.arange(len(inside)) % FOLDS, 0.0
    for f in range(FOLDS):
        out = inside[fold == f]
        kept = np.ones(len(z), dtype=bool)
        kept[out] = False
        x = np.linalg.lstsq(columns[kept], z[kept], rcond=SEEN)[0]
        total += float(np.sum((z[out] - columns[out] @ x) ** 2))
    return total


def _rests_on(gram: Array, h: Array, run: int, others: float) -> bool:
    """Whether an effect is one power-on's; others: log p of what is explained without it.

    Of a faint effect any power-on carries much. One that is as the others say, by

        δᵀ (G + G G₋⁺ G)⁺ δ,   δ = h − G γ₋     (χ² of its rank; G₋, γ₋ of the others)

    takes nothing from it, as long as the others still say so by themselves.
    """
    if others <= np.log(SINGLE):
        return False
    if others > np.log(AGREE) or run < 0:
        return True
    G, left = gram[run], inverse(gram.sum(axis=0) - gram[run])
    off = h[run] - G @ left @ (h.sum(axis=0) - h[run])
    rank = int(np.linalg.matrix_rank(G, hermitian=True))
    return bool(chi_square_tail(float(off @ inverse(G + G @ left @ G) @ off), rank) < AGREE)


def _scatter(gram: Array, h: Array) -> float:
    """p of a single coefficient by the power-ons' own scatter about it; 0 where too few of them tell it.

    What wanders slowly within power-ons, always in the same order of faces, is no white noise.
    """
    g = gram[:, 0, 0]
    if gram.shape[1] != 1 or not g.any():
        return 0.0
    effective = float(g.sum() ** 2 / np.sum(g**2))
    if effective < LEAST_OF_SCATTER:
        return 0.0
    about = h[:, 0] - g * (h.sum() / g.sum())
    t = abs(float(h.sum())) / max(float(np.linalg.norm(about)), 1e-300)
    return float(2.0 * student_tail(t, effective - 1.0))


def predicted(gram: Array, h: Array) -> float:
    """How much less is left of the folds' squares when the other folds' coefficients are taken off.

    gram: (g, k, k) CᵀC and h: (g, k) Cᵀz of every power-on
    Coefficients are drawn to zero as far as their own size says, γ ~ N(0, Δ / m) a column of length one: a
    node that the other folds hardly reach is not extrapolated to.
    """
    fold = np.arange(len(gram)) % min(FOLDS, len(gram))
    G, H = gram.sum(axis=0), h.sum(axis=0)
    drawn = np.diag(np.diag(G)) * len(H) / max(_square(G, H), len(H))
    total = 0.0
    for f in range(int(fold.max()) + 1):
        Gk, hk = gram[fold == f].sum(axis=0), h[fold == f].sum(axis=0)
        gamma = inverse(G - Gk + drawn) @ (H - hk)
        total += float(2.0 * hk @ gamma - gamma @ Gk @ gamma)
    return total


def _square(G: Array, h: Array) -> float:
    return float(h @ inverse(G) @ h)
