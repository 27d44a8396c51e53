"""How large a reference's change is, by readings about the means of power-ons, in the noise of rows alone.

    γ = (Σ WᵀW)⁺ Σ Wᵀr   about the means of power-ons, clear of the declared columns, all channels together

A scale that is another one from a power-on on is in the noise, as a scale factor that each of them draws, and
so are leans: beside that it is known to a tenth, and what is left when it is put right is a hundred sigma of
rows. The declared fit took part of the change up, so it is made again with the change put right, and what is
left of it is asked once more (Gauss, Newton), in the noise that it then has: the change was noise of the
turns before, and of 0.085 deg the first answer misses 4e-6 rad, ten sigma of a campaign's turns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.diagnose.channels.channel import Channel, channel
from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.noise.channel_noise import plain_spread
from planner.diagnose.references.bench_directions import through_the_unit
from planner.diagnose.search.sensor import SensorFound
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Sensor

ROUNDS = 3  # each leaves a hundredth of what the one before it left
SEEN = 1e-4  # of the best told coefficient's information, below which one is not told

Felt = Callable[[Sensor, Conditions], Sequence[Array]]


def size_within_power_ons(
    felt: Felt,
    found: Sequence[SensorFound],
    starts: NDArray[np.int64],
    there: NDArray[np.bool_],
    put_right: Callable[[Array], DwellTable],
) -> Array:
    """(k,) coefficients of a change of some power-ons (g,). put_right: the table without a change of (k,)."""
    each = [(w.channel, w.noise.spread) for s in found for w in s.found.pool.state.values()]
    gamma = _step(felt, each, starts, there)
    for _ in range(ROUNDS - 1):
        table = put_right(gamma)
        anew = [_again(c, table) for c, _ in each]
        calm = [(c, plain_spread(c, starts, table.duration, np.ones(len(table)))) for c in anew]
        gamma = gamma + _step(felt, calm, starts, there)
    return gamma


def _step(
    felt: Felt, each: Iterable[tuple[Channel, Array]], starts: NDArray[np.int64], there: NDArray[np.bool_]
) -> Array:
    gram: Array = np.sum([_products(felt, c, level, starts, there) for c, level in each], axis=0)
    inverse = np.linalg.pinv(gram[:-1, :-1], rcond=SEEN, hermitian=True)
    return np.asarray(inverse @ gram[:-1, -1])


def _products(
    felt: Felt, c: Channel, spread: Array, starts: NDArray[np.int64], there: NDArray[np.bool_]
) -> Array:
    """(k + 1, k + 1) of the columns of the change and the residual of one channel."""
    sizes = np.diff(np.append(starts, len(c.y)))
    W = through_the_unit(c, felt(c.sensor, c.model.conditions)) * np.repeat(there, sizes)[:, None]
    level = 1.0 / spread[:, None]
    A = np.column_stack([c.J, W, c.r]) * level
    means = np.add.reduceat(A * level, starts) / np.add.reduceat(level**2, starts)
    A = A - np.repeat(means, sizes, axis=0) * level
    own = c.J.shape[1]
    z = clear(orthonormal(A[:, :own], 1e-6), A[:, own:])
    return np.asarray(z.T @ z)


def _again(c: Channel, table: DwellTable) -> Channel:
    """The channel's declared fit to a table with other references or readings."""
    y = table.gyro if c.sensor == "gyro" else table.acc
    assert y is not None  # its sensor was searched
    tabled = {x.effect.name for x in c.model.carried if x.nodes is not None}
    over = (e.name for e in catalog.effects().values() if e.temperature_of in tabled)  # it made the table
    declared = (*(x.effect.name for x in c.model.carried), *over)
    effects = tuple(name for name in declared if name not in c.found)
    return channel(c.sensor, c.axis, table.conditions(), y[:, c.axis], effects, c.found)
