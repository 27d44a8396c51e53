"""The measurement equation and its Jacobian, once for all who measure, fit or correct.

    y_i = (1 + κ_i)(M u)_i + b_i + noise

u is the true rate or specific force, M = I + small misalignments, κ all scale-factor effects of a channel, b
all its bias effects (K 2.1, eq. 5 and 6). Every effect enters by its group: those of `misalignment` turn the
input, v = M u; those of `scale_factor` are asked with the misaligned input, κ v = S(v) k; those of `bias`
add, b = B β. So the product of scale factor and misalignment is exact.

What is the bench's alone (`bench_only`) is no error of the unit: it changes the true input, u = reference +
R ρ, and comes to a channel through M and κ like all of it. An arm that leans by 0.1 deg under 40 g turns
1600 deg/s by 2.8 deg/s, of which a misalignment of 0.3 deg carries 0.015 deg/s to the next channel.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.conditions import Conditions, Swinging
from planner.protocols import Effect, Parameter, Sensor
from planner.temperature_table import REACH_K, fitting_hats

AXES = ("x", "y", "z")
Entry = Literal["bias", "scale_factor", "misalignment", "reference"]
ENTRIES: tuple[Entry, ...] = ("bias", "scale_factor", "misalignment", "reference")
INPUT: Mapping[Sensor, str] = {"gyro": "rate", "accelerometer": "specific_force"}
REACHED = 0.1  # weight of a node in some record, below which the records do not tell what it has
_STEP = 1e-4  # of a parameter's logarithm, or of its range, for its derivative


def sensed(sensor: Sensor, conditions: Conditions) -> Array:
    """(n, 3) what the sensor senses: rate or specific force."""
    return conditions.rate if sensor == "gyro" else conditions.specific_force


def input_size(sensor: Sensor, conditions: Conditions) -> Array:
    """(n,) size of what the sensor senses, root mean square over a record in which gravity goes round."""
    size = np.linalg.norm(sensed(sensor, conditions), axis=1)
    if sensor == "gyro" or not isinstance(conditions, Swinging):
        return np.asarray(size)
    return np.asarray(np.hypot(size, np.sqrt(np.sum(conditions.swing**2, axis=2).mean(axis=1))))


def driven_by(sensor: Sensor, conditions: Conditions, u: Array) -> Conditions:
    """The conditions with u (n, 3) in place of what the sensor senses."""
    return replace(conditions, **{INPUT[sensor]: u})


def entering(effect: Effect) -> Entry:
    """How an effect enters the equation: by its group; what is the bench's alone, by the reference.

    Of what the records do not say enough (`misfit`) no product is known, and it enters by its group.
    """
    return "reference" if effect.bench_only and not effect.misfit else effect.group


# ---------------------------------------------------------------- one channel by its coefficients


SANE = 0.3  # one sigma of a scale factor of which nothing is known: no sensor is further off its input


@dataclass(frozen=True)
class Column:
    """One coefficient: effect, term, and the node of its table (NaN: no table) or a parameter's name."""

    effect: str
    term: str
    node_degc: float = float("nan")
    parameter: str = ""


@dataclass(frozen=True)
class Carried:
    """The terms of one effect on a channel; nodes: (N,) degC of the table that carries it, or None."""

    effect: Effect
    terms: tuple[int, ...]
    nodes: Array | None = None

    @property
    def count(self) -> int:
        """How many coefficients it has."""
        return len(self.terms) * (1 if self.nodes is None else len(self.nodes))


@dataclass(frozen=True)
class ChannelModel:
    """One channel of one sensor over n rows: y = v + S(v) k + B β, v = u + R ρ + L(u + R ρ) m.

    carried: its effects in the order in which they enter, those of the bias first, those of the bench last
    held: (effect, parameter) that stay at their defaults
    """

    sensor: Sensor
    channel: int
    conditions: Conditions
    carried: tuple[Carried, ...]
    held: tuple[tuple[str, str], ...] = ()

    @property
    def u(self) -> Array:
        """(n,) true input along the channel."""
        return sensed(self.sensor, self.conditions)[:, self.channel]

    def of(self, entry: Entry) -> tuple[Carried, ...]:
        """The effects that enter in one way."""
        return tuple(c for c in self.carried if entering(c.effect) == entry)

    def nodes_of(self, effect: str) -> Array | None:
        """(N,) nodes of an effect's table; None where it has none."""
        return next((c.nodes for c in self.carried if c.effect.name == effect), None)

    def columns(self) -> tuple[Column, ...]:
        """The coefficients in the order of the Jacobian's columns; parameters stand last."""
        plain = [column for c in self.carried for column in _columns_of(c, self.sensor)]
        return (*plain, *(Column(e, "", parameter=p.name) for e, p in self.fitted_parameters))

    @cached_property
    def fitted_parameters(self) -> tuple[tuple[str, Parameter], ...]:
        """(effect, parameter) of every parameter that is fitted."""
        every = ((c.effect.name, p) for c in self.carried for p in c.effect.parameters)
        return tuple(pair for pair in every if (pair[0], pair[1].name) not in self.held)

    @cached_property
    def scales(self) -> list[int]:
        """Columns of the scale factor itself."""
        return [i for i, c in enumerate(self.columns()) if c.effect == "scale_factor" and not c.parameter]

    def sane(self, theta: Array) -> Array:
        """(s, q + 1) pseudo-records 0 = k + N(0, SANE²) of the scale factors: columns, and what θ lacks.

        A gyro that no record turns about its axis sees its scale factor by the Earth's rate, where −4 may be
        as good as 0: its products with a misalignment that others drive at 800 deg/s do not settle.
        """
        rows = np.eye(self.linear + 1)[self.scales] / SANE
        rows[:, -1] = -theta[self.scales] / SANE
        return rows

    def shares(self, column: Column) -> bool:
        """Whether the sensor's other channels have the same coefficient; a parameter: one of its terms."""
        carried = next(c for c in self.carried if c.effect.name == column.effect)
        terms = carried.effect.terms(self.sensor)
        if column.parameter:
            return any(terms[t].shared for t in carried.terms)
        return next(t for t in terms if t.name == column.term).shared and carried.nodes is None

    @property
    def linear(self) -> int:
        """How many coefficients are linear; the parameters stand behind them."""
        return sum(c.count for c in self.carried)

    def with_input(self, v: Array) -> Conditions:
        """The conditions with the misaligned input v (n,) in place of the channel's own."""
        driven = sensed(self.sensor, self.conditions).copy()
        driven[:, self.channel] = v
        return driven_by(self.sensor, self.conditions, driven)

    def start(self) -> Array:
        """(p,) no error at all; parameters, as they are carried, at their defaults."""
        return np.array([0.0] * self.linear + [p.carried(p.default) for _, p in self.fitted_parameters])

    def parameters_at(self, theta: Array) -> dict[str, dict[str, float]]:
        """effect -> parameter -> value at θ (p,); held ones are not named."""
        found: dict[str, dict[str, float]] = {}
        for (effect, p), carried in zip(self.fitted_parameters, theta[self.linear :], strict=True):
            found.setdefault(effect, {})[p.name] = p.value(float(carried))
        return found

    @cached_property
    def hats(self) -> Mapping[str, Array]:
        """Effect -> (n, N) weights of the nodes of its table: no input and no θ changes the temperatures."""
        t = self.conditions.temperature_degc
        return {c.effect.name: fitting_hats(t, c.nodes, REACH_K) for c in self.carried if c.nodes is not None}

    @cached_property
    def fixed(self) -> Mapping[Entry, Array]:
        """Columns B and L where no parameter is fitted: they do not depend on θ."""
        entries: tuple[Entry, ...] = ("bias", "misalignment")
        return {
            entry: _columns(self, entry, self.conditions, {})
            for entry in entries
            if not any(e == c.effect.name for c in self.of(entry) for e, _ in self.fitted_parameters)
        }


def _columns_of(c: Carried, sensor: Sensor) -> list[Column]:
    every = c.effect.terms(sensor)
    if c.nodes is None:
        return [Column(c.effect.name, every[t].name) for t in c.terms]
    return [Column(c.effect.name, every[t].name, float(node)) for t in c.terms for node in c.nodes]


@dataclass(frozen=True)
class Parts:
    """The model at one θ: v (n,), κ (n,), the columns of every entry, and the prediction (n,)."""

    v: Array
    kappa: Array
    B: Array
    S: Array
    L: Array
    R: Array
    predicted: Array


def misaligned(model: ChannelModel, theta: Array) -> Array:
    """(n,) v at θ (p,): what `evaluate` begins with, a tenth of its work."""
    return _turned(model, theta, model.parameters_at(theta))[0]


def evaluate(model: ChannelModel, theta: Array) -> Parts:
    """The model at θ (p,)."""
    parameters = model.parameters_at(theta)
    v, L, R = _turned(model, theta, parameters)
    B = _fixed(model, "bias", parameters)
    S = _columns(model, "scale_factor", model.with_input(v), parameters)
    b, k = np.split(theta[: B.shape[1] + S.shape[1]], [B.shape[1]])
    bent = S @ k
    is_input = (np.abs(v) > 1e-9 * np.abs(v).max(initial=1e-30)) & ~_swings(model)
    kappa = np.divide(bent, v, out=np.zeros_like(v), where=is_input)
    return Parts(v, kappa, B, S, L, R, v + bent + B @ b)


def as_sensed(model: ChannelModel, theta: Array, added: Array) -> Array:
    """(n, k) what k changes of the true input (n, 3, k), SI, are along the channel: M's row of each.

    θ (p,) has the channel's misalignments; their parameters, if they have any, stand as in θ.
    """
    parameters, own = model.parameters_at(theta), model.of("misalignment")
    if not own:
        return np.asarray(added[:, model.channel])
    m = _coefficients(model, theta, "misalignment")
    through = [
        _columns(model, "misalignment", driven_by(model.sensor, model.conditions, added[:, :, i]), parameters)
        @ m
        for i in range(added.shape[2])
    ]
    return np.asarray(added[:, model.channel] + np.stack(through, axis=1))


def _turned(
    model: ChannelModel, theta: Array, parameters: Mapping[str, Mapping[str, float]]
) -> tuple[Array, Array, Array]:
    """v (n,), columns L and R (n, ·): the true input, which the bench may change, and what the unit leans."""
    m = _coefficients(model, theta, "misalignment")
    if not model.of("reference"):
        L = _fixed(model, "misalignment", parameters)
        return np.asarray(model.u + L @ m), L, np.empty((len(model.u), 0))
    rho = _coefficients(model, theta, "reference")
    added = _of_the_bench(model, parameters)
    u = sensed(model.sensor, model.conditions) + added @ rho
    L = _columns(model, "misalignment", driven_by(model.sensor, model.conditions, u), parameters)
    return np.asarray(u[:, model.channel] + L @ m), L, as_sensed(model, theta, added)


def _fixed(model: ChannelModel, entry: Entry, parameters: Mapping[str, Mapping[str, float]]) -> Array:
    """(n, columns) of an entry under the conditions as the table has them."""
    known = model.fixed.get(entry)
    return _columns(model, entry, model.conditions, parameters) if known is None else known


def _of_the_bench(model: ChannelModel, parameters: Mapping[str, Mapping[str, float]]) -> Array:
    """(n, 3, k) what each coefficient of the bench adds to the true input."""
    every = []
    for c in model.of("reference"):
        full = c.effect.regressors(model.sensor, model.conditions, parameters.get(c.effect.name))
        every.append(full[:, :, list(c.terms)])
    return np.concatenate(every, axis=2)


def _swings(model: ChannelModel) -> NDArray[np.bool_]:
    """(n,) records whose mean input, beside one that goes round, says of no bend what it is a share of."""
    if model.sensor == "gyro" or not isinstance(model.conditions, Swinging):
        return np.zeros(len(model.conditions.day), dtype=bool)
    return np.asarray(np.any(model.conditions.swing[:, :, model.channel], axis=1))


def jacobian(model: ChannelModel, theta: Array, parts: Parts) -> Array:
    """(n, p) derivative of the prediction: B, S, (1 + κ) L, (1 + κ) R, and parameters by differences.

    κ stands for d(κv)/dv, which differs from it by the nonlinearity alone, 1e-3: Gauss-Newton still arrives.
    """
    lean = (1.0 + parts.kappa)[:, None]
    columns = [parts.B, parts.S, lean * parts.L, lean * parts.R]
    for i, (_, p) in enumerate(model.fitted_parameters):
        step = _STEP * (1.0 if p.scale == "logarithmic" else p.bounds[1] - p.bounds[0])
        ahead, back = theta.copy(), theta.copy()
        ahead[model.linear + i] += step
        back[model.linear + i] -= step
        slope = (evaluate(model, ahead).predicted - evaluate(model, back).predicted) / (2.0 * step)
        columns.append(slope[:, None])
    return np.concatenate(columns, axis=1)


def _coefficients(model: ChannelModel, theta: Array, entry: Entry) -> Array:
    """(k,) of all effects that enter in one way."""
    before = ENTRIES[: ENTRIES.index(entry)]
    first = sum(c.count for e in before for c in model.of(e))
    return theta[first : first + sum(c.count for c in model.of(entry))]


def reached(weights: Array) -> NDArray[np.bool_]:
    """(k,) nodes, of weights (n, k), that some record comes near.

    A soaked chamber moves by a hundredth of a kelvin a minute: divided by that, the noise of a record would
    stand at the node of 2 K/min.
    """
    return np.asarray(np.abs(weights).max(axis=0, initial=0.0) >= REACHED)


def _columns(
    model: ChannelModel,
    entry: Entry,
    conditions: Conditions,
    parameters: Mapping[str, Mapping[str, float]],
) -> Array:
    """(n, columns) of the effects that enter the channel in one way."""
    found = [np.empty((len(conditions.day), 0))]
    for c in model.of(entry):
        full = c.effect.regressors(model.sensor, conditions, parameters.get(c.effect.name))
        columns = full[:, model.channel, list(c.terms)]
        if getattr(c.effect, "nodal", False):
            columns = columns * reached(columns)
        if c.nodes is not None:
            hats = model.hats[c.effect.name]
            columns = (columns[:, :, None] * hats[:, None, :]).reshape(len(columns), -1)
        found.append(columns)
    return np.concatenate(found, axis=1)
