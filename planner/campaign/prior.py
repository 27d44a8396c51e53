"""What couples the power-ons of a campaign: unknowns with a prior, so that the noise is block by power-on.

Storage: over the days of the campaign every error walks at random, w(D) with variance s² D / 60 days. Its
Karhunen-Loève modes over the campaign's length T, D = 0 … T,

    w(D) = s √(T/60) Σ_k ξ_k √2 sin((k − ½) π D/T) / ((k − ½) π),   ξ_k ~ N(0, 1)

carry 81, 90 and 93 % of it with one, two and three; what is left changes from power-on to power-on (Loève,
Probability Theory II, 1978, 37.5).
References: level of the base and rate of the table of every bench, the mounting of every installation, the
thermometer of every chamber, as accurate as the spec says (benches.*.accuracy). A thousand repeats do not
learn more than the bench knows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.campaign.noise import budget_of, columns_of_errors
from planner.campaign.power_ons import PowerOns
from planner.measurement import ChannelModel, Parts, evaluate, sensed
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.spec.budget import STORAGE_DAYS
from planner.spec.model import Spec
from planner.spec.references import BenchAccuracy

MODES = 3
WORTH = 1e-3  # share of the variance of the mean power-on, below which a walk over the campaign is nothing
TURNING = float(np.radians(1.0))  # rad/s, far above the Earth's rate
EARTH = 1e-6  # rad/s: a reference without the Earth's rate does not say where north is
HALF_KELVIN = 0.5


@dataclass(frozen=True)
class Shared:
    """One unknown that the power-ons share: a reference by its name, or a mode (from 0) of a walk."""

    name: str
    error: ErrorName | None = None
    term: str = ""
    mode: int = 0


@dataclass(frozen=True)
class Prior:
    """Unknowns of a campaign with a prior. columns: (n, q) per unit; sigma: (q,); unknowns: (q,)."""

    columns: Array
    sigma: Array
    unknowns: tuple[Shared, ...]


def prior_of(model: ChannelModel, theta: Array, parts: Parts, runs: PowerOns, spec: Spec) -> Prior:
    """The unknowns of one channel that all its power-ons share."""
    found = [*_storage(model, parts, runs, spec), *_references(model, theta, parts, runs, spec)]
    kept = [(unknown, z, sigma) for unknown, z, sigma in found if sigma > 0.0 and np.any(z)]
    n = len(runs)
    return Prior(
        np.column_stack([z for _, z, _ in kept]) if kept else np.empty((n, 0)),
        np.array([sigma for _, _, sigma in kept]),
        tuple(unknown for unknown, _, _ in kept),
    )


_Unknown = tuple[Shared, Array, float]


def _storage(model: ChannelModel, parts: Parts, runs: PowerOns, spec: Spec) -> Iterator[_Unknown]:
    day = runs.on_day - min(0.0, float(np.min(runs.on_day, initial=0.0)))
    span = float(day.max(initial=0.0))
    if span <= 0.0:
        return
    for (error, term), z in columns_of_errors(model, parts).items():
        budget = budget_of(spec.unit, error)
        if budget is None or budget.storage_sigma <= 0.0:
            continue
        walked = budget.storage_sigma**2 * span / STORAGE_DAYS
        if walked <= WORTH * budget.run_to_run_largest**2 / max(float(runs.counts.sum()), 1.0):
            continue
        for k in range(MODES):
            unknown = Shared(f"storage of {error} {term}, mode {k + 1}", error, term, k)
            yield unknown, z * walk_mode(k, day / span), float(np.sqrt(walked))


def walk_mode(k: int, share: Array) -> Array:
    """The k-th mode (from 0) of a walk of unit variance at its end, at shares 0 … 1 of the way."""
    phase = (k + 0.5) * np.pi
    return np.asarray(np.sqrt(2.0) * np.sin(phase * share) / phase)


# ---------------------------------------------------------------- references


def _references(
    model: ChannelModel, theta: Array, parts: Parts, runs: PowerOns, spec: Spec
) -> Iterator[_Unknown]:
    for bench, rows in _benches(runs, spec):
        accuracy = spec.benches[bench].accuracy
        if accuracy is None:
            continue
        if accuracy.rate > 0.0:
            yield Shared(f"rate of {bench}"), _driven(model) * rows, accuracy.rate
        if model.sensor == "accelerometer" and accuracy.level > 0.0:
            for name, z in _tilts(model):
                yield Shared(f"level of {bench} about {name}"), z * rows, accuracy.level
        if accuracy.mounting > 0.0:
            yield from _mountings(model, runs, bench, rows, accuracy)
        if accuracy.temperature > 0.0:
            yield Shared(f"thermometer of {bench}"), _slope(model, theta) * rows, accuracy.temperature


def _benches(runs: PowerOns, spec: Spec) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Benches of the records, (n,) which; with one bench in the spec all records are of it."""
    for bench in spec.benches:
        if runs.bench is not None:
            yield bench, np.asarray(runs.bench == bench)
        elif len(spec.benches) == 1:
            yield bench, np.ones(len(runs), dtype=bool)


def _mountings(
    model: ChannelModel, runs: PowerOns, bench: str, rows: NDArray[np.bool_], accuracy: BenchAccuracy
) -> Iterator[_Unknown]:
    """A small turn of the body on the table, δ × u: (e_k × u)_i; one installation if nobody counts them."""
    i = model.channel
    installation = np.zeros(len(runs), dtype=np.int64) if runs.installation is None else runs.installation
    for number in sorted(set(installation[rows].tolist())):
        mine = rows & (installation == number)
        for k in range(3):
            if k != i:
                z = np.cross(np.eye(3)[k], sensed(model.sensor, model.conditions))[:, i]
                name = f"mounting {number} on {bench} about {'xyz'[k]}"
                yield Shared(name), z * mine, accuracy.mounting


def _driven(model: ChannelModel) -> Array:
    """(n,) what the table's rate adds, all of it for gyros; a centrifuge's load goes with its square."""
    c, i = model.conditions, model.channel
    turns = np.linalg.norm(c.rate, axis=1) > TURNING
    if model.sensor == "gyro":
        return np.where(turns, c.rate[:, i], 0.0)
    axis = c.rate / np.maximum(np.linalg.norm(c.rate, axis=1, keepdims=True), TURNING)
    across = c.specific_force - axis * np.sum(axis * c.specific_force, axis=1, keepdims=True)
    return np.where(turns, 2.0 * across[:, i], 0.0)


def _tilts(model: ChannelModel) -> Iterator[tuple[str, Array]]:
    """What a tilt of the base about north and about west adds to the specific force of a unit at rest.

    North is the horizontal part of the Earth's rate in the reference; without it the tilt is about two axes
    across the vertical, which is as good where all faces are up once.
    """
    f, w = model.conditions.specific_force, model.conditions.rate
    size = np.linalg.norm(f, axis=1, keepdims=True)
    up = np.divide(f, size, out=np.zeros_like(f), where=size > 0.0)
    across = w - up * np.sum(up * w, axis=1, keepdims=True)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    rest = np.linalg.norm(w, axis=1) <= TURNING
    north = np.divide(across, length, out=_any_across(up), where=length > EARTH)
    for name, axis in (("north", north), ("west", np.cross(up, north))):
        yield name, np.where(rest, np.cross(axis, f)[:, model.channel], 0.0)


def _any_across(up: Array) -> Array:
    """(n, 3) a unit vector across each row: along the body axis that is least vertical."""
    least = np.eye(3)[np.argmin(np.abs(up), axis=1)]
    across = least - up * np.sum(up * least, axis=1, keepdims=True)
    return np.asarray(across / np.linalg.norm(across, axis=1, keepdims=True))


def _slope(model: ChannelModel, theta: Array) -> Array:
    """(n,) change of the reading per kelvin at θ, as the tables and effects have it."""
    t = model.conditions.temperature_degc
    ends = [
        evaluate(
            replace(model, conditions=replace(model.conditions, temperature_degc=t + half)), theta
        ).predicted
        for half in (HALF_KELVIN, -HALF_KELVIN)
    ]
    return np.asarray((ends[0] - ends[1]) / (2.0 * HALF_KELVIN))
