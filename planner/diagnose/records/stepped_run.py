"""A bias that stepped once, at one moment of one power-on: a shock, a capture lost and found, a relay.

Beside what is declared and believed, of the readings whitened by the noise and cleared of all that,

    t = hᵀz / |h| / √(1 + σ² aᵀ ρ a),   h the rows of a power-on after a moment, a = Wᵀ h / |h|

which counts as many sigma as the noise and the budget's process within power-ons, σ² ρ, let it be. It is a
finding where chance makes none so large in a thousand campaigns, over every moment of every power-on of every
channel, and no other power-on comes near it: where all step, the bias wanders (`noise.wander`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.noise.whitened import Whitened
from planner.diagnose.search.sensor import SensorFound
from planner.nouns.array import Array
from planner.nouns.diagnosis import RowLeftOut
from planner.nouns.dwell_table import DwellTable
from planner.solvers.distributions import chi_square_tail
from planner.spec.budget import ErrorBudget
from planner.units import from_si

LEAST_RUNS = 8  # power-ons, of which the others say what is usual
SIDE = 3  # rows on either side of a step: fewer are accidents of rows
CHANCE = 1e-3  # over all moments, power-ons and channels together
FARTHER = 9.0  # times the square of any other power-on's: three times as far
MEDIANS = 0.5  # of the step, that the middle rows before and after it have too: no single row makes it
TRIED = 6  # power-ons, of those with the largest sums
UNITS = {"gyro": "deg/s", "accelerometer": "mg"}


@dataclass(frozen=True)
class Step:
    """Where a bias stepped. rows: of the table that was searched, the shorter side; size: SI; sigma: |t|

    between: s since power-on of the last row before and the first after it
    """

    channel: str
    run: int
    rows: NDArray[np.int64]
    size: float
    unit: str
    sigma: float
    between: tuple[float, float]

    def of(self, whole: DwellTable, searched: DwellTable) -> NDArray[np.bool_]:
        """(n,) its rows in the whole table: of this run, within the time that they span."""
        times = searched.time_on[self.rows]
        inside = (whole.time_on >= times.min()) & (whole.time_on <= times.max())
        return np.asarray((whole.run == self.run) & inside)

    def left_out(self, table: DwellTable) -> Iterator[RowLeftOut]:
        """Its rows, as findings."""
        name = self.channel.replace("_", " ")
        size = f"{from_si(self.size, self.unit):+.3g} {self.unit}"
        guess = (
            f"the bias of {name} stepped by {size} in run {self.run} between {self.between[0]:.0f} and "
            f"{self.between[1]:.0f} s on: a shock, or the sensor's own change; repeating the run would tell"
        )
        for i in self.rows.tolist():
            step = "" if table.step is None else str(table.step[i])
            said = f"{table.temperature_degc[i]:.1f} degC, {table.time_on[i]:.0f} s on"
            yield RowLeftOut(self.run, step, self.channel, self.sigma, guess, said)


def stepped_run(found: Sequence[SensorFound], data: Prepared) -> Step | None:
    """The one step of one power-on, by the channel that shows it most; None without one."""
    sizes = np.diff(np.append(data.starts, len(data.table)))
    moments = int(np.maximum(sizes - 2 * SIDE + 1, 0).sum())
    if len(sizes) < LEAST_RUNS or moments == 0:
        return None
    channels = sum(len(s.found.pool.state) for s in found)
    steps = [_step(s, axis, data) for s in found for axis in s.found.pool.state]
    best = max((x for x in steps if x is not None), key=lambda x: x.sigma, default=None)
    if best is None or float(chi_square_tail(best.sigma**2, 1)) * moments * channels > CHANCE:
        return None
    return best


def _step(s: SensorFound, axis: int, data: Prepared) -> Step | None:
    """The largest of a channel, where no other power-on comes near it."""
    w, pool = s.found.pool.state[axis], s.found.pool
    mine = [pool.blocks[b].columns[axis] for b in s.found.all if axis in pool.blocks[b].columns]
    basis = w.Q
    if mine:
        more = orthonormal(clear(w.Q, w.noise.whiten(np.column_stack(mine))), 1e-6)
        basis = np.column_stack([w.Q, more])
    z = clear(basis, w.z)
    ends = np.append(data.starts[1:], len(z))
    cuts = sorted((_cut(z[a:b], a) for a, b in zip(data.starts, ends, strict=True)), reverse=True)[:TRIED]
    places = [(k, int(ends[np.searchsorted(ends, k, side="right")])) for sum_, k in cuts if sum_ > 0.0]
    if not places:
        return None
    H = np.zeros((len(z), len(places)))
    for column, (a, b) in enumerate(places):
        H[a:b, column] = 1.0
    h = clear(basis, w.noise.whiten(H))
    length = np.maximum(np.linalg.norm(h, axis=0), 1e-300)
    t = (z @ h) / length / np.sqrt(1.0 + _budgeted(w, h / length, data, ends))
    order = np.argsort(-np.abs(t))
    best = int(order[0])
    if len(order) > 1 and t[best] ** 2 <= FARTHER * t[order[1]] ** 2:
        return None
    k, end = places[best]
    start = int(data.starts[np.searchsorted(data.starts, k, side="right") - 1])
    size = float(z @ h[:, best]) / float(length[best]) ** 2
    left = z * w.noise.spread
    medians = float(np.median(left[k:end]) - np.median(left[start:k]))
    if medians * np.sign(size) < MEDIANS * abs(size):
        return None
    rows = np.arange(*((k, end) if end - k <= k - start else (start, k)), dtype=np.int64)
    times = data.table.time_on
    return Step(
        w.channel.name, int(data.table.run[k]), rows, size, UNITS[s.sensor], float(abs(t[best])),
        (float(times[k - 1]), float(times[k])),
    )  # fmt: skip


def _cut(z: Array, start: int) -> tuple[float, int]:
    """The largest weighed difference of means on either side of a moment, its row; 0 with too few."""
    n = len(z)
    if n < 2 * SIDE:
        return 0.0, start
    k = np.arange(SIDE, n - SIDE + 1)
    sums = np.cumsum(z)
    size = np.abs(sums[k - 1] - sums[-1] * k / n) * np.sqrt(n / (k * (n - k)))
    best = int(np.argmax(size))
    return float(size[best]), start + int(k[best])


def _budgeted(w: Whitened, h: Array, data: Prepared, ends: Array) -> Array:
    """(m,) σ² aᵀ ρ a of unit columns h (n, m): what the budget's process within power-ons makes of them."""
    budget = _budget(w, data)
    if budget is None or budget.in_run_sigma <= 0.0:
        return np.zeros(h.shape[1])
    a = w.noise.covariance.whiten_transposed(h)
    out = np.zeros(h.shape[1])
    for start, end in zip(data.starts, ends, strict=True):
        t = data.table.time_on[start:end]
        rho = np.exp(-np.abs(t[:, None] - t[None, :]) / budget.in_run_time)
        out += np.sum(a[start:end] * (rho @ a[start:end]), axis=0)
    return np.asarray(budget.in_run_sigma**2 * out)


def _budget(w: Whitened, data: Prepared) -> ErrorBudget | None:
    budgets = {} if data.unit is None else getattr(data.unit, w.channel.sensor)
    found: ErrorBudget | None = budgets.get("bias")
    return found
