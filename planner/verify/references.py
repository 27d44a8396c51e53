"""What units really meet on benches whose references err: `benches.*.accuracy`, drawn unit by unit.

A base's tilts (level), the table's rate and the chamber's thermometer are one draw a bench; the angles of the
unit on the bench (mounting) are drawn anew at every installation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.conditions import Conditions, joined
from planner.spec.model import Spec
from planner.verify.chance import Chance
from planner.verify.draws import generator
from planner.verify.exposures import Motion, earth_rate, turned_by, upward
from planner.verify.records import Records


@dataclass(frozen=True)
class Met:
    """Conditions of B · n records, unit after unit: `true` ones, and as the dwell table would `show` them."""

    true: Conditions
    shown: Conditions


def met_by_units(records: Records, units: int, spec: Spec, chance: Chance, key: tuple[int, int]) -> Met:
    """The chamber strays around the soaked temperature; references are as good as the spec says."""
    nominal = records.conditions
    rng = generator(*key, "chamber")
    shape = (units, len(records))
    jitter = chance.temperature_jitter * rng.normal(size=shape)
    drift = chance.temperature_jitter / 300.0 * rng.normal(size=shape)
    rate, force, warmer = _off(records, units, spec, key)
    shown = replace(
        joined([nominal] * units),
        temperature_degc=(nominal.temperature_degc + jitter).ravel(),
        temperature_rate=(nominal.temperature_rate + drift).ravel(),
    )
    true = replace(
        shown,
        rate=shown.rate + rate,
        specific_force=shown.specific_force + force,
        temperature_degc=shown.temperature_degc + warmer,
    )
    return Met(true, shown)


def _off(records: Records, units: int, spec: Spec, key: tuple[int, int]) -> tuple[Array, Array, Array]:
    """True minus referred: rate and force (B n, 3), temperature (B n,)."""
    n = len(records)
    rate, force, warmer = np.zeros((units, n, 3)), np.zeros((units, n, 3)), np.zeros((units, n))
    for name in dict.fromkeys(records.bench.tolist()):
        accuracy = spec.benches[name].accuracy
        rows = np.flatnonzero(records.bench == name)
        draw = generator(*key, "bench", name)
        tilt = accuracy.level * np.pad(draw.normal(size=(units, 2)), ((0, 0), (0, 1)))
        faster = accuracy.rate * draw.normal(size=units)
        warmer[:, rows] = accuracy.temperature * draw.normal(size=(units, 1))
        visits, visit = np.unique(records.installation[rows], return_inverse=True)
        mounting = accuracy.mounting * draw.normal(size=(units, len(visits), 3))
        if not (tilt.any() or faster.any() or mounting.any()):
            continue
        base, mounted = turned_by(tilt), turned_by(mounting)
        for place, row in enumerate(rows):
            turn, load = felt(records.motions[row], base, mounted[:, visit[place]], faster)
            rate[:, row] = turn - records.conditions.rate[row]
            force[:, row] = load - records.conditions.specific_force[row]
    return rate.reshape(-1, 3), force.reshape(-1, 3), warmer.ravel()


def felt(motion: Motion, base: Array, mounted: Array, faster: Array) -> tuple[Array, Array]:
    """(..., B, 3) rate and specific force of B units on benches that are off, in one motion or many (...).

    base: (B, 3, 3) turns gravity and the Earth's rate in the bench; mounted: (B, 3, 3) turns everything in
    the unit; faster: (B,) relative error of the driven rate, whose square an arm's load follows
    """
    to_unit, wide = np.swapaxes(motion.turned, -1, -2), (1.0 + faster)[:, None]
    turn = (base @ earth_rate()) @ to_unit + wide * motion.driven[..., None, :]
    load = (base @ upward()) @ to_unit + wide**2 * motion.pushed[..., None, :]
    return (mounted @ turn[..., None])[..., 0], (mounted @ load[..., None])[..., 0]


# ---------------------------------------------------------------- to first order

_STEP = 1e-5  # rad, or of the rate: what is of second order is 1e-5 of the slope


@dataclass(frozen=True)
class Direction:
    """One way in which references err, of so many sigma: rate, specific_force: (n, 3) true minus referred."""

    sigma: float
    rate: Array
    specific_force: Array


def directions(records: Records, spec: Spec) -> tuple[Direction, ...]:
    """Levels and rates of every bench, and the mountings of every installation: one unit of each."""
    found = []
    for name in dict.fromkeys(records.bench.tolist()):
        accuracy = spec.benches[name].accuracy
        rows = np.flatnonzero(records.bench == name)
        ways = [(accuracy.level, k, rows) for k in (0, 1)] + [(accuracy.rate, 2, rows)]
        for visit in np.unique(records.installation[rows]).tolist():
            there = rows[records.installation[rows] == visit]
            ways += [(accuracy.mounting, k, there) for k in (3, 4, 5)]
        found += [Direction(sigma, *_slope(records, k, there)) for sigma, k, there in ways if sigma > 0]
    return tuple(found)


def _slope(records: Records, way: int, rows: NDArray[np.int64]) -> tuple[Array, Array]:
    """(n, 3) rate and force per radian of a tilt (0, 1) or a turn (3, 4, 5), or per one of a rate (2)."""
    off = np.zeros((2, 6))
    off[:, way] = _STEP, -_STEP
    base, mounted = turned_by(off[:, :3] * [1.0, 1.0, 0.0]), turned_by(off[:, 3:])
    every = [records.motions[row] for row in rows]
    turned, driven, pushed = (
        np.stack([getattr(m, of) for m in every]) for of in ("turned", "driven", "pushed")
    )
    rate, force = np.zeros((2, len(records), 3))
    turn, load = felt(Motion(turned, driven, pushed), base, mounted, off[:, 2])
    rate[rows], force[rows] = ((x[:, 0] - x[:, 1]) / (2.0 * _STEP) for x in (turn, load))
    return rate, force


def thermometers(records: Records, spec: Spec) -> tuple[tuple[float, Array], ...]:
    """(sigma in K, (n,) one for its records) of every bench whose thermometer errs."""
    names = dict.fromkeys(records.bench.tolist())
    every = [(spec.benches[name].accuracy.temperature, records.bench == name) for name in names]
    return tuple((sigma, rows.astype(float)) for sigma, rows in every if sigma > 0)
