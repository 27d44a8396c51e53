"""Sizes of what was found, with intervals; limits of what was not; rivals that the data cannot tell apart.

With S the believed columns, γ̂ = Gram_SS⁺ h_S / length, cov γ̂ = Gram_SS⁺ s² / length², and the freedom of each
coefficient is Satterthwaite's from how well REML knows the variances that it is made of.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.learn.diagnosis.candidates import Block, effect_blocks
from planner.learn.diagnosis.channels import Channel
from planner.learn.diagnosis.found import ALPHA, Found, free
from planner.learn.diagnosis.pool import Pool, extended, given, mean_square, satterthwaite, score
from planner.records import Array

CONFIDENCE = 0.95
DETERMINED = 1e-6  # of a coefficient's column that may lie in what the data do not see
NEAR = 10.0  # criterion units (odds of exp(5)) by which a rival may be worse and still be one
APART_SIGMA = 5.5  # an effect must explain that much beside its rival: the better of 30 alternatives won


@dataclass(frozen=True)
class Estimate:
    """One coefficient, SI, with its 95 % interval; one with an infinite interval is not determined."""

    block: int
    term: str
    value: float
    half: float
    freedom: float


def estimates(pool: Pool, believed: Sequence[int]) -> list[Estimate]:
    """Every named coefficient of the believed blocks, together."""
    from scipy.stats import t as student

    k = pool.columns(believed)
    if len(k) == 0:
        return []
    G = pool.gram[np.ix_(k, k)]
    inverse = np.asarray(np.linalg.pinv(G, rcond=1e-9, hermitian=True), dtype=float)
    seen = np.diag(inverse @ G)
    gamma = inverse @ pool.h[k]
    found, i = [], 0
    for b in believed:
        for term in pool.blocks[b].terms or [""] * len(pool.places[b]):
            column = k[i]
            if term:
                freedom, s2 = _freedom(pool, b, k, inverse[:, i])
                wide = float(student.ppf((1.0 + CONFIDENCE) / 2.0, freedom))
                ok = seen[i] > 1.0 - DETERMINED and pool.size[column] > 0
                size = pool.size[column] if ok else 1.0
                half = wide * np.sqrt(max(inverse[i, i], 0.0) * s2) / size if ok else np.inf
                found.append(Estimate(b, term, float(gamma[i] / size) if ok else 0.0, float(half), freedom))
            i += 1
    return found


def _freedom(pool: Pool, block: int, k: NDArray[np.int64], q: Array) -> tuple[float, float]:
    """Satterthwaite's freedom of a coefficient, the contrast q of the believed columns; its channels' s²."""
    total = float(q @ pool.gram[np.ix_(k, k)] @ q)
    R = pool.beside[:, k] @ q / np.sqrt(max(total, 1e-300))
    return satterthwaite(pool, pool.axes, R), max(mean_square(pool, [block]), 1.0)


@dataclass(frozen=True)
class Parameter:
    """A nonlinear parameter with its 95 % interval; wider: the pool with its derivative as block `block`."""

    name: str
    value: float
    low: float
    high: float
    freedom: float
    wider: Pool | None = None
    block: int = -1


def parameter_interval(
    found: Found, b: int, channels: Sequence[Channel], cuts: NDArray[np.int64], days: Array
) -> Parameter:
    """A nonlinear parameter by the derivative with respect to its logarithm.

    A step's day lies between two days of the table.
    """
    block = found.pool.blocks[b]
    ((name, value),) = block.nonlinear.items()
    if name == "day":
        before, after = days[days < value], days[days >= value]
        high = float(after.min()) if len(after) else 2.0 * value
        return Parameter(name, value, float(before.max(initial=value)), high, np.inf)
    derivative = _derivative(found, b, name, value, channels)
    pool = extended(found.pool, derivative, cuts)
    new = len(found.pool.blocks)
    (log,) = [e for e in estimates(pool, [*found.all, new]) if e.block == new]
    half = min(log.half, 10.0)
    ends = value * float(np.exp(-half)), value * float(np.exp(half))
    return Parameter(name, value, *ends, log.freedom, pool, new)


def _derivative(found: Found, b: int, name: str, value: float, channels: Sequence[Channel]) -> Block:
    """∂(γ G(τ))/∂ log τ at what was found, as a block of one column a channel."""
    block = found.pool.blocks[b]
    gamma = np.array([e.value for e in estimates(found.pool, found.all) if e.block == b])
    mine = [c for c in channels if c.axis in block.columns]
    step = 1e-3
    ends = []
    for sign in (1.0, -1.0):
        at = effect_blocks(mine, block.name, {name: value * float(np.exp(sign * step))})
        (same,) = [x for x in at if x.key == block.key]
        ends.append(same)
    columns = {
        a: ((ends[0].columns[a] - ends[1].columns[a]) @ gamma / (2.0 * step))[:, None] for a in block.columns
    }
    return replace(block, name=f"{block.name} {name}", columns=columns, terms=(name,), nonlinear={})


# ---------------------------------------------------------------- rivals


def rivals(found: Found, b: int, library: Sequence[int]) -> list[tuple[str, float]]:
    """(effect, √Δ(b | rival)) of the effects of the library that could stand in b's place."""
    pool = found.pool
    others = found.others(b)
    here = given(pool, others)
    mine = score(here, [b])
    axes = found.axes(b)
    best: dict[str, tuple[float, int]] = {}
    for c in free(pool, library, [*others, b]):
        name = pool.blocks[c].name
        if name == pool.blocks[b].name or not set(pool.blocks[c].columns) & axes:
            continue
        s = score(here, [c])
        if s.m and (name not in best or s.criterion > best[name][0]):
            best[name] = s.criterion, c
    out = []
    for name, (criterion, c) in best.items():
        s = score(here, [c])
        apart = float(np.sqrt(max(score(given(pool, [*others, c]), [b]).delta, 0.0)))
        near = mine.criterion - criterion < NEAR or apart < APART_SIGMA
        if near and s.log_p < np.log(ALPHA) and s.delta > 0.25 * mine.delta:
            out.append((name, apart))
    return sorted(out, key=lambda r: r[1])
