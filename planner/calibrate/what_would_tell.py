"""Which record would determine what the data cannot tell: found by trying records, not by rule.

A record adds rows to the design; the first group of records with which a coefficient takes part in no null
combination any more is the one that is named.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain, combinations

import numpy as np
from numpy.typing import NDArray

from planner.campaign.estimate import Estimate
from planner.measurement import evaluate, jacobian
from planner.nouns.array import Array
from planner.nouns.calibration import SensorCalibration
from planner.nouns.conditions import Conditions
from planner.protocols import AXES
from planner.solvers.least_squares import factors
from planner.units import STANDARD_GRAVITY_MPS2 as G

TURN = np.radians(90.0)
LOAD = 5.0 * G
WARMER_K = 20.0
LATER_DAYS = 30.0


def what_would_tell(fit: Estimate) -> list[str]:
    """A sentence for each group of records that would determine what this channel's data do not tell."""
    lost = np.flatnonzero(fit.fit.undetermined)
    if not len(lost):
        return []
    records = _records_for(fit, lost)
    told: dict[str, list[str]] = {}
    for i in lost.tolist():
        if i in records:
            told.setdefault(records[i], []).append(_name(fit, i))
    return [f"{', '.join(found)} would be determined by {record}" for record, found in told.items()]


def _name(fit: Estimate, i: int) -> str:
    column = fit.model.columns()[i]
    at = "" if np.isnan(column.node_degc) else f" at {column.node_degc:.0f} degC"
    return f"{column.effect}.{column.parameter or column.term}{at}"


def _records_for(fit: Estimate, lost: NDArray[np.int64]) -> dict[int, str]:
    """Coefficient -> the fewest groups of records, one or two, that determine it, where any do.

    All that are lost at one temperature are asked of the same designs.
    """
    columns, middle = fit.model.columns(), float(np.median(fit.model.conditions.temperature_degc))
    nodes = np.array([columns[i].node_degc for i in lost.tolist()])
    at = np.where(np.isnan(nodes), middle, nodes)
    found: dict[int, str] = {}
    for degc in np.unique(at).tolist():
        left = lost[at == degc]
        groups = [(words, _rows(fit, made)) for words, made in _candidates(degc)]
        for chosen in chain(combinations(groups, 1), combinations(groups, 2)):
            design = np.vstack([fit.J, *(rows for _, rows in chosen)])
            if len(left) and np.isfinite(design).all():
                still = factors(design).undetermined()[left]
                found |= dict.fromkeys(left[~still].tolist(), " and ".join(words for words, _ in chosen))
                left = left[still]
    return found


def _rows(fit: Estimate, conditions: Conditions) -> Array:
    """(m, p) rows of the design that records under these conditions would add."""
    model = replace(fit.model, conditions=conditions)
    return jacobian(model, fit.theta, evaluate(model, fit.theta))


def _candidates(degc: float) -> Iterator[tuple[str, Conditions]]:
    """Records in words, and their conditions, the cheaper first."""
    up = G * np.vstack([np.eye(3), -np.eye(3)])
    still = np.zeros((6, 3))
    for i, axis in enumerate(AXES):
        yield f"rests with {axis} up and down (ref_acc)", _conditions(still[:2], up[[i, i + 3]], degc)
    for i, axis in enumerate(AXES):
        both = TURN * np.outer([1.0, -1.0], np.eye(3)[i])
        yield (
            f"turns about {axis} both ways with a known rate (ref_rate)",
            _conditions(both, up[[(i + 1) % 3] * 2], degc),
        )
    yield "rests on all six faces at another temperature", _conditions(still, up, degc + WARMER_K)
    ramps = np.array([1.0, -1.0] * 3) / 60.0
    yield "rests while the temperature rises and falls", _conditions(still, up, degc, temperature_rate=ramps)
    since = np.linspace(0.0, 3600.0, 6)
    yield (
        "rests from power-on until the unit is warm (time_on_s)",
        _conditions(still, up, degc, time_on=since),
    )
    yield "rests on another day (day)", _conditions(still, up, degc, day=LATER_DAYS)
    for i, axis in enumerate(AXES):
        load = LOAD * np.outer([1.0, -1.0], np.eye(3)[i])
        yield f"loads of 5 g along {axis} both ways (ref_acc)", _conditions(still[:2], load, degc)
        rates = np.outer([TURN, 2 * TURN, -2 * TURN], np.eye(3)[i])
        yield f"turns about {axis} at several rates (ref_rate)", _conditions(rates, up[[2] * 3], degc)


def _conditions(
    rate: Array,
    force: Array,
    degc: float,
    *,
    temperature_rate: Array | float = 0.0,
    time_on: Array | float = 600.0,
    day: float = 0.0,
) -> Conditions:
    n = len(rate)
    return Conditions(
        rate=rate,
        specific_force=force,
        temperature_degc=np.full(n, degc),
        temperature_rate=np.broadcast_to(np.asarray(temperature_rate, dtype=float), n).copy(),
        time_on=np.broadcast_to(np.asarray(time_on, dtype=float), n).copy(),
        day=np.full(n, day),
    )


# ---------------------------------------------------------------- methods without references


def told_by_attitudes(a: Array, found: SensorCalibration) -> list[str]:
    """What rests in free attitudes lack for what they do not determine; a: (n, 3) readings at the rests."""
    lost = [c for c in found.coefficients if c.status == "undetermined"]
    if not lost:
        return []
    direction = a / np.maximum(np.linalg.norm(a, axis=1, keepdims=True), 1e-12)
    faces = [
        f"{axis} {word}"
        for i, axis in enumerate(AXES)
        for sign, word in ((1.0, "up"), (-1.0, "down"))
        if not (sign * direction[:, i] > 0.8).any()
    ]
    if faces:
        return [f"accelerometer: rests with {', '.join(faces)} would tell more of it"]
    between = [
        f"{AXES[i]} and {AXES[j]}"
        for i, j in combinations(range(3), 2)
        if not ((np.abs(direction[:, [i, j]]) > 0.4).all(axis=1)).any()
    ]
    if between:
        return [f"accelerometer: rests on an edge, half way between {'; '.join(between)}, would determine it"]
    return ["accelerometer: more rests, in attitudes unlike these, would determine it"]


def told_by_turns(found: SensorCalibration) -> list[str]:
    """The hand turns that would determine what others do not."""
    lost = {c.term[-1] for c in found.coefficients if c.status == "undetermined"}
    axes: Sequence[str] = sorted(lost & set(AXES))
    return (
        [f"gyro: turns about {', '.join(axes)} from rest to rest, with that axis level, would"]
        if axes
        else []
    )
