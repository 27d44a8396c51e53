"""One channel under a given error model, its rows weighed by a covariance that is given too.

    θ ← θ + (JᵀV⁻¹J)⁺ JᵀV⁻¹ (y − f(θ)),   Gauss-Newton with V from elsewhere

For judging an error model on rows that it has not seen, and what a bench run would add: the variances come
once from all rows (diagnose.noise.channel_noise), and a fit without some of the rows is one more step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.measurement import ChannelModel, Parts, evaluate, jacobian
from planner.nouns.array import Array
from planner.solvers.block_covariance import BlockCovariance
from planner.solvers.least_squares import factors
from planner.solvers.random_effects import Covariance

_STEPS = 6  # the products are 1e-3 of the linear part, so three arrive
_SETTLED = 1e-3  # sigma of all rows together

Shapes = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Strays:
    """What a soaked chamber's straying adds to a record, by slopes of its tables' own at the nodes.

    columns: (n, k) SI per slope; steepest: (k,) one sigma of a slope, that of the chords beside its node
    """

    columns: Array
    steepest: Array


@dataclass(frozen=True)
class Spreads:
    """One sigma, SI. white: of a record of mean duration at rest; run: from power-on to power-on

    rate: share of the input that adds to it
    """

    white: float
    run: float
    rate: float


@dataclass(frozen=True)
class WeighedFit:
    """theta: (p,) as in ChannelModel; J: (n, q) derivative by its linear coefficients; residual: (n,) SI.

    strays: with slopes (k,) of its own; what they add is no residual
    v: covariance of the rows, spreads: what it is made of; far: (n,) rows that are outliers
    """

    model: ChannelModel
    theta: Array
    J: Array
    residual: Array
    strays: Strays
    slopes: Array
    v: Covariance | BlockCovariance
    spreads: Spreads
    far: NDArray[np.bool_]

    @property
    def design(self) -> Array:
        """(n, q + k) of the coefficients and the slopes."""
        return np.column_stack([self.J, self.strays.columns])

    @property
    def records_of_slopes(self) -> Array:
        """(k, q + k + 1) the slopes' prior as white records: design, and what they leave."""
        return _records_of(self.strays, self.slopes, self.J.shape[1])


def weighed_fit(
    model: ChannelModel,
    y: Array,
    v: Covariance | BlockCovariance,
    spreads: Spreads,
    far: NDArray[np.bool_],
    nonlinear: Shapes | None = None,
    strays: Strays | None = None,
) -> WeighedFit:
    """Fit one channel's readings y (n,) whose rows have the covariance v.

    nonlinear: effect -> parameter -> value; they are held, at their defaults when not given
    strays: what the rows may also follow, each slope 0 +- its steepest
    """
    theta, q = _start(model, nonlinear or {}), model.linear
    strays = strays or Strays(np.empty((len(y), 0)), np.empty(0))
    slopes = np.zeros(len(strays.steepest))
    for _ in range(_STEPS):
        parts = evaluate(model, theta)
        J = linear_jacobian(model, theta, parts)
        left = y - parts.predicted - strays.columns @ slopes
        white = v.whiten(np.column_stack([J, strays.columns, left]))
        known = np.vstack([model.sane(theta), _by_nature(model, theta)])
        known = np.insert(known, [q] * len(slopes), 0.0, axis=1)
        rows = np.vstack([white, known, _records_of(strays, slopes, q)])
        step = factors(rows[:, :-1]).solve(rows[:, -1])
        theta, slopes = theta.copy(), slopes + step[q:]
        theta[:q] += step[:q]
        if np.abs(white[:, :-1] @ step).max(initial=0.0) < _SETTLED:
            break
    parts = evaluate(model, theta)
    J = linear_jacobian(model, theta, parts)
    left = y - parts.predicted - strays.columns @ slopes
    return WeighedFit(model, theta, J, left, strays, slopes, v, spreads, far)


def _records_of(strays: Strays, slopes: Array, q: int) -> Array:
    k = len(slopes)
    return np.column_stack([np.zeros((k, q)), np.diag(1.0 / strays.steepest), -slopes / strays.steepest])


def _by_nature(model: ChannelModel, theta: Array) -> Array:
    """(s, q + 1) pseudo-records 0 = c + N(0, c_max²) of coefficients that have a largest one by nature.

    Of a lever arm one channel sees two parts only where the unit turns, the third by the Earth's rate alone:
    20 km, whose products with a misalignment left 3.7 m/s² where 2e-4 are noise, and a lever arm of 20 sigma
    "does not fall on unseen power-ons".
    """
    known = catalog.effects()
    most = [(known[c.effect].largest or {}).get(model.sensor) for c in model.columns() if not c.parameter]
    bound = [i for i, largest in enumerate(most) if largest is not None]
    rows = np.eye(model.linear + 1)[bound]
    rows[:, -1] = -theta[bound]
    return np.asarray(rows / np.array([most[i] for i in bound], dtype=float)[:, None])


def linear_jacobian(model: ChannelModel, theta: Array, parts: Parts) -> Array:
    """(n, q) derivative of the prediction by the linear coefficients alone."""
    return jacobian(model, theta, parts)[:, : model.linear]


def _start(model: ChannelModel, nonlinear: Shapes) -> Array:
    theta = model.start()
    for i, (effect, p) in enumerate(model.fitted_parameters):
        theta[model.linear + i] = p.carried(nonlinear.get(effect, {}).get(p.name, p.default))
    return theta
