"""What couples the power-ons of a campaign: unknowns with a prior, so that the noise is block by power-on.

Storage: over the days of the campaign every error walks at random. What flies is where it stands at the end,
so coefficients are those of the last power-on, on day T, and records of day D see them less the walk since:

    cov(w(D), w(D')) = s² (T − max(D, D')) / 60 days,   w(D) = s Σ_k ξ_k φ_k(D),   ξ_k ~ N(0, 1)

φ_k are the Karhunen-Loève modes on the days of the power-ons, as many as carry 99.5 % of it there, at most 8:
three days have two modes at most, and of days spread evenly eight carry 97.5 % (Loève, Probability Theory II,
1978, 37.5).
References: level of the base and rate of the table of every bench, the mounting of every installation, the
thermometer of every chamber, as accurate as the spec says (benches.*.accuracy). A thousand repeats do not
learn more than the bench knows.
What the unit has by its budget and no effect is declared for: a constant of each term, anywhere within it,
s² = size² / 3. Nobody compensates it, but it is no noise of records: weighed by their noise alone, records at
five rates gave a scale factor by contrasts that a nonlinearity of 3 % led astray by 24 %.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.campaign.noise import budget_of, columns_of_errors, unfitted_columns
from planner.campaign.power_ons import PowerOns
from planner.measurement import ChannelModel, Parts, evaluate, sensed
from planner.nouns.array import Array
from planner.physics.attitude import unit as of_length_one
from planner.spec.budget import STORAGE_DAYS
from planner.spec.model import Spec, Unit
from planner.spec.references import BenchAccuracy
from planner.units import STANDARD_GRAVITY_MPS2

MODES = 8
CARRIED = 0.995
PLACES = 400  # days that are told apart
WORTH = 1e-3  # share of the variance of the mean power-on, below which a walk over the campaign is nothing
TURNING = float(np.radians(1.0))  # rad/s, far above the Earth's rate
LOADED = 1.005 * STANDARD_GRAVITY_MPS2  # m/s², of a tenth of a g across gravity; its own mean is never longer
EARTH = 1e-6  # rad/s: a reference without the Earth's rate does not say where north is
HALF_KELVIN = 0.5
WITHIN = float(1.0 / np.sqrt(3.0))  # sigma of what is anywhere within its budget, of the budget


@dataclass(frozen=True)
class Shared:
    """One unknown that the power-ons share: a reference by its name, one mode of a walk, a constant."""

    name: str
    of: Literal["reference", "walk", "undeclared", "slope"] = "reference"


@dataclass(frozen=True)
class Prior:
    """Unknowns of a campaign with a prior. columns: (n, q) per unit; sigma: (q,); unknowns: (q,)."""

    columns: Array
    sigma: Array
    unknowns: tuple[Shared, ...]


def prior_of(model: ChannelModel, theta: Array, parts: Parts, runs: PowerOns, spec: Spec) -> Prior:
    """The unknowns of one channel that all its power-ons share."""
    shared = [*_storage(model, parts, runs, spec), *_references(model, theta, parts, runs, spec)]
    return of_unknowns([*shared, *_undeclared(model, parts, spec.unit)], len(runs))


Unknown = tuple[Shared, Array, float]


def of_unknowns(found: Iterable[Unknown], n: int) -> Prior:
    """Unknowns of n records, each with its column (n,) and sigma, of which these have anything."""
    kept = [(unknown, z, sigma) for unknown, z, sigma in found if sigma > 0.0 and np.any(z)]
    return Prior(
        np.column_stack([z for _, z, _ in kept]) if kept else np.empty((n, 0)),
        np.array([sigma for _, _, sigma in kept]),
        tuple(unknown for unknown, _, _ in kept),
    )


def both(one: Prior, other: Prior) -> Prior:
    """Unknowns of the same records side by side."""
    return Prior(
        np.hstack([one.columns, other.columns]),
        np.concatenate([one.sigma, other.sigma]),
        (*one.unknowns, *other.unknowns),
    )


def _storage(model: ChannelModel, parts: Parts, runs: PowerOns, spec: Spec) -> Iterator[Unknown]:
    modes = np.repeat(walk_modes(runs.conditions.day[runs.starts], runs.counts), runs.sizes, axis=0)
    if not modes.size:
        return
    span = np.ptp(runs.on_day)
    columns = {**columns_of_errors(model, parts), **unfitted_columns(model, parts, spec.unit)}
    for (error, term), z in columns.items():
        budget = budget_of(spec.unit, error)
        if budget is None or budget.storage_sigma <= 0.0:
            continue
        walked = budget.storage_sigma**2 * span / STORAGE_DAYS
        if walked <= WORTH * budget.run_to_run_largest**2 / max(float(runs.counts.sum()), 1.0):
            continue
        for k, mode in enumerate(modes.T):
            unknown = Shared(f"storage of {error} {term}, mode {k + 1}", "walk")
            yield unknown, z * mode, budget.storage_sigma


def walk_modes(day: Array, counts: Array | None = None) -> Array:
    """(g, k) modes φ of a walk back from the last of the days (g,), of unit variance over STORAGE_DAYS.

    counts: (g,) how often there is a power-on; None: once
    """
    ago, span = walked_since(day)
    if span <= 0.0:
        return np.empty((len(day), 0))
    places, at = np.unique(np.round(ago / span * PLACES), return_inverse=True)
    back = places * (span / PLACES / STORAGE_DAYS)
    often = np.sqrt(np.bincount(at, counts))
    value, vector = np.linalg.eigh(often[:, None] * np.minimum.outer(back, back) * often)
    value, vector = value[::-1], vector[:, ::-1]
    enough = int(np.searchsorted(np.cumsum(value), CARRIED * value.sum())) + 1
    kept = slice(min(enough, MODES))
    return np.asarray((vector[:, kept] * np.sqrt(value[kept]) / often[:, None])[at])


def walked_since(day: Array) -> tuple[Array, float]:
    """(g,) days from each of the days (g,) to the last, and the most of them."""
    ago = np.max(day, initial=-np.inf) - day
    return ago, float(np.max(ago, initial=0.0))


def _undeclared(model: ChannelModel, parts: Parts, unit: Unit) -> Iterator[Unknown]:
    for (error, term), z in unfitted_columns(model, parts, unit).items():
        budget = budget_of(unit, error)
        if budget is not None:
            yield Shared(f"{error} {term}", "undeclared"), z, WITHIN * budget.whole_variation


# ---------------------------------------------------------------- references


def _references(
    model: ChannelModel, theta: Array, parts: Parts, runs: PowerOns, spec: Spec
) -> Iterator[Unknown]:
    for bench, rows in _benches(runs, spec):
        accuracy = spec.benches[bench].accuracy
        if accuracy is None:
            continue
        if accuracy.rate > 0.0:
            yield Shared(f"rate of {bench}"), _driven(model, runs) * rows, accuracy.rate
        if accuracy.level > 0.0:
            for name, z in _tilts(model, runs):
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
) -> Iterator[Unknown]:
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


def _driven(model: ChannelModel, runs: PowerOns) -> Array:
    """(n,) what the table's rate adds, all of it for gyros; a centrifuge's load goes with its square.

    Gravity across a table's axis does not: of less than a whole turn some of its mean is left.
    """
    if runs.misplaced is not None:
        return _known(model, runs.misplaced)[:, 2]
    c, i = model.conditions, model.channel
    turns = np.linalg.norm(c.rate, axis=1) > TURNING
    if model.sensor == "gyro":
        return np.where(turns, c.rate[:, i], 0.0)
    axis = c.rate / np.maximum(np.linalg.norm(c.rate, axis=1, keepdims=True), TURNING)
    across = c.specific_force - axis * np.sum(axis * c.specific_force, axis=1, keepdims=True)
    loaded = np.linalg.norm(c.specific_force, axis=1) > LOADED
    return np.where(turns & loaded, 2.0 * across[:, i], 0.0)


def _known(model: ChannelModel, misplaced: Array) -> Array:
    """(n, 3) what the bench's references add to the channel; misplaced: (n, 3, 2, 3)."""
    return np.asarray(misplaced[:, :, 0 if model.sensor == "gyro" else 1, model.channel])


def _tilts(model: ChannelModel, runs: PowerOns) -> Iterator[tuple[str, Array]]:
    """What a tilt of the base adds, about north and about west where the records' motions are known."""
    if runs.misplaced is not None:
        yield from zip(("north", "west"), _known(model, runs.misplaced)[:, :2].T, strict=True)
    elif model.sensor == "accelerometer":
        yield from _tilts_at_rest(model)
        yield from _tilts_of_turns(model)


def _tilts_at_rest(model: ChannelModel) -> Iterator[tuple[str, Array]]:
    """What a tilt of the base about north and about west adds to the specific force of a unit at rest.

    North is the horizontal part of the Earth's rate in the reference; without it the tilt is about two axes
    across the vertical, which is as good where all faces are up once.
    """
    f, w = model.conditions.specific_force, model.conditions.rate
    up = of_length_one(f)
    across = w - up * np.sum(up * w, axis=1, keepdims=True)
    length = np.linalg.norm(across, axis=1, keepdims=True)
    rest = np.linalg.norm(w, axis=1) <= TURNING
    north = np.divide(across, length, out=_any_across(up), where=length > EARTH)
    for name, axis in (("north", north), ("west", np.cross(up, north))):
        yield name, np.where(rest, np.cross(axis, f)[:, model.channel], 0.0)


def _tilts_of_turns(model: ChannelModel) -> Iterator[tuple[str, Array]]:
    """A tilt of the axis that a unit turns about: what of gravity comes to lie along it stays in the mean.

    √(g² − f_axis²) per radian. A table does not say where the axis points, so it counts as an unknown of its
    own for each axis of the body.
    """
    f, w = model.conditions.specific_force, model.conditions.rate
    speed = np.linalg.norm(w, axis=1)
    axis = w / np.maximum(speed, TURNING)[:, None]
    which = np.argmax(np.abs(axis), axis=1)
    axis *= np.sign(np.take_along_axis(axis, which[:, None], axis=1))
    along = np.sum(axis * f, axis=1)
    level = np.sqrt(np.maximum(STANDARD_GRAVITY_MPS2**2 - along**2, 0.0))
    turns = (speed > TURNING) & (np.linalg.norm(f, axis=1) <= LOADED)
    for k in range(3):
        yield f"the {'xyz'[k]} axis", np.where(turns & (which == k), level * axis[:, model.channel], 0.0)


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
