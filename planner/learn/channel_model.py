"""The declared error model of one channel over a dwell table: its columns, prediction and Jacobian.

    y = (1 + κ) v + b,   v = u_i + Σ_j m_j u_j,   κ v = S(v) k,   b = B β

B, S and the lean L come from the effects' regressors, S with the misaligned input v in place of u_i, so the
products of scale factor and misalignment are exact. A temperature effect is a table over the data's
temperatures (hat functions) in place of a constant and a slope.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from planner import catalog
from planner.learn.temperature_nodes import fitting_hats, nodes_with_rows, temperature_nodes
from planner.protocols import Effect, Parameter, Sensor
from planner.records import Array, Conditions

AXES = ("x", "y", "z")
TABLES = {"bias": "bias_temperature", "scale_factor": "scale_factor_temperature"}
EXCITED = 0.05  # share of the largest input, or the input itself (rad/s, m/s²), that shows a scale factor
EXCITING = {"gyro": 0.09, "accelerometer": 4.9}
REACH_K = 5.0
_STEP = 1e-4  # of a nonlinear parameter's logarithm, for its derivative


@dataclass(frozen=True)
class Column:
    """One coefficient: effect, term, and the node of its table (NaN: no table) or a nonlinear parameter."""

    effect: str
    term: str
    node_degc: float = float("nan")
    parameter: str = ""


@dataclass(frozen=True)
class ChannelModel:
    """One channel of one sensor over n rows.

    u: (n,) true input along the channel; bias_nodes, scale_nodes: (N,) of the tables, None: no table
    bias, scale, lean: effects of each group, by name, that act on this channel, with their term indices
    """

    sensor: Sensor
    channel: int
    conditions: Conditions
    bias_nodes: Array | None
    scale_nodes: Array | None
    bias: Mapping[str, tuple[int, ...]]
    scale: Mapping[str, tuple[int, ...]]
    lean: Mapping[str, tuple[int, ...]]
    held: tuple[tuple[str, str], ...] = ()  # nonlinear parameters that stay at their defaults

    @property
    def u(self) -> Array:
        """(n,) true input along the channel."""
        return sensed(self.sensor, self.conditions)[:, self.channel]

    def columns(self) -> tuple[Column, ...]:
        """The coefficients in the order of the Jacobian's columns."""
        plain = [
            column
            for group, nodes, table in (
                (self.bias, self.bias_nodes, "bias"),
                (self.scale, self.scale_nodes, "scale_factor"),
                (self.lean, None, ""),
            )
            for name, terms in group.items()
            for column in self._columns_of(name, terms, nodes if name == table else None)
        ]
        return (*plain, *(Column(e, "", parameter=p) for e, p in self.parameters()))

    def _columns_of(self, name: str, terms: tuple[int, ...], nodes: Array | None) -> list[Column]:
        every = catalog.effects()[name].terms(self.sensor)
        if nodes is not None:
            return [Column(name, every[t].name, float(node)) for t in terms for node in nodes]
        return [Column(name, every[t].name) for t in terms]

    def parameters(self) -> tuple[tuple[str, str], ...]:
        """(effect, parameter) of every nonlinear parameter that is fitted."""
        names = [*self.bias, *self.scale, *self.lean]
        every = ((name, p) for name in names for p in catalog.effects()[name].nonlinear)
        return tuple(pair for pair in every if pair not in self.held)

    def start(self) -> Array:
        """(p,) no error at all; parameters, as their scales carry them, at their defaults."""
        carried = [_parameter(e, p).carried(_parameter(e, p).default) for e, p in self.parameters()]
        return np.concatenate([np.zeros(len(self.columns()) - len(carried)), carried])


def sensed(sensor: Sensor, conditions: Conditions) -> Array:
    """(n, 3) what the sensor senses."""
    return conditions.rate if sensor == "gyro" else conditions.specific_force


def channel_model(
    sensor: Sensor, channel: int, conditions: Conditions, effects: tuple[str, ...]
) -> ChannelModel:
    """The model of one channel with the declared effects that act on it."""
    known = catalog.effects()
    mine = [known[name] for name in effects if sensor in known[name].sensors]
    declared = {effect.name for effect in mine}
    groups: dict[str, dict[str, tuple[int, ...]]] = {"bias": {}, "scale_factor": {}, "misalignment": {}}
    for effect in mine:
        name = _table_of(effect.name)
        terms = _terms_on(known[name], sensor, channel)
        if terms:
            groups[effect.group].setdefault(name, terms)
    u = np.abs(sensed(sensor, conditions)[:, channel])
    driven = u >= min(EXCITED * u.max(initial=0.0), EXCITING[sensor])
    nodes = temperature_nodes(conditions.temperature_degc)
    return ChannelModel(
        sensor,
        channel,
        conditions,
        nodes if TABLES["bias"] in declared else None,
        nodes_with_rows(nodes, conditions.temperature_degc[driven])
        if TABLES["scale_factor"] in declared
        else None,
        groups["bias"],
        groups["scale_factor"],
        groups["misalignment"],
    )


def _table_of(name: str) -> str:
    """A temperature effect is carried by the table of what it changes."""
    return next((plain for plain, warm in TABLES.items() if warm == name), name)


def _terms_on(effect: Effect, sensor: Sensor, channel: int) -> tuple[int, ...]:
    """Which of the effect's terms act on a channel: asked at conditions that leave none of them zero.

    A turn under load about no axis of the body, and rests on three faces.
    """
    rate, force = np.zeros((4, 3)), np.vstack([[9.0, 25.0, 16.0], 9.8 * np.eye(3)])
    rate[0] = 1.1, 0.7, 0.4
    one = np.ones(4)
    probe = Conditions(rate, force, 55.0 * one, 0.03 * one, 100.0 * one, 1e6 * one)
    acts = np.any(effect.regressors(sensor, probe)[:, channel] != 0.0, axis=0)
    return tuple(int(t) for t in np.flatnonzero(acts))


# ---------------------------------------------------------------- evaluation


@dataclass(frozen=True)
class Parts:
    """The model at one θ: v (n,), κ (n,), columns B, S, L, and the prediction (n,)."""

    v: Array
    kappa: Array
    B: Array
    S: Array
    L: Array
    predicted: Array


def evaluate(model: ChannelModel, theta: Array) -> Parts:
    """The model at θ (p,)."""
    nonlinear = _nonlinear(model, theta)
    B = _group(model, model.bias, model.conditions, nonlinear, model.bias_nodes, "bias")
    L = _group(model, model.lean, model.conditions, nonlinear, None, "")
    b, k, m = _split(model, theta, B.shape[1], L.shape[1])
    v = model.u + L @ m
    S = _group(model, model.scale, _driven_by(model, v), nonlinear, model.scale_nodes, "scale_factor")
    bent = S @ k
    kappa = np.divide(bent, v, out=np.zeros_like(v), where=np.abs(v) > 1e-9 * np.abs(v).max(initial=1e-30))
    return Parts(v, kappa, B, S, L, v + bent + B @ b)


def jacobian(model: ChannelModel, theta: Array, parts: Parts) -> Array:
    """(n, p) derivative of the prediction: B, S, (1 + κ) L, and nonlinear parameters by differences.

    κ stands for d(κv)/dv, which differs from it by the nonlinearity alone, 1e-3: Gauss-Newton still arrives.
    """
    columns = [parts.B, parts.S, (1.0 + parts.kappa)[:, None] * parts.L]
    count = len(model.parameters())
    for i in range(count):
        ahead, back = theta.copy(), theta.copy()
        ahead[len(theta) - count + i] += _STEP
        back[len(theta) - count + i] -= _STEP
        slope = (evaluate(model, ahead).predicted - evaluate(model, back).predicted) / (2.0 * _STEP)
        columns.append(slope[:, None])
    return np.concatenate(columns, axis=1)


def _split(model: ChannelModel, theta: Array, biases: int, leans: int) -> tuple[Array, Array, Array]:
    linear = theta[: len(theta) - len(model.parameters())]
    scales = len(linear) - biases - leans
    return linear[:biases], linear[biases : biases + scales], linear[biases + scales :]


def _nonlinear(model: ChannelModel, theta: Array) -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = {}
    names = model.parameters()
    for (effect, parameter), carried in zip(names, theta[len(theta) - len(names) :], strict=True):
        found.setdefault(effect, {})[parameter] = _parameter(effect, parameter).value(float(carried))
    return found


def _parameter(effect: str, name: str) -> Parameter:
    return next(p for p in catalog.effects()[effect].parameters if p.name == name)


def _driven_by(model: ChannelModel, v: Array) -> Conditions:
    """The conditions with the misaligned input v in place of the channel's own."""
    driven = sensed(model.sensor, model.conditions).copy()
    driven[:, model.channel] = v
    if model.sensor == "gyro":
        return replace(model.conditions, rate=driven)
    return replace(model.conditions, specific_force=driven)


def _group(
    model: ChannelModel,
    group: Mapping[str, tuple[int, ...]],
    conditions: Conditions,
    nonlinear: Mapping[str, Mapping[str, float]],
    nodes: Array | None,
    table: str,
) -> Array:
    """(n, columns) of one group of effects on the channel."""
    found = [np.empty((len(conditions.day), 0))]
    for name, terms in group.items():
        effect = catalog.effects()[name]
        full = effect.regressors(model.sensor, conditions, nonlinear.get(name))
        columns = full[:, model.channel, list(terms)]
        if name == table and nodes is not None:
            columns = columns * fitting_hats(
                conditions.temperature_degc, nodes, REACH_K
            )  # one term a channel
        found.append(columns)
    return np.concatenate(found, axis=1)
