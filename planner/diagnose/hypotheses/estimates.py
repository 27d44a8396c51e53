"""Sizes of what was found, with intervals; limits of what was not; rivals that the data cannot tell apart.

With S the believed columns, γ̂ = Gram_SS⁺ h_S / length, cov γ̂ = Gram_SS⁺ s² / length², and the freedom of each
coefficient is Satterthwaite's from how well REML knows the variances that it is made of.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.channel import Channel
from planner.diagnose.channels.parameters import Range
from planner.diagnose.hypotheses.candidates import Block, effect_blocks
from planner.diagnose.hypotheses.found import ALPHA_FURTHER, Found, along, free
from planner.diagnose.hypotheses.freedoms import satterthwaite
from planner.diagnose.hypotheses.lack_of_fit import own_variable
from planner.diagnose.hypotheses.nonlinear import as_likely_steps, profiled
from planner.diagnose.hypotheses.pool import Pool, extended, given
from planner.diagnose.hypotheses.scores import delta, mean_square, score
from planner.nouns.array import Array
from planner.protocols import Parameter
from planner.solvers.distributions import student_quantile

CONFIDENCE = 0.95  # of the intervals, as calibrate gives them
DETERMINED = 1e-6  # of a coefficient's column that may lie in what the data do not see
NEAR = 10.0  # criterion units (odds of exp(5)) by which a rival may be worse and still be one
STEP = 1e-3  # of a parameter as a fit carries it, or of its range, for its derivative
WIDEST = 10.0  # half of an interval: a factor of 22 000, or ten times the range of a linear one
HOLD_EACH_OTHER = ({"orientation", "specific_force"}, {"time_on", "time_on_and_temperature"})
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
    k = pool.columns(believed)
    if len(k) == 0:
        return []
    G = pool.grams(k)
    inverse = np.asarray(np.linalg.pinv(G, rcond=1e-9, hermitian=True), dtype=float)
    seen = np.diag(inverse @ G)
    gamma = inverse @ pool.h[k]
    found, i = [], 0
    for b in believed:
        for term in pool.blocks[b].terms or [""] * len(pool.places[b]):
            column = k[i]
            if term:
                ok = seen[i] > 1.0 - DETERMINED and pool.size[column] > 0
                freedom, s2 = _freedom(pool, b, k, inverse[:, i]) if ok else (1.0, 1.0)
                wide = float(student_quantile((1.0 + CONFIDENCE) / 2.0, freedom))
                size = pool.size[column] if ok else 1.0
                half = wide * np.sqrt(max(inverse[i, i], 0.0) * s2) / size if ok else np.inf
                found.append(Estimate(b, term, float(gamma[i] / size) if ok else 0.0, float(half), freedom))
            i += 1
    return found


def _freedom(pool: Pool, block: int, k: NDArray[np.int64], q: Array) -> tuple[float, float]:
    """Satterthwaite's freedom of a coefficient, the contrast q of the believed columns; its channels' s²."""
    total = float(q @ pool.grams(k) @ q)
    R = q[:, None] / np.sqrt(max(total, 1e-300))
    return satterthwaite(pool, pool.axes, k, R), max(mean_square(pool, [block]), 1.0)


@dataclass(frozen=True)
class ParameterInterval:
    """A parameter with its 95 % interval, in the unit in which the effect takes it."""

    name: str
    value: float
    low: float
    high: float
    freedom: float

    def tells(self, r: Range) -> bool:
        """Whether the interval is narrower than what the parameter could be in the first place."""
        if r.parameter.stepped or not r.low < r.high:
            return True
        return self.low > r.parameter.value(r.low) or self.high < r.parameter.value(r.high)


@dataclass(frozen=True)
class Shape:
    """All parameters of a found block; wider: the pool with their derivatives as block `block`, if any.

    sizes: term -> its interval where a profile tells it: of a block with one parameter
    """

    parameters: tuple[ParameterInterval, ...]
    wider: Pool
    block: int | None = None
    sizes: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def estimates(self, found: Found) -> list[Estimate]:
        """Every coefficient of what is believed, and the derivatives beside them."""
        return estimates(self.wider, found.all if self.block is None else [*found.all, self.block])


def shape_of(
    found: Found, b: int, channels: Sequence[Channel], cuts: NDArray[np.int64], ranges: Sequence[Range]
) -> Shape:
    """The parameters of a block by their derivatives, all together, on the scales on which fits carry them.

    A single one by the profile, and with it the sizes that belong to it (`nonlinear.profiled`).
    One that steps lies between values of its condition in the table, wherever it explains as much as at its
    best. Bins over another variable that stand beside the block (Found.aliased) are left out: in one long
    record they follow its derivatives, as they follow anything.
    """
    value = found.pool.blocks[b].nonlinear
    wider, new = found.pool, None
    sizes: dict[str, Estimate] = {}
    slopes = slopes_of(found, b, channels, ranges)
    if slopes is not None:
        wider = extended(found.pool, slopes, cuts)
        new = len(found.pool.blocks)
        beside = _beside(found, b)
        sizes = {e.term: e for e in estimates(wider, [*beside, new]) if e.block == new}

    def told(r: Range) -> ParameterInterval:
        name = r.parameter.name
        if not r.parameter.stepped:
            return _interval(r.parameter, value[name], sizes[name])
        others = [i for i in _beside(found, b) if i != b]
        ends = as_likely_steps(found.pool, others, b, channels, cuts, r)
        return ParameterInterval(name, value[name], *ends, np.inf)

    whole = Shape(tuple(told(r) for r in ranges), wider, new)
    alone = len(ranges) == 1 and not ranges[0].parameter.stepped
    return _by_profile(found, b, channels, cuts, ranges[0].parameter, whole) if alone else whole


def _by_profile(
    found: Found,
    b: int,
    channels: Sequence[Channel],
    cuts: NDArray[np.int64],
    p: Parameter,
    whole: Shape,
) -> Shape:
    """What a block's only parameter and its sizes are by the profile; as they were where there is none."""
    if whole.block is None:
        return whole
    others = [i for i in _beside(found, b) if i != b]
    every = estimates(whole.wider, [*others, b, whole.block])
    mine = [e for e in every if e.block == b]
    own = next(e for e in every if e.block == whole.block)
    if not all(np.isfinite(e.half) for e in (*mine, own)) or len(mine) != len(found.pool.places[b]):
        return whole
    root = np.sqrt(max(mean_square(found.pool, [b]), 1.0))
    reach = [root * float(student_quantile((1.0 + CONFIDENCE) / 2.0, e.freedom)) for e in (own, *mine)]
    told = profiled(
        found.pool, others, b, channels, cuts, p, min(own.half, WIDEST), (reach[0], np.array(reach[1:]))
    )
    if told is None:
        return whole
    parameter = replace(whole.parameters[0], low=p.value(told.low), high=p.value(told.high))
    ends = zip(told.lows.tolist(), told.highs.tolist(), strict=True)
    return replace(
        whole, parameters=(parameter,), sizes={e.term: end for e, end in zip(mine, ends, strict=True)}
    )


def _beside(found: Found, b: int) -> list[int]:
    """All that is believed but the bins over another variable that could take the block up."""
    follow = [u for u in found.alias(b) if not own_variable(found.pool, b, u)]
    return [i for i in found.all if i not in follow]


def _interval(p: Parameter, value: float, size: Estimate) -> ParameterInterval:
    most = WIDEST if p.scale == "logarithmic" else WIDEST * (p.high - p.low)
    half, here = min(size.half, most), p.carried(value)
    return ParameterInterval(p.name, value, p.value(here - half), p.value(here + half), size.freedom)


def slopes_of(found: Found, b: int, channels: Sequence[Channel], ranges: Sequence[Range]) -> Block | None:
    """∂(γ G(p))/∂p at what was found, p as a fit carries it, a block of one column a parameter.

    None where no parameter is smooth.
    """
    smooth = [r.parameter for r in ranges if not r.parameter.stepped]
    if not smooth:
        return None
    block = found.pool.blocks[b]
    gamma = np.zeros(len(block.terms))
    gamma[[bool(t) for t in block.terms]] = [
        e.value for e in estimates(found.pool, _beside(found, b)) if e.block == b
    ]
    mine = [c for c in channels if c.axis in block.columns]
    slopes = [_slope(block, p, gamma, mine) for p in smooth]
    columns = {a: np.column_stack([slope[a] for slope in slopes]) for a in block.columns}
    name = f"{block.name} {' '.join(p.name for p in smooth)}"
    return replace(block, name=name, columns=columns, terms=tuple(p.name for p in smooth), nonlinear={})


def _slope(block: Block, p: Parameter, gamma: Array, channels: Sequence[Channel]) -> dict[int, Array]:
    """axis -> (n,) by a central difference; nothing where the block vanishes."""
    low, high = p.bounds
    step = STEP * min(1.0, high - low)
    here = p.carried(block.nonlinear[p.name])
    slope = {a: np.zeros(len(columns)) for a, columns in block.columns.items()}
    for sign in (1.0, -1.0):
        at = {**block.nonlinear, p.name: p.value(here + sign * step)}
        for x in effect_blocks(channels, block.name, at):
            if x.key == block.key and x.terms == block.terms:
                for a in slope:
                    slope[a] += sign * (x.columns[a] @ gamma) / (2.0 * step)
    return slope


# ---------------------------------------------------------------- rivals


def rivals(found: Found, b: int, library: Sequence[int]) -> list[tuple[str, float]]:
    """(effect, √Δ(b | rival)) of the effects of the library that could stand in b's place.

    And of other variables: what nobody has named may go along one of those that explains as much.
    """
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
        s, apart = score(here, [c]), _apart(found, b, c)
        near = mine.criterion - criterion < NEAR or apart < APART_SIGMA
        if near and s.log_p < np.log(ALPHA_FURTHER) and s.delta > 0.25 * mine.delta:
            out.append((name, apart))
    return sorted([*out, *_other_variables(found, b, here)], key=lambda r: r[1])


def _other_variables(found: Found, b: int, here: Pool) -> list[tuple[str, float]]:
    """(variable, √Δ(b | its bins)) of variables but the effect's own that explain as much on its channel."""
    pool, mine = found.pool, score(here, [b])
    if len(pool.blocks[b].columns) > 1:
        return []
    own = _variables_of(along(pool, b))
    told: dict[str, float] = {}
    for g, block in enumerate(pool.blocks):
        if not block.generic or block.columns.keys() != pool.blocks[b].columns.keys() or block.name in own:
            continue
        s = score(here, [g])
        if s.criterion > NEAR and s.delta / s.s2 > mine.delta / mine.s2 - NEAR:
            apart = _apart(found, b, g)
            if apart < APART_SIGMA:
                told[block.name] = min(apart, told.get(block.name, np.inf))
    return list(told.items())


def _variables_of(own: str) -> set[str]:
    """A variable and those that have all of it: which way is up is the force at rest."""
    return {own}.union(*(same for same in HOLD_EACH_OTHER if own in same))


def _apart(found: Found, b: int, rival: int) -> float:
    """√Δ(b | rival) beside everything else that is believed."""
    beside = given(found.pool, [*found.others(b), rival])
    return float(np.sqrt(max(delta(beside, [b]), 0.0)))
