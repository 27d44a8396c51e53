"""What a unit with known coefficients reads, and what it felt: the measurement equation and its inverse.

    y = (1 + κ(v)) v + b,   v = M u,   u = reference + R ρ        (`measurement`, K 2.1, eq. 5 and 6)

The inverse goes back step by step; each step is a contraction, since no unit leans or bends by much.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from planner.measurement import Entry, driven_by, entering, sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Effect, Sensor

_ROUNDS = 30  # of the inverse; a misalignment of 0.01 and a κ of 0.01 win two digits a round
_SETTLED = 1e-15


@dataclass(frozen=True)
class Acting:
    """An effect at work. values: (t,) coefficients, or (n, t) in every record, SI; parameters: its own."""

    effect: Effect
    values: Array
    parameters: Mapping[str, float] = field(default_factory=dict)


def response(sensor: Sensor, conditions: Conditions, acting: Sequence[Acting]) -> Array:
    """(n, 3) what the sensor reads without noise, SI: (1 + κ)(M u) + b."""
    u = sensed(sensor, conditions) + _added("reference", sensor, conditions, acting)
    v = u + _added("misalignment", sensor, driven_by(sensor, conditions, u), acting)
    misaligned = driven_by(sensor, conditions, v)
    bent = _added("scale_factor", sensor, misaligned, acting)
    return np.asarray(v + bent + _added("bias", sensor, conditions, acting))


def true_input(sensor: Sensor, y: Array, conditions: Conditions, acting: Sequence[Acting]) -> Array:
    """(n, 3) input u that readings y (n, 3) came from: the inverse of `response`, SI.

    conditions: the readings stand in for the true rate and force, which bias effects may ask for.
    """
    v = _unbent(sensor, y - _added("bias", sensor, conditions, acting), conditions, acting)
    straight = _without("misalignment", sensor, v, conditions, acting)
    return _without("reference", sensor, straight, conditions, acting)


def _without(
    entry: Entry, sensor: Sensor, v: Array, conditions: Conditions, acting: Sequence[Acting]
) -> Array:
    """(n, 3) u of which the effects of one entry make v (n, 3)."""
    if not any(entering(a.effect) == entry for a in acting):
        return v
    u = v
    for _ in range(_ROUNDS):
        before = u
        u = v - _added(entry, sensor, driven_by(sensor, conditions, u), acting)
        if _same(u, before):
            break
    return np.asarray(u)


def _unbent(sensor: Sensor, left: Array, conditions: Conditions, acting: Sequence[Acting]) -> Array:
    """v from (1 + κ) v = left: divided by 1 + κ(v) until it stands.

    A bend that folds back (a cubic of the wrong sign, far beyond the records it was fitted to) has no inverse
    there, and the rounds would run away to nan. No unit reads less than half of what it feels: v stays within
    twice the largest reading of the row.
    """
    v, most = left, 2.0 * np.abs(left).max(axis=1, keepdims=True, initial=0.0)
    if not any(entering(a.effect) == "scale_factor" for a in acting):
        return v
    for _ in range(_ROUNDS):
        before = v
        bent = _added("scale_factor", sensor, driven_by(sensor, conditions, v), acting)
        kappa = np.divide(bent, v, out=np.zeros_like(v), where=np.abs(bent) < 0.5 * np.abs(v))
        v = np.where(np.abs(bent) < 0.5 * np.abs(v), left / (1.0 + kappa), left - bent)
        v = np.clip(v, -most, most)
        if _same(v, before):
            break
    return np.asarray(v)


def _same(a: Array, b: Array) -> bool:
    size = float(np.nanmax(np.abs(a), initial=0.0))
    return bool(np.nanmax(np.abs(a - b), initial=0.0) <= _SETTLED * size)


def _added(entry: Entry, sensor: Sensor, conditions: Conditions, acting: Sequence[Acting]) -> Array:
    """(n, 3) of all effects that enter in one way."""
    total = np.zeros((len(conditions.day), 3))
    for a in acting:
        if entering(a.effect) == entry:
            regressors = a.effect.regressors(sensor, conditions, a.parameters)
            if a.values.ndim == 1:
                total += regressors @ a.values
            else:
                total += np.einsum("nct,nt->nc", regressors, a.values)
    return total
