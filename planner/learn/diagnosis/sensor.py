"""One sensor's three channels from the prepared table to what was found: noise, pool, flips, search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.learn.channel_model import EXCITING
from planner.learn.diagnosis.candidates import (
    Block,
    effect_blocks,
    generic_blocks,
    library_blocks,
)
from planner.learn.diagnosis.channels import Channel, channel
from planner.learn.diagnosis.found import Found, Question
from planner.learn.diagnosis.noise import LEAST_RUNS, channel_noise
from planner.learn.diagnosis.pool import Pool, extended, given, pool_of, score
from planner.learn.diagnosis.prepared import Prepared
from planner.learn.diagnosis.search import search
from planner.learn.diagnosis.whitened import Whitened, whitened
from planner.protocols import Sensor
from planner.records import Array
from planner.solvers.least_squares import least_squares

FLIPS = 999
FAR = 8.0  # sigma, beyond which a row is no reading of this campaign
MOST_FAR = 0.02  # share of the rows; more are a structure, not accidents
STRONG = 60.0  # sigma; products are about 1 % of an effect
AGAIN = 2
MOST_SHARE = 0.4  # columns a row when the noise is judged
FINE_ONES = ("time_on", "day")  # come coarse first, then fine
A_COLUMN = 8  # power-ons for each column between them when the noise is judged
SEGMENTS = 40  # that change sign together where there are too few power-ons
_OUT = 1e-4  # weight of a row that is far off: 40 sigma then count as 0.4


@dataclass(frozen=True)
class SensorFound:
    """What was found on one sensor, with what it rests on. far: axis -> (n,) rows that were left out."""

    sensor: Sensor
    channels: tuple[Channel, ...]
    found: Found
    far: dict[int, NDArray[np.bool_]]
    cuts: NDArray[np.int64]

    def sensed(self, c: Channel) -> Array:
        """(n, 3) true input of the triad on the prepared rows."""
        conditions = c.model.conditions
        return conditions.rate if self.sensor == "gyro" else conditions.specific_force


def diagnose_sensor(data: Prepared, sensor: Sensor, declared: tuple[str, ...], seed: int) -> SensorFound:
    """Search one sensor of a prepared table; again where what was found is so strong that products count."""
    from threadpoolctl import threadpool_limits

    strong: tuple[str, ...] = ()
    with threadpool_limits(limits=1, user_api="blas"):  # small matrices: threads cost more than they give
        s = _searched(data, sensor, declared, strong, seed)
        for _ in range(AGAIN):
            now = _strong(s.found)
            if set(now) <= set(strong):
                break
            strong = tuple(dict.fromkeys((*strong, *now)))
            s = _searched(data, sensor, declared, strong, seed)
    return s


def _strong(found: Found) -> list[str]:
    """Effects so far above the noise that their products with the declared ones are above it too."""
    names = []
    for b in found.library:
        block = found.pool.blocks[b]
        if not block.nonlinear and found.share(b).delta > STRONG**2:
            names.append(block.name)
    return names


def _searched(
    data: Prepared, sensor: Sensor, declared: tuple[str, ...], strong: tuple[str, ...], seed: int
) -> SensorFound:
    table = data.table
    readings = table.gyro if sensor == "gyro" else table.acc
    assert readings is not None  # the caller asks for sensors that are there
    conditions = table.conditions()
    mine = tuple(channel(sensor, a, conditions, readings[:, a], declared, strong) for a in range(3))
    blocks = [*library_blocks(mine, table, declared, sensor), *generic_blocks(mine, table, sensor)]
    state, far = {}, {}
    for c in mine:
        rich = np.column_stack([np.empty((len(c.r), 0)), *_rich(blocks, c.axis, len(c.r), len(data.starts))])
        far[c.axis] = outliers(c, np.column_stack([rich[:, :0], *_coarse(blocks, c.axis)]), data.starts)
        weights = np.where(far[c.axis], _OUT, 1.0)
        state[c.axis] = whitened(c, channel_noise(c, data.starts, table.duration, rich, weights), rich)
    cuts = segments(state, data.starts)
    pool = pool_of(state, blocks, cuts)
    signs = np.random.default_rng([seed, 17]).choice([-1.0, 1.0], size=(FLIPS, len(cuts)))

    def refine(p: Pool, believed: Sequence[int], b: int) -> tuple[Pool, int]:
        return refined(p, believed, b, mine, cuts)

    library = tuple(i for i, b in enumerate(blocks) if not b.generic)
    generic = tuple(i for i, b in enumerate(blocks) if b.generic)
    found = search(pool, Question(library, generic, signs, refine))
    return SensorFound(sensor, mine, found, far, cuts)


def _coarse(blocks: Sequence[Block], axis: int) -> list[Array]:
    """Columns that a row may follow and be no outlier: fine bins would follow a single row."""
    names: set[str] = set()
    kept = []
    for b in blocks:
        if axis in b.columns and not (b.generic and b.name in names and b.name in FINE_ONES):
            kept.append(b.columns[axis])
        if b.generic and axis in b.columns:
            names.add(b.name)
    return kept


def _rich(blocks: Sequence[Block], axis: int, rows: int, runs: int) -> list[Array]:
    """Columns under which the noise is judged: every candidate, but few of those that tell power-ons apart.

    Thirty power-ons under sixteen steps and as many days would leave nothing to tell run-to-run by, and where
    all columns together are too many for the rows those without a name stay out.
    """
    whole = [b for b in blocks if axis in b.columns]
    wide = sum(b.columns[axis].shape[1] for b in whole) > rows * MOST_SHARE
    mine = [b for b in whole if not (wide and b.generic)]
    steps = [b for b in mine if b.name == "bias_step"]
    most = max(1, runs // A_COLUMN)
    thin = steps[:: -(-len(steps) // most)] if steps else []
    kept = [
        b for b in mine if b.name != "bias_step" and not (b.name == "day" and b.columns[axis].shape[1] > most)
    ]
    return [b.columns[axis] for b in (*kept, *thin)]


# ---------------------------------------------------------------- rows far off


def outliers(c: Channel, rich: Array, starts: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n,) rows that lie far off even where every candidate may bend; none when they are too many."""
    columns = np.column_stack([c.J, rich])
    far = np.zeros(len(c.r), dtype=bool)
    if len(c.r) < 20:
        return far
    for _ in range(4):
        seen = ~far
        share, coefficients = _fit(columns[seen], c.r[seen])
        if seen.sum() - share.sum() < seen.sum() / 4.0:
            columns = c.J
            share, coefficients = _fit(columns[seen], c.r[seen])
        left = c.r - columns @ coefficients
        left[seen] /= np.sqrt(1.0 - np.minimum(share, 0.97))
        now = _far(left, c, starts)
        if np.array_equal(now, far):
            break
        far = now
    return far if far.mean() <= MOST_FAR else np.zeros(len(far), dtype=bool)


def _fit(columns: Array, r: Array) -> tuple[Array, Array]:
    """(n,) leverage and the coefficients, least where the rows do not determine them."""
    coefficients, found = least_squares(columns, r, 1e-7)
    return np.einsum("nk,nk->n", found.basis, found.basis), coefficients


def _far(left: Array, c: Channel, starts: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Beyond FAR robust sigma about the middle of the run; sigma grows with the input as the rows do."""
    sizes = np.diff(np.append(starts, len(left)))
    middle = np.array([np.median(part) for part in np.split(left, starts[1:])])
    about = np.where(np.repeat(sizes > 2, sizes), left - np.repeat(middle, sizes), left)
    size = np.abs(c.u)
    slow = size < 1.5 * EXCITING[c.sensor]
    rest = about[slow] if slow.sum() >= 20 else about
    spread = 1.4826 * float(np.median(np.abs(rest)))
    fast = ~slow & (size > 0)
    share = 1.4826 * float(np.median(np.abs(about[fast]) / size[fast])) if fast.sum() >= 10 else 0.0
    return np.asarray(np.abs(about) > FAR * np.maximum(np.hypot(spread, share * size), _least(c)))


def _least(c: Channel) -> float:
    """What a reading cannot be finer than: the step of its numbers, or rounding."""
    steps = np.diff(np.unique(c.y))
    step = float(np.min(steps[steps > 0], initial=np.inf))
    coarse = step if np.isfinite(step) and len(steps) < len(c.y) / 2 else 0.0
    return float(max(coarse / np.sqrt(12.0), 1e-12 * np.abs(c.y).max(initial=0.0)))


# ---------------------------------------------------------------- segments that change sign together


def segments(state: dict[int, Whitened], starts: NDArray[np.int64]) -> NDArray[np.int64]:
    """First rows of what changes sign together: power-ons; where they are few, blocks within them.

    Blocks are five times as long as the calm residual stays correlated, so that noise keeps its colour.
    """
    if len(starts) >= LEAST_RUNS:
        return starts
    n = len(next(iter(state.values())).calm)
    lag = max(_correlation_rows(w.calm) for w in state.values())
    length = int(min(max(5 * lag, n // SEGMENTS, 1), max(1, n // 12)))
    sizes = np.diff(np.append(starts, n))
    return np.concatenate([np.arange(s, s + size, length) for s, size in zip(starts, sizes, strict=True)])


def _correlation_rows(calm: Array) -> int:
    """Rows after which the autocorrelation has fallen below a fifth."""
    n = len(calm)
    power = float(calm @ calm)
    if n < 20 or power == 0.0:
        return 1
    for lag in range(1, n // 10):
        if float(calm[:-lag] @ calm[lag:]) < 0.2 * power:
            return lag
    return n // 10


# ---------------------------------------------------------------- nonlinear parameters


def refined(
    pool: Pool, believed: Sequence[int], b: int, channels: Sequence[Channel], cuts: NDArray[np.int64]
) -> tuple[Pool, int]:
    """The block at the best value of its parameter between the neighbours of the grid (variable projection).

    A step's day is known to lie between two days of the table and stays at their middle.
    """
    from scipy.optimize import minimize_scalar

    block = pool.blocks[b]
    ((name, value),) = block.nonlinear.items()
    if name == "day":
        return pool, b
    here = given(pool, [i for i in believed if i != b])
    others = [i for i in believed if i != b]
    near = 1.9  # the grid's ratio is smaller

    def missing(log: float) -> float:
        one = pool_of(pool.state, [_at(block, name, float(np.exp(log)), channels)], cuts)
        return -_gain(pool, others, one)

    best = minimize_scalar(missing, bounds=(np.log(value / near), np.log(value * near)), method="bounded",
                           options={"xatol": 1e-3})  # fmt: skip
    if -best.fun <= score(here, [b]).delta + 1e-9:
        return pool, b
    return extended(pool, _at(block, name, float(np.exp(best.x)), channels), cuts), len(pool.blocks)


def _at(block: Block, name: str, value: float, channels: Sequence[Channel]) -> Block:
    mine = [c for c in channels if c.axis in block.columns]
    (found,) = [x for x in effect_blocks(mine, block.name, {name: value}) if x.key == block.key]
    return found


def _gain(pool: Pool, others: Sequence[int], one: Pool) -> float:
    """Δ of a block of another pool beside some blocks of this one."""
    k = pool.columns(others)
    cross = np.zeros((len(k), len(one.h)))
    for axis, C in one.parts.items():
        place = {int(g): i for i, g in enumerate(pool.axes[axis])}
        for row, column in enumerate(k):
            if int(column) in place:
                cross[row, one.axes[axis]] += pool.parts[axis][:, place[int(column)]] @ C
    inverse = np.linalg.pinv(pool.gram[np.ix_(k, k)], rcond=1e-8, hermitian=True)
    h = one.h - cross.T @ inverse @ pool.h[k]
    gram = one.gram - cross.T @ inverse @ cross
    return float(h @ np.linalg.pinv(gram, rcond=1e-8, hermitian=True) @ h)
