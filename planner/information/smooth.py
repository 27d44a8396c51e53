"""Tables read by the posterior mean of a curve (`temperature_estimator: smooth`) instead of straight lines.

    θ̂(T) = w(T)ᵀ v̂,   v̂ the fitted nodes,   w by kriging from E f fᵀ + cov(v̂ − θ)

What the curves look like nobody knows: their prior is the mean of the second moments of all families for
which the promise must hold. Linear in v̂, so that every moment and quantile follows as for straight lines.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from planner.information.tables import last_of, nearest
from planner.nouns.array import Array
from planner.protocols import Sensor
from planner.solvers.kriging import kriging_weights
from planner.spec.model import Spec

Moments = Mapping[tuple[Sensor, str], Array]

NOWHERE = 1e20  # SI², the variance of what is no node: its weight is nothing


@dataclass(frozen=True)
class Smooth:
    """Who is read so. points: (N,) degC, ascending; prior: (sensor, effect) -> (N, N) at them, SI²

    low, high: degC of use; beyond these, and beyond the nodes, a table is constant
    """

    points: Array
    prior: Moments
    low: float
    high: float

    def weights(
        self, error: tuple[Sensor, str], temperature_degc: Array, nodes: Array, noise: Array
    ) -> Array:
        """(a, B, X, K) of nodes (B, K) with covariance (a, B, K, K) at temperatures (X,); infinite: none."""
        there = np.isfinite(nodes)
        ends = np.minimum(nodes[:, :1], self.low), np.maximum(last_of(nodes), self.high)
        # nodes that several visits share lie between theirs, kelvins apart at most
        own, read = nearest(self.points, nodes), nearest(self.points, np.clip(temperature_degc, *ends))
        M = self.prior[error]
        known = M[own[:, :, None], own[:, None, :]] * (there[:, :, None] & there[:, None, :])
        apart = np.where(there, 0.0, NOWHERE)[:, :, None] * np.eye(nodes.shape[1])
        across = M[own[:, :, None], read[:, None, :]] * there[:, :, None]
        return kriging_weights(known + noise + apart, across)


def smooth_of(spec: Spec, points: Array, moments: Callable[[Array], Mapping[str, Moments]]) -> Smooth | None:
    """How a spec's tables are read; None: by straight lines. moments: of every family at points (N,)."""
    if spec.plan.temperature_estimator == "lines":
        return None
    return Smooth(points, mixed(moments(points)), *spec.plan.temperatures.range)


def mixed(families: Mapping[str, Moments]) -> Moments:
    """The prior of every error with a curve: the mean of its second moments over the families."""
    errors = dict.fromkeys(
        error for moments in families.values() for error in moments if moments[error].any()
    )
    every = families.values()
    return {error: np.mean([m[error] for m in every if error in m], axis=0) for error in errors}
