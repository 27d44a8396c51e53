"""What a requirement asks of the rests of all errors, by the linear model of the flight; and its figure.

d = Σ asked · rest + what flies beside the errors; its covariance at each start gives the figure: the
quantile of |d| over all flights, or its root mean square. `at: any`: the quantile of the largest |d| over the
instants, by draws; the root mean square at the instant at which it is largest.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from planner.nouns.array import Array
from planner.spec.model import PercentileRule, Requirement
from planner.verify.draws import generator
from planner.verify.flight_columns import Columns
from planner.verify.flights import FlightModel, beside_coefficients, vectors_of
from planner.verify.foreseen import Asked, Seen
from planner.verify.lengths import mixed_quantile
from planner.verify.second_moments import Error, Moment

DRAWS = 100_000  # of flights, for a requirement at any moment: a 95 % quantile is then known to 0.3 %


@dataclass(frozen=True)
class Navigation:
    """One requirement. asked: error -> `Columns.responses`, R = instants · components; beside: (R, R).

    kept: what of its variances no campaign changes (variances), by starts and family
    """

    wanted: Requirement
    instants: int
    asked: Mapping[Error, Array]
    beside: Array
    columns: Columns
    kept: dict[tuple[object, ...], Array] = field(default_factory=dict)

    def at(self, degc: Array) -> Asked:
        """What is asked of a flight at temperatures (K,)."""
        return {error: self.columns.at(own, error[1], degc) for error, own in self.asked.items()}


def navigation(flight: FlightModel, wanted: Requirement, errors: Sequence[Error]) -> Navigation:
    """A requirement on a flight with errors."""
    vectors = vectors_of(flight.linear, flight.instants, wanted)
    rows = vectors.reshape(-1, vectors.shape[2])
    asked = {error: flight.columns.responses(rows, *error) for error in errors}
    beside = np.zeros((len(rows), len(rows)))
    for name, sigmas in flight.beside.sigmas(flight.trajectory).items():
        added = rows @ beside_coefficients(flight, {name: sigmas}, len(sigmas)).T
        beside += added @ added.T
    return Navigation(wanted, len(vectors), asked, beside, flight.columns)


def covariances(
    n: Navigation, flights: Sequence[Seen], families: Mapping[str, Mapping[Error, Moment]]
) -> dict[str, Array]:
    """Family -> (S, R, R) of S flights."""
    found: dict[str, list[Array]] = {family: [] for family in families}
    for seen in flights:
        for family, moments in families.items():
            found[family].append(seen.rest + n.beside + (seen.curves(moments) + seen.misread(moments)))
    return {family: np.array(several) for family, several in found.items()}


def figure(n: Navigation, covariances: Array, shares: Array) -> float:
    """The quantile or the root mean square of flights that have covariances (S, R, R) in shares (S,), SI."""
    rule = n.wanted.rule
    p = rule.percentile if isinstance(rule, PercentileRule) else None
    if p is None:
        return root_mean_square(n, np.diagonal(covariances, axis1=1, axis2=2), shares)
    if n.instants > 1:
        return weighed_quantile(*_longest(n, covariances, shares), p)
    return mixed_quantile(list(covariances), shares.tolist(), p)


def root_mean_square(n: Navigation, variances: Array, shares: Array) -> float:
    """At the instant at which it is largest, of flights that have variances (S, R) in shares (S,), SI."""
    return float(np.sqrt((shares @ variances).reshape(n.instants, -1).sum(axis=1).max()))


def _longest(n: Navigation, covariances: Array, shares: Array) -> tuple[Array, Array]:
    """Largest lengths over the instants of drawn flights, and the share that each stands for."""
    rng = generator(0, 0, "any moment")
    each = DRAWS // len(covariances)
    found = []
    for one in covariances:
        value, vector = np.linalg.eigh(one)
        kept = value > 1e-12 * value.max(initial=0.0)
        root = vector[:, kept] * np.sqrt(value[kept])
        d = (rng.normal(size=(each, root.shape[1])) @ root.T).reshape(each, n.instants, -1)
        found.append(np.linalg.norm(d, axis=2).max(axis=1))
    return np.concatenate(found), np.repeat(shares / each, each)


def weighed_quantile(values: Array, weights: Array, p: float) -> float:
    """The value within which a share p of the weights (n,) of values (n,) lies."""
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(weights[order]), p)])
