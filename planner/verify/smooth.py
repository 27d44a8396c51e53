"""Tables read smoothly (`temperature_estimator: smooth`), by verify's own arithmetic.

What a table says at T is the best linear unbiased guess of a constant and a curve there from the fitted
nodes, which err. Bordered by the condition that the weights sum to one,

    [ M + C  1 ] [ w ]   [ m(T) ]
    [  1ᵀ    0 ] [ λ ] = [   1  ]

M, m: second moments of the curves, the mean over the families for which the promise must hold; C: of the
nodes' errors. Constant beyond the range of use and the nodes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from planner.nouns.array import Array
from planner.spec.curve_names import families_of
from planner.spec.model import Spec
from planner.verify.families import curves_in
from planner.verify.nodes import read
from planner.verify.second_moments import BLOCK, Error, Moment, mean_of, moments_of

CURVES = BLOCK  # of every family: moments known to 5 % cost weights a thousandth of what they leave
TAIL = 3.0  # times the median size, beyond which a prior takes no curve: few would be most of its moment
SMALL = 1e-9  # of the nodes' mean variance, on its diagonal: two nodes of a smooth curve are nearly one


@dataclass(frozen=True)
class Tables:
    """How a calibration's tables are read.

    prior: error -> second moments of its curves by family; of errors without any: straight lines
    low, high: degC of use
    """

    prior: Mapping[Error, Sequence[Moment]] = field(default_factory=dict)
    low: float = 0.0
    high: float = 0.0

    def weights(self, error: Error, degc: Array, nodes: Array, noise: Array) -> Array:
        """(..., N) of the nodes (N,) at temperatures (...); noise: (N, N) of the nodes' estimates, SI²."""
        if error not in self.prior:
            return read(degc, nodes)
        n, t = len(nodes), np.clip(degc, min(self.low, nodes[0]), max(self.high, nodes[-1])).ravel()
        K = self._moment(error, nodes, nodes) + noise
        scale = float(np.trace(K)) / n
        bordered, right = np.ones((n + 1, n + 1)), np.ones((n + 1, len(t)))
        bordered[:n, :n] = K / scale + SMALL * np.eye(n)
        bordered[n, n] = 0.0
        right[:n] = self._moment(error, nodes, t) / scale
        found = np.linalg.solve(bordered, right)[:n]
        return np.asarray(found.T.reshape(*np.shape(degc), n))

    def _moment(self, error: Error, one: Array, other: Array) -> Array:
        return np.asarray(sum(m.between(one, other) for m in self._mean[error]))

    @cached_property
    def _mean(self) -> dict[Error, list[Moment]]:
        """Error -> moments whose sum is the mean over the families."""
        return {error: mean_of(several) for error, several in self.prior.items()}


LINES = Tables()


def tables_of(spec: Spec) -> Tables:
    """How `planner calibrate` reads tables for a spec."""
    if spec.plan.temperature_estimator == "lines":
        return LINES
    return Tables(prior_of(spec), *spec.plan.temperatures.range)


def prior_of(spec: Spec) -> dict[Error, list[Moment]]:
    """Error -> second moments of its curves, of every family for which the promise must hold."""
    prior: dict[Error, list[Moment]] = {}
    for family in families_of(spec):
        for error, moment in moments_of(curves_in(spec, family), CURVES, TAIL).items():
            prior.setdefault(error, []).append(moment)
    return {error: several for error, several in prior.items() if any(m.value.any() for m in several)}
