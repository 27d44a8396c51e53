"""The noise of one channel: which variances it has, and what each of them is called.

white noise of a record (∝ 1/duration), a part that averaging does not lower, a part that grows with the
input (temperature reading and rate errors times slope), and for every run a draw of each error that the
spec lets change from power-on to power-on (K 2.1). Their sizes come from the data by REML.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.learn.channel_model import ChannelModel, Parts
from planner.records import Array
from planner.solvers.random_effects import RandomEffects
from planner.solvers.reml import Variances, reml
from planner.spec.budget import ErrorBudget
from planner.spec.model import Spec

RATE_NOISE_FROM = {"gyro": 0.5, "accelerometer": 30.0}  # rad/s, m/s²: below, a reading's error is no noise
_WORTH = 3.3  # gain of log-likelihood that a further variance must bring: one per cent of a χ² with 1
LEAST_RUN_FREEDOM = 2
LEAST_WHITE = 1e-8  # of the run-to-run variance: readings without any noise must not make V singular
OPTIONAL = ("rate_noise", "constant")  # kept only when they are worth it


@dataclass(frozen=True)
class Component:
    """One variance: its kind (`white`, `constant`, `rate_noise`, `run_to_run`) and the error it spreads."""

    kind: str
    error: str


@dataclass(frozen=True)
class Noise:
    """The noise of one channel as the mixed model takes it.

    duration: mean of the records', s, to which the white variance belongs
    known: the run-to-run variances are the spec's, because the data have too few runs
    """

    components: tuple[Component, ...]
    effects: RandomEffects
    duration: float
    known: bool = False


def noise_model(
    model: ChannelModel,
    parts: Parts,
    starts: NDArray[np.int64],
    duration: Array,
    spec: Spec,
    weights: Array,
) -> Noise:
    """The variances that this channel can have; rows stand run by run.

    weights: (n,) of the robust fit, 1 for a row that is believed
    """
    sensor = model.sensor
    if duration.min() <= 0:  # a table without durations
        duration = np.ones_like(duration)
    white = duration.mean() / duration
    diagonals = {Component("white", f"{sensor}.bias"): white / weights}
    stray = _stray(model)
    if np.any(stray):
        diagonals[Component("temperature_stray", f"{sensor}.bias")] = stray**2 / weights
    if duration.max() > 1.5 * duration.min():
        diagonals[Component("constant", f"{sensor}.bias")] = np.ones_like(white) / weights
    if np.abs(model.u).max(initial=0.0) > RATE_NOISE_FROM[sensor]:
        diagonals[Component("rate_noise", f"{sensor}.scale_factor")] = model.u**2 / weights
    slopes = _slopes(model, parts, spec) if len(starts) < len(duration) else {}
    return Noise(
        (*diagonals, *slopes),
        RandomEffects(starts, np.array([*diagonals.values()]), _stack(slopes, len(duration))),
        float(duration.mean()),
    )


def _stray(model: ChannelModel) -> Array:
    """(n,) kelvins from the nearest node of the bias table; zero without a table of several nodes.

    The unit's curve has a slope of its own at a node, which the chords to the next nodes do not know.
    """
    nodes, t = model.bias_nodes, model.conditions.temperature_degc
    if nodes is None or len(nodes) < 2:
        return np.zeros(len(t))
    return np.asarray(np.min(np.abs(t[:, None] - nodes[None, :]), axis=1))


def _stack(slopes: dict[Component, Array], n: int) -> Array:
    return np.array([*slopes.values()]) if slopes else np.empty((0, n))


def _slopes(model: ChannelModel, parts: Parts, spec: Spec) -> dict[Component, Array]:
    """What every power-on draws anew: bias and scale factor always, others if the spec says so."""
    sensor = model.sensor
    found = {}
    for name, columns, always in (
        ("bias", np.ones((len(parts.v), 1)), True),
        ("scale_factor", parts.v[:, None], bool(model.scale)),
        ("misalignment", _own(model, parts), False),
    ):
        budget: ErrorBudget | None = getattr(spec.unit, sensor).get(name)
        spread = _spread_shape(budget, model.conditions.temperature_degc)
        if spread is None and not always:
            continue
        shape = np.ones(len(parts.v)) if spread is None else spread
        for i in range(columns.shape[1]):
            axis = "" if columns.shape[1] == 1 else str(i)
            if np.any(columns[:, i]):
                found[Component("run_to_run", f"{sensor}.{name}{axis}")] = columns[:, i] * shape
    return found


def _own(model: ChannelModel, parts: Parts) -> Array:
    """The lean's columns that are misalignment itself."""
    first = 0
    for name, terms in model.lean.items():
        if name == "misalignment":
            return parts.L[:, first : first + len(terms)]
        first += len(terms)
    return parts.L[:, :0]


def _spread_shape(budget: ErrorBudget | None, temperature_degc: Array) -> Array | None:
    """(n,) run-to-run spread over temperature relative to its mean, as the spec's table has it."""
    if budget is None or budget.run_to_run_largest <= 0:
        return None
    table = budget.run_to_run_table
    if table is None:
        return np.ones(len(temperature_degc))
    sigma = budget.run_to_run_sigma(temperature_degc)
    return np.asarray(np.maximum(sigma, 1e-3 * max(table.values())) / np.mean([*table.values()]))


def without_idle(noise: Noise, found: Variances, y: Array, X: Array) -> tuple[Noise, Variances]:
    """The noise without the components whose variance is zero or not worth having, refitted."""
    keep = [
        i
        for i, component in enumerate(noise.components)
        if i == 0 or found.theta[i] > 0 or component == noise.components[0]
    ]
    slim = chosen(noise, keep)
    found = reml(y, X, slim.effects, found.theta[keep])
    for i in reversed(range(1, len(slim.components))):
        if slim.components[i].kind in OPTIONAL:
            fewer = chosen(slim, [j for j in range(len(slim.components)) if j != i])
            less = reml(y, X, fewer.effects)
            if found.loglik - less.loglik < _WORTH:
                slim, found = fewer, less
    return slim, found


def chosen(noise: Noise, keep: list[int]) -> Noise:
    """The noise with some of its components only."""
    a = len(noise.effects.diagonals)
    effects = RandomEffects(
        noise.effects.starts,
        noise.effects.diagonals[[i for i in keep if i < a]],
        noise.effects.slopes[[i - a for i in keep if i >= a]],
    )
    return Noise(tuple(noise.components[i] for i in keep), effects, noise.duration, noise.known)


def spec_variances(noise: Noise, spec: Spec, white: float) -> Variances:
    """Variances when the data cannot give them: run-to-run from the spec, white noise as given (SI²)."""
    theta = np.array([_from_spec(component, spec, white) for component in noise.components])
    a, K = len(noise.effects.diagonals), len(theta)
    between = theta[a:] @ np.mean(noise.effects.slopes**2, axis=1) if a < K else 0.0
    theta[0] = max(theta[0], LEAST_WHITE * between)
    return Variances(theta, np.zeros((K, K)), theta > 0, float("nan"), True)


def _from_spec(component: Component, spec: Spec, white: float) -> float:
    if component.kind != "run_to_run":
        return white if component.kind == "white" else 0.0
    sensor, name = component.error.rstrip("01").split(".")
    budget: ErrorBudget | None = getattr(spec.unit, sensor).get(name)
    if budget is None:
        return 0.0
    table = budget.run_to_run_table
    sigma = budget.run_to_run_largest if table is None else np.mean([*table.values()])
    return float(sigma) ** 2


def run_freedom(X: Array, effects: RandomEffects) -> int:
    """How many differences between runs the coefficients leave to estimate the run-to-run spread from."""
    means = effects.sums(X) / effects.sums(np.ones((len(X), 1)))
    return len(effects.starts) - int(
        np.linalg.matrix_rank(means, tol=1e-9 * max(1e-300, np.abs(means).max()))
    )
