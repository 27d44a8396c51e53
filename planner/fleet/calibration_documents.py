"""calibration.json as numbers: coefficients with covariances, and what they say of the region's terms."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError
from planner.fleet.allowed_region import AllowedRegion
from planner.fleet.check_residual import MeasuredResidual
from planner.nouns.array import Array
from planner.nouns.calibration_file import calibration_tree
from planner.protocols import SENSORS
from planner.units import UnitError, display_factor

SAME_TEMPERATURE_K = 3.0  # nodes of both sensors that differ by less are one: chambers hold ±2 °C
DATE = re.compile(r"(?<!\d)(\d{4}-\d{2}-\d{2})(?!\d)")


@dataclass(frozen=True)
class CalibratedTerm:
    """One coefficient over temperature: error `gyro.bias`, term `x`; rows of the covariance; NaN: no node."""

    error: str
    term: str
    unit: str
    temperatures_degc: Array
    rows: NDArray[np.int64]


@dataclass(frozen=True)
class CalibratedUnit:
    """The coefficients of one calibration.json. value: (n,) SI; covariance: (n, n); when: text of its day."""

    unit: str
    source: str
    when: str | None
    terms: tuple[CalibratedTerm, ...]
    value: Array
    covariance: Array
    power_ons: int
    records: int


def is_calibration(path: Path) -> bool:
    """Whether a path is a calibration.json, or a folder with one."""
    return path.is_dir() or path.suffix.lower() == ".json"


def read_calibration(path: Path, when: str | None = None) -> CalibratedUnit:
    """A calibration.json, or the folder of one. when: its day, if the user says it.

    Otherwise the day is a date in the path, `2026-03-01/calibration.json`. Raises InputError for a file that
    is no calibration of planner, or holds no coefficient that its data determine.
    """
    file, document = calibration_tree(path)
    try:
        found = _unit(document, str(file), when or _date_in(file))
    except (KeyError, TypeError, ValueError, IndexError, UnitError, RecursionError, AttributeError) as error:
        raise InputError(f"{file} is no calibration.json of planner: {error!r}") from error
    if not found.terms:
        raise InputError(f"{file} holds no coefficient that its data determine")
    return found


def _date_in(file: Path) -> str | None:
    dates = DATE.findall(str(file))
    return dates[-1] if dates else None


def _unit(document: Mapping[str, Any], source: str, when: str | None) -> CalibratedUnit:
    terms: dict[tuple[str, str], list[tuple[float, int, str]]] = {}
    values: list[float] = []
    blocks: list[Array] = []
    runs, rows = 0, 0
    for sensor in SENSORS:
        if sensor not in document["sensors"]:
            continue
        part = document["sensors"][sensor]
        for channel, correlation in part["correlation"].items():
            own = [c for c in part["coefficients"] if c["channel"] == channel]
            known = [i for i, c in enumerate(own) if c["value"] is not None]
            scale = [display_factor(c["unit"]) for c in own]
            for i in known:
                c = own[i]
                node = np.nan if c["temperature_degc"] is None else float(c["temperature_degc"])
                terms.setdefault((c["error"], c["term"]), []).append((node, len(values), c["unit"]))
                values.append(float(c["value"]) * scale[i])
            error = np.array([float(own[i]["standard_error"]) * scale[i] for i in known])
            block = np.array(correlation, dtype=float)[np.ix_(known, known)] * np.outer(error, error)
            blocks.append(block.reshape(len(known), len(known)))
        left = list(part["residual"].values())
        runs = max([runs, *(int(r["runs"]) for r in left)])
        rows = max([rows, *(int(r["rows"]) for r in left)])
    return CalibratedUnit(
        str(document["unit"]),
        source,
        when,
        tuple(_term(error, term, places) for (error, term), places in terms.items()),
        np.array(values),
        _block_diagonal(blocks),
        runs,
        rows,
    )


def _term(error: str, term: str, places: Sequence[tuple[float, int, str]]) -> CalibratedTerm:
    ordered = sorted(places, key=lambda p: p[0])
    return CalibratedTerm(
        error, term, ordered[0][2], np.array([p[0] for p in ordered]), np.array([p[1] for p in ordered])
    )


def _block_diagonal(blocks: Sequence[Array]) -> Array:
    size = sum(len(b) for b in blocks)
    whole, at = np.zeros((size, size)), 0
    for b in blocks:
        whole[at : at + len(b), at : at + len(b)] = b
        at += len(b)
    return whole


# ---------------------------------------------------------------- terms at a temperature


def at_temperature(unit: CalibratedUnit, term: CalibratedTerm, temperature_degc: float) -> Array:
    """(n,) weights of the coefficients: a term between its nodes, the end nodes beyond them."""
    weights = np.zeros(len(unit.value))
    nodes = term.temperatures_degc
    if len(nodes) == 1 or np.isnan(nodes).any():
        weights[term.rows[0]] = 1.0
        return weights
    for k, row in enumerate(term.rows):
        weights[row] += np.interp(temperature_degc, nodes, np.eye(len(nodes))[k])
    return weights


def node_temperatures(unit: CalibratedUnit) -> tuple[float, ...]:
    """The temperatures of the tables, those of both sensors taken together; 20 degC when there are none."""
    every = np.sort(np.concatenate([t.temperatures_degc for t in unit.terms]))
    every = every[np.isfinite(every)]
    if len(every) == 0:
        return (20.0,)
    groups = np.split(every, np.flatnonzero(np.diff(every) > SAME_TEMPERATURE_K) + 1)
    return tuple(float(g.mean()) for g in groups)


def calibration_residuals(
    units: Sequence[CalibratedUnit], region: AllowedRegion, *, as_residual: bool
) -> tuple[MeasuredResidual, ...]:
    """What the calibrations of ONE unit say of its residual, an entry per temperature of the tables.

    One calibration: 0, as uncertain as its coefficients (they are corrected). Several: how far the last one
    has moved from the first, which is what corrects. as_residual: the coefficients of the last are the
    residual.
    """
    last, first = units[-1], units[0]
    several = len(units) > 1 and not as_residual
    found, nodes = [], node_temperatures(last)
    for temperature in nodes:
        residual, covariance, measured = _terms_at(last, region, temperature)
        if several:
            before, uncertain, known = _terms_at(first, region, temperature)
            both = measured & known
            residual, covariance = residual - before, covariance + uncertain
            residual, measured = np.where(both, residual, 0.0), both
            covariance = covariance * np.outer(both, both)
        elif not as_residual:
            residual = np.zeros_like(residual)
        found.append(
            MeasuredResidual(
                last.unit,
                temperature,
                0.0,
                residual,
                covariance,
                measured,
                max(1, round(last.power_ons / len(nodes))),
                max(1, round(last.records / len(nodes))),
            )
        )
    return tuple(found)


def _terms_at(
    unit: CalibratedUnit, region: AllowedRegion, temperature_degc: float
) -> tuple[Array, Array, NDArray[np.bool_]]:
    weights = np.zeros((len(region.terms), len(unit.value)))
    for term in unit.terms:
        place = region.index(term.error, term.term)
        if place is not None:
            weights[place] = at_temperature(unit, term, temperature_degc)
    measured = np.asarray(weights.any(axis=1))
    return weights @ unit.value, weights @ unit.covariance @ weights.T, measured
