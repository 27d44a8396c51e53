"""Dwell table → one linear problem a channel: what the declared model leaves, and the columns it can move.

The declared fit comes off first with its products, y = (1 + κ)(M u) + b, so that scale factor times
misalignment is no missing effect; what follows is linear in small quantities,

    r = J δ + G γ + noise,

J the Jacobian of the declared model at its fit, G the columns of a candidate.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.campaign.channel_model import EXCITING, channel_model
from planner.campaign.parameters import limited
from planner.measurement import ChannelModel, as_sensed, entering, evaluate, jacobian, sensed
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.sensor import channel_name
from planner.protocols import Sensor
from planner.solvers.least_squares import least_squares
from planner.temperature_table import GAP_K, REACH_K, nodes_with_rows, strays_only, temperature_nodes

SOAKED_K = 1.0  # a soaked chamber holds its temperature to that, and a sweep passes it in a fifth of its rows
SOAKED = 0.5  # share of a node's rows within SOAKED_K of it, from which the chamber soaks there
LEAST_NODES = 4  # that a cubic spline needs
ROUNDING = 1e-9  # of the largest value of a table, below which its bends are none
TOLD = 1e-8  # of a combination of columns of unit length: a table of nine digits tells no less apart
LARGEST = 0.3  # of a scale factor's error or a lean's: instruments are within a few per cent
_WEIGHED = 3  # what a fit of leans of 800 % leaves is no noise: the next ones leave it
_ROUNDS = 8  # Gauss-Newton: the products are 1e-3 of the linear part, so three rounds arrive


@dataclass(frozen=True)
class Channel:
    """One channel of one sensor over n rows that stand run by run.

    theta: (p,) of the fit of the declared effects and those of `found`, products and all
    y: (n,) reading; r: (n,) what the declared effects leave of it
    J: (n, q) columns of the declared effects, then the slopes of their tables at the nodes, which are free
    steep: (n, q) by how much a column grows per kelvin at its node; 0 of all but slopes
    most: (q,) the largest coefficient that a column can have: of a slope the steepest chord beside its node
    lean: (n,) 1 + κ, by which a candidate that leans the input is multiplied
    driven: the conditions with the misaligned input in place of the channel's own, for scale-factor effects
    """

    sensor: Sensor
    axis: int
    model: ChannelModel
    found: tuple[str, ...]
    theta: Array
    y: Array
    r: Array
    J: Array
    steep: Array
    most: Array
    lean: Array
    driven: Conditions

    @property
    def name(self) -> str:
        """`gyro_x` …"""
        return channel_name(self.sensor, self.axis)

    @cached_property
    def predicted(self) -> Array:
        """(n,) of the reading, by the fit."""
        return evaluate(self.model, self.theta).predicted

    @property
    def u(self) -> Array:
        """(n,) true input along the channel."""
        return self.model.u

    @property
    def across(self) -> Array:
        """(n,) size of the true input across the channel."""
        both = np.delete(sensed(self.sensor, self.model.conditions), self.axis, axis=1)
        return np.asarray(np.linalg.norm(both, axis=1))


def channel(
    sensor: Sensor,
    axis: int,
    conditions: Conditions,
    y: Array,
    effects: tuple[str, ...],
    found: tuple[str, ...] = (),
    free: Array | None = None,
) -> Channel:
    """One channel with the declared effects taken off.

    free: (n, k) columns that may have any size, beside those of the declared effects
    found: effects that were found strong already. They are fitted along, so that their products with the
    declared ones are right, and their linear part is then given back: it stays what has to be explained.

    What the last digits of the references alone tell apart is left out. At rest the squares of the forces are
    a bias, all but rounding: of a cross-coupling the bias was 270 g, and noise of that size hid everything.
    """
    model = channel_model(sensor, axis, conditions, (*effects, *found))
    return _at(model, found, _of_a_unit(model, _fitted(model, y), y), y, free)


def _fitted(model: ChannelModel, y: Array, weight: Array | None = None) -> Array:
    """(p,) θ of least |y − h(θ)|² + |weight · θ|², weight: (p,) of what is known before; None: nothing."""
    theta = model.start()
    parts = evaluate(model, theta)
    known = np.empty((0, len(theta))) if weight is None else np.diag(weight)[weight > 0.0]
    for _ in range(_ROUNDS):
        J = jacobian(model, theta, parts)
        left = np.concatenate([y - parts.predicted, -known @ theta])
        step, _ = least_squares(np.vstack([J, known]), left, TOLD)
        theta = limited(model, theta, theta + step)
        parts = evaluate(model, theta)
        moved, most = np.abs(J @ step).max(initial=0.0), np.abs(y - parts.predicted).max(initial=0.0)
        if moved <= 1e-9 * max(most, 1e-300):
            break
    return theta


def _of_a_unit(model: ChannelModel, theta: Array, y: Array) -> Array:
    """(p,) θ whose scale factors and leans are those of an instrument, where the records tell others.

    What no turn tells, the Earth's rate alone does, and its noise made scale factors and leans of several
    hundred per cent: of turns about two slanting axes one combination of the three. They are fitted once more
    as what instruments have, LARGEST / 3 as one sigma, beside the noise that the fit leaves. Their products
    where the unit turns are right then: left out, they were a misalignment over temperature of 97 sigma on
    channels that had none. Where that does not help, or no record has an input, none of the products is real,
    and they go: a step of the bias between power-ons of unlike faces made a g-sensitivity of 36 sigma. The
    columns stay.
    """
    rest = hardly_driven(model)
    if not rest and not _too_large(model, theta):
        return theta
    known, groups = catalog.effects(), ("scale_factor", "misalignment")
    scales = np.array([not c.parameter and entering(known[c.effect]) in groups for c in model.columns()])
    if not rest:
        for _ in range(_WEIGHED):
            noise = float(np.sqrt(np.mean(np.square(y - evaluate(model, theta).predicted))))
            theta = _fitted(model, y, scales * noise / (LARGEST / 3.0))
    if rest or _too_large(model, theta):
        theta = np.where(scales, 0.0, theta)
    return theta


def _too_large(model: ChannelModel, theta: Array) -> bool:
    """Whether a lean or a scale factor of the fit changes an input by more than LARGEST of the largest."""
    parts, u = evaluate(model, theta), sensed(model.sensor, model.conditions)
    size = np.abs(u).max(axis=1, initial=0.0)
    lean = float(np.abs(parts.v - model.u).max(initial=0.0))
    bend = float(np.max(np.abs(parts.kappa) * size, initial=0.0))  # nothing, at a node where nothing turns
    return max(lean, bend) > LARGEST * float(size.max(initial=0.0))


def hardly_driven(model: ChannelModel) -> bool:
    """Whether no record has an input: a gyro that only rests reads the Earth's rate."""
    u = sensed(model.sensor, model.conditions)
    return float(np.abs(u).max(initial=0.0)) < EXCITING[model.sensor]


def at_rows(c: Channel, conditions: Conditions, y: Array, free: Array | None = None) -> Channel:
    """The channel's fit, read at other rows."""
    return _at(replace(c.model, conditions=conditions), c.found, c.theta, y, free)


def _at(model: ChannelModel, found: tuple[str, ...], theta: Array, y: Array, free: Array | None) -> Channel:
    parts = evaluate(model, theta)
    leaning = sensed(model.sensor, model.conditions).copy()
    leaning[:, model.channel] = parts.v
    name = "rate" if model.sensor == "gyro" else "specific_force"
    driven = replace(model.conditions, **{name: leaning})
    J, given_back = _declared(model, found, theta, jacobian(model, theta, parts))
    slopes, steep, most = _slopes(model, driven, parts.v, theta)
    free = np.empty((len(y), 0)) if free is None else free
    return Channel(
        sensor=model.sensor,
        axis=model.channel,
        model=model,
        found=found,
        theta=theta,
        y=y,
        r=y - parts.predicted + given_back,
        J=np.column_stack([J, slopes, free]),
        steep=np.column_stack([np.zeros_like(J), steep, np.zeros_like(free)]),
        most=np.concatenate([np.full(J.shape[1], np.inf), most, np.full(free.shape[1], np.inf)]),
        lean=1.0 + parts.kappa,
        driven=driven,
    )


def _declared(model: ChannelModel, found: tuple[str, ...], theta: Array, J: Array) -> tuple[Array, Array]:
    """(n, q) columns of the declared effects alone, and (n,) the linear part of those that were found.

    A table that only a found temperature effect has made collapses to its sum, the declared constant.
    """
    names = [c.effect for c in model.columns()]
    linear = [not c.parameter for c in model.columns()]
    tables = _collapsed(found)
    extra = [i for i, name in enumerate(names) if (name in found or name in tables) and linear[i]]
    kept = declared_columns(model, found)
    sums = [
        J[:, [i for i, name in enumerate(names) if name == table]].sum(axis=1)
        for table in sorted(tables.intersection(names))
    ]
    return np.column_stack([J[:, kept], *sums]), J[:, extra] @ theta[extra]


def declared_columns(model: ChannelModel, found: tuple[str, ...]) -> list[int]:
    """Which of the model's coefficients have the first columns of J, in their order."""
    gone = _collapsed(found).union(found)
    return [i for i, c in enumerate(model.columns()) if c.effect not in gone]


def _collapsed(found: tuple[str, ...]) -> set[str]:
    known = catalog.effects()
    return {known[e].temperature_of or e for e in found if known[e].tabled}.difference(found)


def _slopes(model: ChannelModel, driven: Conditions, v: Array, theta: Array) -> tuple[Array, Array, Array]:
    """(n, k) slope of each table at each node: a soaked chamber strays, and a chord is no tangent.

    Without them the reading's own slope at a node, 1e-5 g from 0.05 K, counts as something missing.
    Also (n, k) what a slope adds per kelvin, and (k,) the steepest chord of the table beside the node; a
    table of one node may have any slope.
    """
    t = model.conditions.temperature_degc
    found, steep, most = [np.empty((len(t), 0))], [np.empty((len(t), 0))], [np.empty(0)]
    for (name, term), place in tables(model).items():
        effect = catalog.effects()[name]
        index = [x.name for x in effect.terms(model.sensor)].index(term)
        scale = effect.group == "scale_factor"
        conditions = driven if scale else model.conditions
        column = effect.regressors(model.sensor, conditions)[:, model.channel, index]
        nodes = np.array([model.columns()[i].node_degc for i in place])
        nearest = np.argmin(np.abs(t[:, None] - nodes[None, :]), axis=1)
        near = (nearest[:, None] == np.arange(len(nodes))[None, :]) & _strays(t, nodes, nearest)
        found.append(near * ((t - nodes[nearest]) * column)[:, None])
        steep.append(near * column[:, None])
        most.append(_steepest(nodes, theta[place]))
        others = [np.hstack([_bends(t, nodes, theta[place]), _beyond(t, nodes)]) * column[:, None]]
        others += [_untold(model, v, nodes)] if scale else []
        for other in others:
            found.append(other)
            steep.append(np.zeros_like(other))
            most.append(np.full(other.shape[1], np.inf))
    return np.concatenate(found, axis=1), np.concatenate(steep, axis=1), np.concatenate(most)


def _strays(t: Array, nodes: Array, nearest: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n, N) rows that stray about a node at which the chamber soaks; all where it sweeps.

    Between soaked points a slope of its own at each of them would take up what a ramp does.
    """
    near = (np.abs(t - nodes[nearest]) <= GAP_K) | strays_only(nodes, nearest, t - nodes[nearest])[nearest]
    soaked = np.abs(t - nodes[nearest]) <= SOAKED_K
    count = np.maximum(np.bincount(nearest, minlength=len(nodes)), 1)
    share = np.bincount(nearest, soaked, len(nodes)) / count
    swept = float(np.median(share)) < SOAKED  # a sweep that rests somewhere is a sweep all the same
    return np.asarray(np.broadcast_to((near | swept)[:, None], (len(t), len(nodes))))


def _bends(t: Array, nodes: Array, values: Array) -> Array:
    """(n, 1 or 0) what a smooth curve through the table has beyond its straight lines, between the nodes.

    A unit has a curve; rows on a ramp lie between the points at which the table knows it.
    """
    from scipy.interpolate import CubicSpline

    if len(nodes) < LEAST_NODES:
        return np.empty((len(t), 0))
    inside = np.clip(t, nodes[0], nodes[-1])
    order = np.argsort(nodes)
    smooth = CubicSpline(nodes[order], values[order])(inside)
    bends = smooth - np.interp(inside, nodes[order], values[order])
    if np.abs(bends).max(initial=0.0) <= ROUNDING * np.abs(values).max(initial=0.0):
        return np.empty((len(t), 0))  # every row at a node
    return np.asarray(bends[:, None])


def _beyond(t: Array, nodes: Array) -> Array:
    """(n, k) kelvins beyond each end node and their square: a ramp goes on where no table knows the unit.

    The table is constant from there; a bias of 1.5e-4 g/K that is not is 11 sigma of white noise after 3 K.
    """
    ordered = np.sort(nodes)
    out = [np.maximum(side - SOAKED_K, 0.0) for side in (ordered[0] - t, t - ordered[-1])]
    return np.column_stack([np.empty((len(t), 0)), *(d**k for d in out if d.any() for k in (1, 2))])


def tables(model: ChannelModel) -> dict[tuple[str, str], list[int]]:
    """(effect, term) that a table over temperature carries -> which of the coefficients are its nodes."""
    found: dict[tuple[str, str], list[int]] = {}
    for i, c in enumerate(model.columns()):
        if np.isfinite(c.node_degc):
            found.setdefault((c.effect, c.term), []).append(i)
    return found


def _untold(model: ChannelModel, v: Array, told: Array) -> Array:
    """(n, k) scale factor at temperatures where only other axes turned: no table says what it is there.

    It acts on what leans in: at 500 deg/s about the next axis its error of 1e-5 is a lean over temperature.
    """
    t = model.conditions.temperature_degc
    u = np.linalg.norm(sensed(model.sensor, model.conditions), axis=1)
    nodes = nodes_with_rows(temperature_nodes(t), t[u > EXCITING[model.sensor]])
    nearest = np.argmin(np.abs(t[:, None] - nodes[None, :]), axis=1)
    off = np.abs(nodes[:, None] - told[None, :]).min(axis=1)
    untold = np.flatnonzero(off > REACH_K)
    return np.asarray((nearest[:, None] == untold[None, :]) * v[:, None])


def _steepest(nodes: Array, values: Array) -> Array:
    """(N,) the largest slope that a table can have at each of its nodes, per kelvin; any, where there is one.

    The larger of the two chords c beside a node; at an end also the tangent of the parabola through the last
    three, c₁ + (c₁ − c₂) h₁ / (h₁ + h₂), h the gaps: from one chord a curve may turn away in its last gap.
    """
    if len(nodes) < 2:
        return np.full(len(nodes), np.inf)
    gaps = np.diff(nodes)
    chords = np.diff(values) / gaps
    size = np.abs(chords)
    most = np.maximum(np.append(size, 0.0), np.append(0.0, size))
    for end, first, next_ in ((0, 0, 1), (-1, -1, -2)) if len(nodes) > 2 else ():
        bent = (chords[first] - chords[next_]) * gaps[first] / (gaps[first] + gaps[next_])
        most[end] = max(float(most[end]), abs(float(chords[first] + bent)))
    return np.asarray(most)


def columns(c: Channel, effect: str, nonlinear: Mapping[str, float] | None = None) -> Array:
    """(n, n_terms) what each term of an effect adds to the channel's reading, SI per SI unit."""
    return columns_of_all([c], effect, nonlinear)[c.axis]


def usual_columns(c: Channel, effect: str) -> list[Array]:
    """(n,) of every coefficient of an effect that the channel reads, its parameters at their defaults."""
    found = catalog.effects().get(effect)
    if found is None:
        return []
    return [x for x in columns(c, effect, {p.name: p.default for p in found.parameters}).T if x.any()]


def columns_of_all(
    channels: Sequence[Channel], effect: str, nonlinear: Mapping[str, float] | None = None
) -> dict[int, Array]:
    """The same of every channel of one sensor, by its axis: what all have in common is worked out once."""
    found = catalog.effects()[effect]
    out: dict[int, Array] = {}
    every, of = np.empty(0), None
    for c in channels:
        conditions = c.driven if found.group == "scale_factor" else c.model.conditions
        if conditions is not of:
            every, of = np.asarray(found.regressors(c.sensor, conditions, nonlinear)), conditions
        entry = entering(found)
        added = as_sensed(c.model, c.theta, every) if entry == "reference" else every[:, c.axis, :]
        out[c.axis] = added * c.lean[:, None] if entry in ("misalignment", "reference") else added
    return out
