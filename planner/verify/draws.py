"""Units drawn from a spec's budgets, many at once: what the bench will see of each, and what the flight will.

A coefficient is a constant (systematic), a curve over temperature, a draw of every power-on (run_to_run), a
first-order Gauss-Markov process within the power-on (in_run) and a random walk over the days (storage)
(K 2.1, 3.1), drawn one after the other: power-on by power-on, record by record, day by day, and never from a
covariance of the whole campaign. Every array has a key of its own: the generator is Philox, keyed by (seed,
chunk, key), so a chunk's units do not depend on who draws them, or when.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.protocols import Sensor
from planner.spec.budget import STORAGE_DAYS, ErrorBudget
from planner.spec.model import Spec
from planner.verify.chance import Chance
from planner.verify.curve_shapes import SHAPES
from planner.verify.curves import Curves, along
from planner.verify.families import curves_in, with_tables
from planner.verify.records import Records


def generator(seed: int, chunk: int, *key: str) -> np.random.Generator:
    """The generator of one key of one chunk."""
    words = [zlib.crc32(part.encode()) for part in key]
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(chunk, *words))))


@dataclass(frozen=True)
class Unit:
    """A spec prepared for many draws: budgets and curves by (sensor, effect)."""

    budgets: Mapping[tuple[Sensor, str], ErrorBudget]
    curves: Mapping[tuple[Sensor, str], Curves]


def unit_of(spec: Spec, family: str = SHAPES[0]) -> Unit:
    """What does not depend on the seed, the curves of one family."""
    return Unit(with_tables(spec), curves_in(spec, family))


@dataclass(frozen=True)
class Exposed:
    """Where and when a unit is looked at. temperature_degc: (B, K) or (K,); time: (K,) s; day: in days."""

    temperature_degc: Array
    time: Array
    day: float


@dataclass(frozen=True)
class DrawnError:
    """One budgeted error of B units, t terms, SI.

    constant: (B, t) at the campaign's end; grid: (G,) and curve: (B, t, G), None without one
    records: (B, n, t) in every record; storage: (B, t) since then, on the flight's day
    run_to_run, in_run: (B, K, t) in the flight, which is a power-on of its own
    """

    sensor: Sensor
    effect: str
    terms: tuple[str, ...]
    constant: Array
    grid: Array | None
    curve: Array | None
    records: Array
    run_to_run: Array
    in_run: Array
    storage: Array

    @property
    def name(self) -> ErrorName:
        """`gyro.bias`."""
        return ErrorName.of(self.sensor, self.effect)

    def systematic(self, temperature_degc: Array) -> Array:
        """(B, K, t) constant and curve at temperatures (B, K)."""
        value = np.broadcast_to(self.constant[:, None, :], (*temperature_degc.shape, len(self.terms)))
        if self.curve is None or self.grid is None:
            return value
        return np.asarray(value + np.moveaxis(along(temperature_degc, self.grid, self.curve), 1, 2))


@dataclass(frozen=True)
class Campaign:
    """Where B units are drawn for: records, the temperatures (B, n) that they had there, and their flight."""

    records: Records
    temperature_degc: Array
    flight: Exposed


def drawn_errors(unit: Unit, made: Campaign, chance: Chance, key: tuple[int, int]) -> list[DrawnError]:
    """Every budgeted error of B units; key: seed and chunk."""
    return [_drawn(error, unit, made, chance, key) for error in unit.budgets]


def _drawn(
    error: tuple[Sensor, str], unit: Unit, made: Campaign, chance: Chance, key: tuple[int, int]
) -> DrawnError:
    sensor, effect = error
    budget = unit.budgets[error]
    terms = tuple(t.name for t in catalog.effects()[effect].terms(sensor))
    shape = (len(made.temperature_degc), len(terms))

    def rng(what: str) -> np.random.Generator:
        return generator(*key, what, sensor, effect)

    constant = _sizes(budget, shape, chance, rng("systematic"))
    grid, curve = _curves(unit.curves.get(error), shape, rng("curve"))
    records = np.broadcast_to(constant[:, None, :], (shape[0], len(made.records), shape[1])).copy()
    if grid is not None and curve is not None:
        records += np.moveaxis(along(made.temperature_degc, grid, curve), 1, 2)
    records += _of_runs(budget, made, shape, rng("run_to_run"))
    bench, in_run = _in_run(budget, made, shape, rng("in_run"))
    stored, until, storage = _storage(budget, made, shape, rng("storage"))
    records += bench
    records += stored
    own = _of_flight(budget, made.flight, shape, rng("flight"))
    return DrawnError(sensor, effect, terms, constant + until, grid, curve, records, own, in_run, storage)


def _sizes(budget: ErrorBudget, shape: tuple[int, int], chance: Chance, rng: np.random.Generator) -> Array:
    """(B, t) systematic sizes: up to the budget's, or all of it; signs at random, or all plus."""
    sign = rng.choice(np.array([-1.0, 1.0]), size=shape)
    share = rng.uniform(size=shape)
    size = budget.systematic_size * (share if chance.case == "random" else np.ones(shape))
    return np.asarray(size * (sign if chance.signs == "random" else 1.0))


def _curves(
    curves: Curves | None, shape: tuple[int, int], rng: np.random.Generator
) -> tuple[Array | None, Array | None]:
    """Grid (G,) and curves (B, t, G)."""
    if curves is None:
        return None, None
    return curves.grid, curves.drawn(shape[0] * shape[1], rng).reshape(*shape, len(curves.grid))


# ---------------------------------------------------------------- random parts


def _of_runs(
    budget: ErrorBudget, made: Campaign, shape: tuple[int, int], rng: np.random.Generator
) -> Array | float:
    """(B, n, t): one draw a power-on, which changes with the temperature if the budget says so."""
    if not budget.has_run_to_run:
        return 0.0
    records = made.records
    length = budget.temperature_correlation
    draw = rng.normal(size=(shape[0], len(records.starts), shape[1]))
    z = np.repeat(draw, [len(rows) for rows in records.runs], axis=1)
    for number, rows in enumerate(records.runs if length is not None else ()):
        z[:, rows] = _over(records.conditions.temperature_degc[rows], draw[:, number], length, rng)
    return np.asarray(budget.run_to_run_sigma(made.temperature_degc)[..., None] * z)


def _over(temperature_degc: Array, first: Array, length: float | None, rng: np.random.Generator) -> Array:
    """(B, m, t) draws along the temperatures (m,) of one power-on; `first` (B, t) is the first one's.

    Each further temperature is drawn given those before it, E z z' = exp(−ΔT² / (2 L²)).
    """
    points, where = np.unique(temperature_degc, return_inverse=True)
    found = [first]
    for k in range(1, len(points)):
        keep = np.exp(-0.5 * ((points[:k, None] - points[None, : k + 1]) / (length or np.inf)) ** 2)
        weights = np.linalg.lstsq(keep[:, :k], keep[:, k], rcond=1e-12)[0]
        left = max(0.0, 1.0 - float(weights @ keep[:, k]))
        mean = np.tensordot(weights, np.stack(found), axes=1)
        found.append(mean + np.sqrt(left) * rng.normal(size=first.shape))
    return np.stack(found, axis=1)[:, where]


def _of_flight(
    budget: ErrorBudget, flight: Exposed, shape: tuple[int, int], rng: np.random.Generator
) -> Array:
    """(B, K, t) what the flight's own power-on draws."""
    t = np.broadcast_to(flight.temperature_degc, (shape[0], len(flight.time)))
    first = rng.normal(size=shape)
    z = np.broadcast_to(first[:, None, :], (*t.shape, shape[1]))
    length = budget.temperature_correlation
    if length is not None:
        z = np.concatenate([_over(t[b], first[b : b + 1], length, rng) for b in range(len(t))])
    return np.asarray(budget.run_to_run_sigma(t)[..., None] * z)


def _in_run(
    budget: ErrorBudget, made: Campaign, shape: tuple[int, int], rng: np.random.Generator
) -> tuple[Array | float, Array]:
    """In the records (B, n, t), and at the flight's times (B, K, t): a power-on of its own."""
    sigma, flight = budget.in_run_sigma, made.flight
    if sigma <= 0:
        return 0.0, np.zeros((shape[0], len(flight.time), shape[1]))
    time_on = made.records.conditions.time_on
    bench = gauss_markov(time_on, made.records.starts, budget.in_run_time, shape, rng)
    own = gauss_markov(flight.time, np.array([0]), budget.in_run_time, shape, rng)
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
    budget: ErrorBudget, made: Campaign, shape: tuple[int, int], rng: np.random.Generator
) -> tuple[Array | float, Array | float, Array]:
    """One walk from zero on day 0: in the records (B, n, t), on their last day, and after it (B, t)."""
    sigma = budget.storage_sigma
    if sigma <= 0:
        return 0.0, 0.0, np.zeros(shape)
    days, index = np.unique(made.records.on_day, return_inverse=True)
    last = max(made.flight.day, float(days[-1]))
    width = np.sqrt(np.diff(np.concatenate([[0.0], days, [last]])) / STORAGE_DAYS)
    walk = np.cumsum(width[None, :, None] * rng.normal(size=(shape[0], len(width), shape[1])), axis=1)
    end = walk[:, -2]
    return sigma * walk[:, :-1][:, index], sigma * end, sigma * (walk[:, -1] - end)
