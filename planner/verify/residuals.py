"""True coefficients minus calibrated ones in flight, part by part: what the correction leaves.

    r = run_to_run + in_run + storage + temperature + estimate

temperature: the unit's curve minus the table through its own values at the nodes; estimate: that table minus
the calibrated one. So the parts are those of the plan's allowances, and their sum is exact. An effect that a
table carries (`tabled`, `temperature_of`) is part of the one that it changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from planner import catalog
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.sensor import ErrorName
from planner.protocols import Sensor
from planner.verify.calibrations import Estimator
from planner.verify.draws import DrawnError, Exposed

PARTS = ("run_to_run", "in_run", "storage", "temperature", "estimate")
_ROOM = np.array([20.0])  # where the one value of an error without a table stands


@dataclass(frozen=True)
class Left:
    """What is left of one error of B units at K moments of the flight, SI.

    parts: (5, B, K, t) in the order of PARTS; at_nodes: (B, N, t) error of the estimate at its nodes
    true, estimated: (B, K, t); temperature_degc: (B, K)
    """

    name: ErrorName
    sensor: Sensor
    effect: str
    terms: tuple[str, ...]
    parts: Array
    true: Array
    estimated: Array
    at_nodes: Array
    nodes_degc: Array
    temperature_degc: Array

    @property
    def total(self) -> Array:
        """(B, K, t) true minus estimated."""
        return np.asarray(self.parts.sum(axis=0))


def carrier(sensor: Sensor, effect: str, errors: Sequence[tuple[Sensor, str]]) -> str:
    """The error that an error flies as: itself, or the one in whose table it is carried."""
    known = catalog.effects()[effect]
    plain = known.temperature_of
    return plain if known.tabled and plain is not None and (sensor, plain) in errors else effect


def flying(errors: Sequence[tuple[Sensor, str]]) -> list[tuple[Sensor, str]]:
    """The errors (sensor, effect) that stand for themselves in flight."""
    return [(s, e) for s, e in errors if carrier(s, e, errors) == e]


def left_over(
    errors: Sequence[DrawnError],
    estimators: Mapping[Sensor, Sequence[Estimator]],
    theta: Mapping[Sensor, Sequence[Array]],
    flight: Exposed,
) -> list[Left]:
    """Every budgeted error; those of one table are one."""
    names = [(e.sensor, e.effect) for e in errors]
    found = []
    for sensor, effect in flying(names):
        whole = [e for e in errors if e.sensor == sensor and carrier(sensor, e.effect, names) == effect]
        found.append(_left(effect, whole, estimators[sensor], theta[sensor], flight))
    return found


def _left(
    effect: str,
    whole: Sequence[DrawnError],
    estimators: Sequence[Estimator],
    theta: Sequence[Array],
    flight: Exposed,
) -> Left:
    error = next(e for e in whole if e.effect == effect)
    units = len(error.constant)
    t = np.broadcast_to(flight.temperature_degc, (units, len(flight.time)))
    parts = np.zeros((5, units, len(flight.time), len(error.terms)))
    for e in whole:
        part = share(e.sensor, e.effect, effect, t, flight)
        parts[0] += part * e.run_to_run
        parts[1] += part * e.in_run
        parts[2] += part * e.storage[:, None, :]
    curve = _systematic(whole, effect, t, flight)
    nodes_of, at_nodes = [], []
    estimated = np.zeros(parts.shape[1:])
    for i, term in enumerate(error.terms):
        nodes, values, weights = _table(effect, term, estimators, theta, t)
        at = _systematic(whole, effect, np.broadcast_to(nodes, (units, len(nodes))), flight)[:, :, i]
        estimated[:, :, i] = np.einsum("bkn,bn->bk", weights, values)
        tabled = np.einsum("bkn,bn->bk", weights, at)
        parts[3, :, :, i] = curve[:, :, i] - tabled
        parts[4, :, :, i] = tabled - estimated[:, :, i]
        nodes_of.append(nodes)
        at_nodes.append(at - values)
    least = min(len(n) for n in nodes_of)
    return Left(
        error.name,
        error.sensor,
        effect,
        error.terms,
        parts,
        estimated + parts.sum(axis=0),
        estimated,
        np.stack([a[:, :least] for a in at_nodes], axis=2),
        nodes_of[0][:least],
        t,
    )


def _systematic(whole: Sequence[DrawnError], effect: str, t: Array, flight: Exposed) -> Array:
    """(B, K, t) constants and curves at temperatures (B, K), in the terms of the carrying effect."""
    return np.asarray(sum(share(e.sensor, e.effect, effect, t, flight) * e.systematic(t) for e in whole))


def share(sensor: Sensor, own: str, effect: str, t: Array, flight: Exposed) -> Array | float:
    """(B, K, terms) what one unit of an error is in units of the effect that carries it, at temperatures.

    Asked of both effects' regressors under a turn and a load about no axis of the body.
    """
    if own == effect:
        return 1.0
    rows = t.size
    seen = Conditions(
        rate=np.tile([1.1, 0.7, 0.4], (rows, 1)),
        specific_force=np.tile([9.0, 25.0, 16.0], (rows, 1)),
        temperature_degc=t.ravel(),
        temperature_rate=np.zeros(rows),
        time_on=np.full(rows, float(np.mean(flight.time))),
        day=np.full(rows, flight.day),
    )
    alone, carrying = (catalog.effects()[e].regressors(sensor, seen) for e in (own, effect))
    size = np.sum(carrying**2, axis=1)
    found = np.sum(alone * carrying, axis=1) / np.where(size > 0, size, 1.0)
    return np.asarray(found.reshape(*t.shape, -1))


def _table(
    effect: str, term: str, estimators: Sequence[Estimator], theta: Sequence[Array], t: Array
) -> tuple[Array, Array, Array]:
    """Nodes (N,), values (B, N) that a calibration gives a term, their weights (B, K, N) at temperatures t.

    Zero where nobody calibrates it.
    """
    for estimator, values in zip(estimators, theta, strict=True):
        for c in estimator.model.columns:
            if (c.effect, c.term) == (effect, term):
                mine, weights = estimator.reads(effect, c.index, t)
                nodes = np.array([estimator.model.columns[i].node_degc for i in mine])
                return (_ROOM if np.isnan(nodes).any() else nodes), values[:, mine], weights
    return _ROOM, np.zeros((len(t), 1)), np.ones((*t.shape, 1))
