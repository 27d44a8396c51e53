"""Dwell table of a check → the residual of every term of the region, with its covariance.

In power-on r a channel reads e = X_r (β + b_r) + noise beside its reference, β the residuals that stay, b_r
what this power-on adds to each, b_r ~ N(0, D) with run-to-run and in-run of the budgets, noise of variance
σ². With A_r = X_rᵀX_r/σ² the information of a power-on is M_r = A_r (I + D A_r)⁻¹, and

    β = (Σ M_r)⁻¹ Σ (I + A_r D)⁻¹ X_rᵀe_r/σ²,   cov β = (Σ M_r)⁻¹,   Q = Σ (β_r − β)ᵀ M_r (β_r − β) ~ χ²

(generalised least squares with random coefficients, Swamy, Econometrica 38, 1970). σ² is what is left within
the power-ons, of all units together. If Q says that a unit scatters more than its budget (1 %, shared by the
units), its own spread is taken instead, with its degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.errors import InputError
from planner.fleet.allowed_region import ALL_AXES, AllowedRegion
from planner.nouns.allowances import ErrorModel
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.dwell_table import DwellTable
from planner.nouns.sensor import ErrorName
from planner.plan.confidence import spread_at
from planner.protocols import SENSORS, Group, Sensor
from planner.solvers.distributions import chi_square_tail

CONTRADICTED = 0.01  # probability below which the spread of the budgets is not believed
_LEAST_NOISE = 1e-3  # of the run-to-run: rounding of the readings is below that
# terms that others are dropped for when a check cannot tell them apart, first the ones that stay
_PRIORITY: tuple[str, ...] = get_args(Group)  # every group is called after its plain effect

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class MeasuredResidual:
    """The residual of one unit in one group of records (at one temperature, or on one day), SI.

    residual: (t,) in the order of the region, 0 where not measured; covariance: (t, t); measured: (t,) flags
    power_ons, records: how many went in; freedom: of the spread, infinite when the budgets' was taken
    spread: measured spread over that of the budgets, 1 unless the data contradict them
    """

    unit: str
    temperature_degc: float
    day: float
    residual: Array
    covariance: Array
    measured: NDArray[np.bool_]
    power_ons: int
    records: int
    freedom: float = np.inf
    spread: float = 1.0


@dataclass(frozen=True)
class _Channel:
    """The sums of one channel: terms are places in the region; (R, p, p), (R, p), (R,) of every power-on."""

    sensor: Sensor
    terms: Indices
    squares: Array
    products: Array
    readings: Array
    spread: Array  # (R, p) run-to-run sigma
    records: Array  # (R,)


@dataclass(frozen=True)
class Groups:
    """Rows in the order of groups and power-ons.

    order: (n,) rows; runs: (R,) first row of every power-on; groups: (G,) first power-on of every group
    """

    order: Indices
    runs: Indices
    groups: Indices


def grouped(table: DwellTable, group: NDArray[np.int64]) -> Groups:
    """Rows sorted by group (n,), then power-on; a power-on never spans two groups."""
    order = np.lexsort((table.time_on, table.run, group))
    run, of = table.run[order], group[order]
    change = np.append(True, np.diff(of) != 0)
    runs = np.flatnonzero(change | np.append(True, np.diff(run) != 0))
    return Groups(order, runs, np.flatnonzero(change[runs]))


def check_residuals(
    table: DwellTable,
    group: NDArray[np.int64],
    models: Sequence[ErrorModel],
    region: AllowedRegion,
) -> tuple[MeasuredResidual, ...]:
    """One entry per group of rows, group (n,); the readings are of calibrated units.

    Raises InputError when the table has no readings or no references.
    """
    groups = grouped(table, group)
    channels = [c for s in SENSORS for c in _channels(table, groups, s, models, region)]
    if not channels:
        raise InputError(
            f"{table.source or 'the table'} has no readings with references: a check needs gyro_* with "
            "ref_rate_* or acc_* with ref_acc_*"
        )
    noise = {s: _noise([c for c in channels if c.sensor == s]) for s in SENSORS}
    return _collected(table, groups, region, [_fitted(c, groups, noise[c.sensor], region) for c in channels])


# ---------------------------------------------------------------- sums of every power-on


def _channels(
    table: DwellTable, groups: Groups, sensor: Sensor, models: Sequence[ErrorModel], region: AllowedRegion
) -> list[_Channel]:
    readings = table.gyro if sensor == "gyro" else table.acc
    reference = table.ref_rate if sensor == "gyro" else table.ref_acc
    if readings is None or reference is None:
        return []
    columns = columns_of(table.conditions(), sensor, models, region)
    error = (readings - reference)[groups.order]
    warmth = table.temperature_degc[groups.order][groups.runs]
    spread = {m.name: spread_of_power_on(m, warmth) for m in models}
    found = []
    for channel in range(3):
        terms = [t for t, X in columns.items() if np.any(X[:, channel])]
        if not terms:
            continue
        X = np.stack([columns[t][:, channel] for t in terms], axis=1)[groups.order]
        y = error[:, channel]
        found.append(
            _Channel(
                sensor,
                np.array(terms),
                np.add.reduceat(X[:, :, None] * X[:, None, :], groups.runs),
                np.add.reduceat(X * y[:, None], groups.runs),
                np.add.reduceat(y * y, groups.runs),
                np.stack([spread[region.terms[t].error] for t in terms], axis=1),
                np.diff(np.append(groups.runs, len(y))).astype(float),
            )
        )
    return found


def spread_of_power_on(model: ErrorModel, temperatures: Sequence[float] | Array) -> Array:
    """(n,) one sigma by which power-ons at temperatures (n,) differ: run-to-run, and in-run.

    A check's power-on is short beside the time constant of the in-run part: one draw of it for the whole.
    """
    return np.hypot(spread_at(model, list(temperatures)), model.in_run)


def columns_of(
    conditions: Conditions, sensor: Sensor, models: Sequence[ErrorModel], region: AllowedRegion
) -> dict[int, Array]:
    """Place in the region -> (n, 3) what a unit of the term adds to the channels."""
    known = {m.name for m in models}
    columns: dict[int, Array] = {}
    for error in dict.fromkeys(t.error for t in region.terms):
        if ErrorName(error).sensor != sensor or error not in known:
            continue
        effect = catalog.effects()[ErrorName(error).effect]
        values = effect.regressors(sensor, conditions)
        for i, term in enumerate(effect.terms(sensor)):
            place = region.index(error, term.name)
            if place is not None and term.name != ALL_AXES:
                columns[place] = values[:, :, i]
    return columns


def _noise(channels: Sequence[_Channel]) -> float:
    """σ² of a record: what is left within the power-ons after every power-on had its own coefficients."""
    left, freedom = 0.0, 0.0
    for c in channels:
        rest, own = _within(c)
        left += float(rest.sum())
        freedom += float(own.sum())
    floor = max((float((_LEAST_NOISE * c.spread[:, 0].max()) ** 2) for c in channels), default=0.0)
    return max(left / freedom if freedom >= 5 else 0.0, floor, 1e-24)


def _within(c: _Channel) -> tuple[Array, Array]:
    """(R,) squares that are left within each power-on beside coefficients of its own, and their freedom."""
    scale = np.sqrt(np.maximum(np.einsum("rpp->p", c.squares), 1e-300))
    squares = c.squares / np.outer(scale, scale)
    inverse = np.linalg.pinv(squares, rcond=1e-9, hermitian=True)
    explained = np.einsum("rp,rpq,rq->r", c.products / scale, inverse, c.products / scale)
    rank = np.linalg.matrix_rank(squares, tol=1e-9 * np.trace(squares, axis1=1, axis2=2), hermitian=True)
    own = np.maximum(c.records - rank, 0.0)
    return np.where(own > 0, np.maximum(c.readings - explained, 0.0), 0.0), own


# ---------------------------------------------------------------- least squares


@dataclass(frozen=True)
class _Fit:
    """Estimates of one channel in every group: (G, p), (G, p, p), (G, p) flags; misfit Q (G,), freedom."""

    channel: _Channel
    value: Array
    covariance: Array
    measured: NDArray[np.bool_]
    misfit: Array
    freedom: Array


def _fitted(c: _Channel, groups: Groups, variance: float, region: AllowedRegion) -> _Fit:
    """Information of every power-on, summed over the groups; in units of the terms' allowances."""
    unit = np.where(region.allowed[c.terms] > 0, region.allowed[c.terms], 1.0)
    A = c.squares * np.outer(unit, unit) / variance
    D = np.einsum("rp,pq->rpq", (c.spread / unit) ** 2, np.eye(len(unit)))
    eye = np.eye(len(unit))
    weight = np.linalg.inv(eye + A @ D)  # (I + A D)⁻¹ of every power-on
    b = c.products * unit / variance
    information = np.add.reduceat(weight @ A, groups.groups)
    moment = np.add.reduceat(np.einsum("rpq,rq->rp", weight, b), groups.groups)
    inner = np.einsum("rp,rpq,rq->r", b, D @ weight, b)
    total = np.add.reduceat(c.readings / variance - inner, groups.groups)
    rest, own = _within(c)
    total = total - np.add.reduceat(rest, groups.groups) / variance
    between = np.add.reduceat(c.records - own, groups.groups)  # what is left of the freedom: the power-ons'
    measured = identified(information, c.terms, region)
    safe = np.where(measured[:, :, None] & measured[:, None, :], information, 0.0)
    safe = safe + np.where(measured, 0.0, 1.0)[:, :, None] * eye
    covariance = np.linalg.inv(0.5 * (safe + safe.swapaxes(1, 2)))
    value = np.einsum("gpq,gq->gp", covariance, np.where(measured, moment, 0.0))
    value = np.where(measured, value, 0.0)
    covariance = covariance * (measured[:, :, None] & measured[:, None, :])
    misfit = total - np.einsum("gp,gp->g", value, np.where(measured, moment, 0.0))
    return _Fit(
        c,
        value * unit,
        covariance * np.outer(unit, unit),
        measured,
        misfit,
        between - measured.sum(axis=1),
    )


def identified(information: Array, terms: Indices, region: AllowedRegion) -> NDArray[np.bool_]:
    """(G, p) which terms a check tells better than their allowance; what mimics a prior term is dropped."""
    rank = np.array([_rank(region.terms[t].error) for t in terms])
    measured = np.diagonal(information, axis1=1, axis2=2) > 1.0
    for g in range(len(information)):
        while measured[g].any():
            own = np.flatnonzero(measured[g])
            error = _standard_errors(information[g][np.ix_(own, own)])
            bad = own[error > 1.0]
            if len(bad) == 0:
                break
            measured[g, bad[np.argmax(rank[bad])]] = False
    return np.asarray(measured)


def _rank(error: str) -> int:
    effect = ErrorName(error).effect
    return _PRIORITY.index(effect) if effect in _PRIORITY else len(_PRIORITY)


def _standard_errors(information: Array) -> Array:
    values, vectors = np.linalg.eigh(0.5 * (information + information.T))
    seen = values > 1e-10 * max(float(values[-1]), 1e-300)
    inverse = np.where(seen, 1.0 / np.where(seen, values, 1.0), 1e12)
    return np.asarray(np.sqrt(vectors**2 @ inverse))


# ---------------------------------------------------------------- together


def _collected(
    table: DwellTable, groups: Groups, region: AllowedRegion, fits: Sequence[_Fit]
) -> tuple[MeasuredResidual, ...]:
    count, terms = len(groups.groups), len(region.terms)
    value, covariance = np.zeros((count, terms)), np.zeros((count, terms, terms))
    measured = np.zeros((count, terms), dtype=bool)
    for f in fits:
        place = f.channel.terms
        value[:, place] = f.value
        covariance[np.ix_(np.arange(count), place, place)] = f.covariance
        measured[:, place] = f.measured
    ordered = groups.order
    first = ordered[groups.runs[groups.groups]]
    power_ons = np.diff(np.append(groups.groups, len(groups.runs)))
    starts = np.append(groups.runs[groups.groups], len(ordered))
    records = np.diff(starts)
    warmth = np.add.reduceat(table.temperature_degc[ordered], starts[:-1]) / records
    day = np.add.reduceat(table.day[ordered], starts[:-1]) / records
    found = [
        MeasuredResidual(
            str(table.unit[first[g]]),
            float(warmth[g]),
            float(day[g]),
            value[g],
            covariance[g],
            measured[g],
            int(power_ons[g]),
            int(records[g]),
        )
        for g in range(count)
    ]
    return _with_own_spread(found, fits)


def _with_own_spread(found: list[MeasuredResidual], fits: Sequence[_Fit]) -> tuple[MeasuredResidual, ...]:
    """Units that scatter more than their budgets take their own spread, with its degrees of freedom."""
    misfit, freedom = (sum(getattr(f, name) for f in fits) for name in ("misfit", "freedom"))
    units = len({r.unit for r in found})
    for g, one in enumerate(found):
        f, q = float(freedom[g]), float(misfit[g])
        if f >= 1 and chi_square_tail(q, f) < CONTRADICTED / max(units, 1):
            # a power-on has one draw per term, however many records it has
            own = max(1.0, min(f, float((one.power_ons - 1) * one.measured.sum())))
            factor = q / f
            found[g] = replace(
                one, covariance=one.covariance * factor, freedom=own, spread=float(np.sqrt(factor))
            )
    return tuple(found)
