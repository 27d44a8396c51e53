"""Units drawn from a spec's budgets, many at once: what the bench will see of each, and what the flight will.

A coefficient is a constant (systematic), a curve over temperature, a draw of every power-on (run_to_run), a
first-order Gauss-Markov process within the power-on (in_run) and a random walk over the days (storage), as
`planner.simulate.campaign` draws one unit (K 2.1, 3.1). Every array has a key of its own: the generator is
Philox, keyed by (seed, chunk, key), so a chunk's units do not depend on who draws them, or when.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.protocols import Sensor
from planner.records import Array
from planner.simulate.campaign import Settings, Unit
from planner.simulate.design import Design
from planner.simulate.temperature_curves import POINTS, CurveFamily
from planner.spec.budget import STORAGE_DAYS, ErrorBudget


def generator(seed: int, chunk: int, *key: str) -> np.random.Generator:
    """The generator of one key of one chunk."""
    words = [zlib.crc32(part.encode()) for part in key]
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(chunk, *words))))


@dataclass(frozen=True)
class Exposed:
    """Where and when a unit is looked at. temperature_degc: (B, K) or (K,); time: (K,) s; day: in days."""

    temperature_degc: Array
    time: Array
    day: float


@dataclass(frozen=True)
class DrawnError:
    """One budgeted error of B units, t terms, SI.

    constant: (B, t); grid: (G,) and curve: (B, t, G), None without one; records: (B, n, t) in every record
    spread: (B, t) standard normal of the flight's power-on; in_run, storage: (B, K, t), (B, t) in flight
    """

    sensor: Sensor
    effect: str
    terms: tuple[str, ...]
    budget: ErrorBudget
    constant: Array
    grid: Array | None
    curve: Array | None
    records: Array
    spread: Array
    in_run: Array
    storage: Array

    @property
    def name(self) -> str:
        """`gyro.bias`."""
        return f"{self.sensor}.{self.effect}"

    def systematic(self, temperature_degc: Array) -> Array:
        """(B, K, t) constant and curve at temperatures (B, K)."""
        value = np.broadcast_to(self.constant[:, None, :], (*temperature_degc.shape, len(self.terms)))
        if self.curve is None or self.grid is None:
            return value
        return np.asarray(value + np.moveaxis(along(temperature_degc, self.grid, self.curve), 1, 2))

    def run_to_run(self, temperature_degc: Array) -> Array:
        """(B, K, t) what the flight's own power-on draws."""
        return np.asarray(self.budget.run_to_run_sigma(temperature_degc)[..., None] * self.spread[:, None, :])


def drawn_errors(
    unit: Unit,
    design: Design,
    temperature_degc: Array,
    flight: Exposed,
    settings: Settings,
    key: tuple[int, int],
) -> list[DrawnError]:
    """Every budgeted error of B units; temperature_degc: (B, n) of the records; key: seed and chunk."""
    return [
        _drawn(
            sensor,
            effect,
            budget,
            unit.families.get((sensor, effect)),
            design,
            temperature_degc,
            flight,
            settings,
            key,
        )
        for (sensor, effect), budget in unit.budgets.items()
    ]


def _drawn(
    sensor: Sensor,
    effect: str,
    budget: ErrorBudget,
    family: CurveFamily | None,
    design: Design,
    temperature_degc: Array,
    flight: Exposed,
    settings: Settings,
    key: tuple[int, int],
) -> DrawnError:
    terms = tuple(t.name for t in catalog.effects()[effect].terms(sensor))
    shape = (len(temperature_degc), len(terms))
    name = (sensor, effect)
    constant = _sizes(budget, shape, settings, generator(*key, "systematic", *name))
    grid, curve = _curves(budget, family, shape, settings, generator(*key, "curve", *name))
    records = np.broadcast_to(constant[:, None, :], (shape[0], len(design), shape[1])).copy()
    if grid is not None and curve is not None:
        records += np.moveaxis(along(temperature_degc, grid, curve), 1, 2)
    records += _of_runs(budget, design, temperature_degc, shape, generator(*key, "run_to_run", *name))
    bench, in_run = _in_run(budget, design, flight, shape, settings, generator(*key, "in_run", *name))
    stored, storage = _storage(budget, design, flight, shape, generator(*key, "storage", *name))
    records += bench
    records += stored
    spread = generator(*key, "flight", *name).normal(size=shape)
    return DrawnError(sensor, effect, terms, budget, constant, grid, curve, records, spread, in_run, storage)


def _sizes(
    budget: ErrorBudget, shape: tuple[int, int], settings: Settings, rng: np.random.Generator
) -> Array:
    """(B, t) systematic sizes: up to the budget's, or all of it; signs at random, or all plus."""
    sign = rng.choice(np.array([-1.0, 1.0]), size=shape)
    share = rng.uniform(size=shape)
    size = budget.systematic_size * (share if settings.case == "random" else np.ones(shape))
    return np.asarray(size * (sign if settings.signs == "random" else 1.0))


# ---------------------------------------------------------------- curves over temperature


def _curves(
    budget: ErrorBudget,
    family: CurveFamily | None,
    shape: tuple[int, int],
    settings: Settings,
    rng: np.random.Generator,
) -> tuple[Array | None, Array | None]:
    """Grid (G,) and curves (B, t, G); a measured curve is taken as it is, up to its sign."""
    measured = budget.measured_curve
    if measured is not None:
        sign = rng.choice(np.array([-1.0, 1.0]), size=shape) if settings.signs == "random" else np.ones(shape)
        return measured.temperatures_degc, sign[..., None] * measured.values
    if family is None:
        return None, None
    phase = rng.uniform(0.0, 2.0 * np.pi, size=(shape[0] * shape[1], len(family.amplitude)))
    return family.grid, curves_of(family, phase).reshape(*shape, POINTS)


def curves_of(family: CurveFamily, phase: Array) -> Array:
    """(m, POINTS) curves of phases (m, modes): what `CurveFamily.draw` gives for each row of phases."""
    x = np.linspace(0.0, 1.0, POINTS)
    angle = np.pi * np.arange(1, len(family.amplitude) + 1)[:, None] * x
    curve = (family.amplitude * np.cos(phase)) @ np.cos(angle)
    curve -= (family.amplitude * np.sin(phase)) @ np.sin(angle)
    curve -= curve.mean(axis=1, keepdims=True)
    if family.figure == "sigma":
        return np.asarray(curve)
    scale = np.full(len(curve), np.inf)
    for number, residual in zip(family.numbers, family.residual, strict=True):
        worst = np.abs(curve - _tabled(curve, number)).max(axis=1)
        scale = np.minimum(scale, residual / np.where(worst > 0, worst, np.inf))
    return np.asarray(curve * np.where(np.isfinite(scale), scale, 0.0)[:, None])


def _tabled(curve: Array, points: int) -> Array:
    """(m, G) what tables with evenly spread points give of curves (m, G)."""
    x = np.linspace(0.0, 1.0, curve.shape[1])
    nodes = np.linspace(0.0, 1.0, points) if points > 1 else np.array([0.5])
    return np.asarray(_linear(curve, x, nodes) @ _hats(x, nodes))


def _linear(curve: Array, x: Array, at: Array) -> Array:
    """(m, k) curves (m, G) over x (G,), read at `at` (k,)."""
    left = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    share = (at - x[left]) / (x[left + 1] - x[left])
    return np.asarray(curve[:, left] * (1.0 - share) + curve[:, left + 1] * share)


def _hats(x: Array, nodes: Array) -> Array:
    """(N, G) what each node adds at x, constant outside the nodes."""
    return np.array([np.interp(x, nodes, row) for row in np.eye(len(nodes))])


def along(temperature_degc: Array, grid: Array, curve: Array) -> Array:
    """(B, t, K) curves (B, t, G) at temperatures (B, K); the end segments go on beyond the grid."""
    left = np.clip(np.searchsorted(grid, temperature_degc, side="right") - 1, 0, len(grid) - 2)
    share = (temperature_degc - grid[left]) / (grid[left + 1] - grid[left])
    unit = np.arange(len(curve))[:, None]
    below = np.stack([curve[unit, t, left] for t in range(curve.shape[1])], axis=1)
    above = np.stack([curve[unit, t, left + 1] for t in range(curve.shape[1])], axis=1)
    return np.asarray(below + share[:, None, :] * (above - below))


# ---------------------------------------------------------------- random parts


def _of_runs(
    budget: ErrorBudget,
    design: Design,
    temperature_degc: Array,
    shape: tuple[int, int],
    rng: np.random.Generator,
) -> Array | float:
    if not budget.has_run_to_run:
        return 0.0
    draw = rng.normal(size=(shape[0], len(design.starts), shape[1]))
    runs = np.repeat(np.arange(len(design.starts)), np.diff(np.append(design.starts, len(design))))
    return np.asarray(budget.run_to_run_sigma(temperature_degc)[..., None] * draw[:, runs])


def _in_run(
    budget: ErrorBudget,
    design: Design,
    flight: Exposed,
    shape: tuple[int, int],
    settings: Settings,
    rng: np.random.Generator,
) -> tuple[Array | float, Array]:
    """In the records (B, n, t), and at the flight's times (B, K, t): a power-on of its own."""
    sigma = budget.in_run_sigma
    if sigma <= 0:
        return 0.0, np.zeros((shape[0], len(flight.time), shape[1]))
    tau = settings.correlation_time(budget)
    bench = gauss_markov(design.conditions.time_on, design.starts, tau, shape, rng)
    own = gauss_markov(flight.time, np.array([0]), tau, shape, rng)
    return sigma * bench, sigma * own


def gauss_markov(
    time: Array, starts: NDArray[np.int64], tau: float, shape: tuple[int, int], rng: np.random.Generator
) -> Array:
    """(B, n, t) of unit variance, started anew at every row of `starts`; correlation exp(−|Δt|/τ)."""
    n = len(time)
    sizes = np.diff(np.append(starts, n))
    out = rng.normal(size=(shape[0], n, shape[1]))
    for k in range(1, int(sizes.max(initial=0))):
        rows = starts[sizes > k] + k
        keep = np.exp(-np.abs(time[rows] - time[rows - 1]) / tau)[None, :, None]
        out[:, rows] = keep * out[:, rows - 1] + np.sqrt(1.0 - keep**2) * out[:, rows]
    return np.asarray(out)


def _storage(
    budget: ErrorBudget, design: Design, flight: Exposed, shape: tuple[int, int], rng: np.random.Generator
) -> tuple[Array | float, Array]:
    """In the records (B, n, t), and on the flight's day (B, t): one walk from zero on day 0."""
    sigma = budget.storage_sigma
    if sigma <= 0:
        return 0.0, np.zeros(shape)
    days, index = np.unique(design.conditions.day, return_inverse=True)
    last = max(flight.day, float(days[-1]))
    width = np.sqrt(np.diff(np.concatenate([[0.0], days, [last]])) / STORAGE_DAYS)
    walk = np.cumsum(width[None, :, None] * rng.normal(size=(shape[0], len(width), shape[1])), axis=1)
    return sigma * walk[:, :-1][:, index], sigma * walk[:, -1]
