"""True coefficients minus calibrated ones in flight, part by part: what the correction leaves.

    r = run_to_run + in_run + storage + temperature + estimate

temperature: the unit's curve minus the table through its own values at the nodes; estimate: that table minus
the calibrated one. So the parts are those of the plan's allowances, and their sum is exact.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from planner.campaign.channel_model import AXES, REACH_K
from planner.effects._channels import REFERENCE_DEGC
from planner.protocols import Sensor
from planner.records import Array
from planner.temperature_table import hats
from planner.verify.calibrations import ChannelEstimator
from planner.verify.draws import DrawnError, Exposed

PARTS = ("run_to_run", "in_run", "storage", "temperature", "estimate")
FOLDED = {"bias_temperature": "bias", "scale_factor_temperature": "scale_factor"}  # carried by its table


@dataclass(frozen=True)
class Left:
    """What is left of one error of B units at K moments of the flight, SI.

    parts: (5, B, K, t) in the order of PARTS; at_nodes: (B, N, t) error of the estimate at its nodes
    true, estimated: (B, K, t)
    """

    name: str
    sensor: Sensor
    effect: str
    terms: tuple[str, ...]
    parts: Array
    true: Array
    estimated: Array
    at_nodes: Array
    nodes_degc: Array

    @property
    def total(self) -> Array:
        """(B, K, t) true minus estimated."""
        return np.asarray(self.parts.sum(axis=0))


def left_over(
    errors: Sequence[DrawnError],
    estimators: Mapping[Sensor, Sequence[ChannelEstimator]],
    theta: Mapping[Sensor, Sequence[Array]],
    flight: Exposed,
) -> list[Left]:
    """Every budgeted error; those of one table are one."""
    return [_left(error, errors, estimators, theta, flight) for error in errors if not _folds(error, errors)]


def _folds(error: DrawnError, errors: Sequence[DrawnError]) -> bool:
    plain = FOLDED.get(error.effect)
    return plain is not None and any(e.sensor == error.sensor and e.effect == plain for e in errors)


def _left(
    error: DrawnError,
    errors: Sequence[DrawnError],
    estimators: Mapping[Sensor, Sequence[ChannelEstimator]],
    theta: Mapping[Sensor, Sequence[Array]],
    flight: Exposed,
) -> Left:
    units = len(error.constant)
    t = np.broadcast_to(flight.temperature_degc, (units, len(flight.time)))
    parts = np.zeros((5, units, len(flight.time), len(error.terms)))
    nodes_of: list[Array] = []
    at_nodes: list[Array] = []
    whole = [error, *_folded_into(error, errors)]
    estimated = np.zeros(parts.shape[1:])
    for i, term in enumerate(error.terms):
        parts[0, :, :, i] = sum(_scaled(e, e.run_to_run(t), t)[:, :, i] for e in whole)
        parts[1, :, :, i] = sum(_scaled(e, e.in_run, t)[:, :, i] for e in whole)
        parts[2, :, :, i] = sum(_scaled(e, e.storage[:, None, :], t)[:, :, i] for e in whole)
        own = _table(error, term, estimators[error.sensor], theta[error.sensor])
        curve = _systematic(whole, t, i)
        nodes = np.array([20.0]) if own is None else own[0]
        values = np.zeros((units, 1)) if own is None else own[1]
        at = _systematic(whole, np.broadcast_to(nodes, (units, len(nodes))), i)
        weights = hats(t.ravel(), nodes, REACH_K).reshape(*t.shape, -1)
        estimated[:, :, i] = np.einsum("bkn,bn->bk", weights, values)
        tabled = np.einsum("bkn,bn->bk", weights, at)
        parts[3, :, :, i] = curve - tabled
        parts[4, :, :, i] = tabled - estimated[:, :, i]
        nodes_of.append(nodes)
        at_nodes.append(at - values)
    true = estimated + parts.sum(axis=0)
    least = min(len(n) for n in nodes_of)
    stacked = np.stack([a[:, :least] for a in at_nodes], axis=2)
    return Left(
        error.name,
        error.sensor,
        error.effect,
        error.terms,
        parts,
        true,
        estimated,
        stacked,
        nodes_of[0][:least],
    )


def _folded_into(error: DrawnError, errors: Sequence[DrawnError]) -> Iterator[DrawnError]:
    for other in errors:
        if other.sensor == error.sensor and FOLDED.get(other.effect) == error.effect:
            yield other


def _scaled(error: DrawnError, value: Array, t: Array) -> Array:
    """An effect per kelvin acts with its distance from room temperature."""
    return value if error.effect not in FOLDED else value * (t - REFERENCE_DEGC)[..., None]


def _systematic(whole: Sequence[DrawnError], t: Array, term: int) -> Array:
    return np.asarray(sum(_scaled(e, e.systematic(t), t)[:, :, term] for e in whole))


def _table(
    error: DrawnError, term: str, channels: Sequence[ChannelEstimator], theta: Sequence[Array]
) -> tuple[Array, Array] | None:
    """Nodes (N,) and values (B, N) that a calibration gives a term; None when nobody calibrates it."""
    for estimator, values in zip(channels, theta, strict=True):
        columns = estimator.model.columns()[: estimator.count]
        mine = [i for i, c in enumerate(columns) if c.effect == error.effect and c.term == term]
        if mine:
            nodes = np.array([columns[i].node_degc for i in mine])
            if np.isnan(nodes).any():
                nodes = np.array([20.0])
            return nodes, values[:, mine]
    return None


def channel_of(term: str) -> int:
    """Index of the channel that a term such as `x` or `xy` belongs to."""
    return AXES.index(term[0])
