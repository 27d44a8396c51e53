"""What a campaign leaves in flight, foreseen: covariances of what is asked of the rests of all errors.

The rest of a term in flight is what the unit has there less what its calibration says,

    e(T, t) = c + f(T) + r' + g'(t) + w(D) − Σ_n hat_n(T) θ̂_n,    θ̂ from the campaign (estimates)

and every chance of it is followed by itself: constants and curves that the tables miss, the walk up to the
flight, the flight's own power-on and drift, the campaign's runs, drift, noise and references. Nothing here is
the planner's: its information matrices are not asked, and curves count by verify's own second moments.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner.nouns.array import Array
from planner.spec.budget import STORAGE_DAYS
from planner.verify.draws import Exposed, Unit
from planner.verify.estimate_covariance import Estimates
from planner.verify.residuals import carrier, flying, share
from planner.verify.second_moments import Error, Moment

PARTS = ("run_to_run", "in_run", "storage", "temperature", "estimate")
Asked = Mapping[Error, Array]
"""Error -> (R, K, t): what is asked of its terms at the moments of the flight."""


@dataclass(frozen=True)
class Foresight:
    """A plan, its campaign and its flight. time: (K,) s, moments of the flight; day: of the flight."""

    unit: Unit
    estimates: Estimates
    time: Array
    day: float

    @property
    def errors(self) -> list[Error]:
        """Those that stand for themselves in flight."""
        return flying(list(self.unit.budgets))

    @cached_property
    def drift(self) -> dict[Error, Array]:
        """Every budgeted error -> (K, K) of its drift within the flight's power-on."""
        apart = np.abs(np.subtract.outer(self.time, self.time))
        return {
            error: budget.in_run_sigma**2 * np.exp(-apart / budget.in_run_time)
            for error, budget in self.unit.budgets.items()
        }

    def seen(self, asked: Asked, degc: Array) -> Seen:
        """What is asked of a flight at temperatures (K,)."""
        return Seen(self, degc, self._tables(asked, degc), self._flown(asked, degc))

    def _tables(self, asked: Asked, degc: Array) -> Array:
        """(R, P): what is asked of every coefficient, as tables are read in flight."""
        rows = len(next(iter(asked.values())))
        G = np.zeros((rows, len(self.estimates.noise)))
        for sensor, first, e in self.estimates.estimators:
            for effect, term in dict.fromkeys((c.effect, c.index) for c in e.model.columns):
                if (sensor, effect) in asked:
                    mine, weights = e.reads(effect, term, degc)
                    G[:, [first + i for i in mine]] = asked[sensor, effect][:, :, term] @ weights
        return G

    def _flown(self, asked: Asked, degc: Array) -> dict[Error, Array]:
        """Every budgeted error -> (R, K, t): what is asked of it, through the error that carries it."""
        every = list(self.unit.budgets)
        seen = Exposed(degc, self.time, self.day)
        found = {}
        for sensor, effect in every:
            by = carrier(sensor, effect, every)
            found[sensor, effect] = asked[sensor, by] * share(sensor, effect, by, degc, seen)
        return found

    def walked(self, G: Array, error: Error, own: Array) -> Array:
        """(R, R) of a walk of unit sigma in STORAGE_DAYS, from day 0 through the records to the flight."""
        days = self.estimates.days
        weights = np.concatenate([-_over(G, self.estimates.walk[error]), own.sum(axis=1)[:, :, None]], axis=2)
        later = np.cumsum(weights[:, :, ::-1], axis=2)[:, :, ::-1]  # each step is in all that follows
        width = np.diff(np.concatenate([[0.0], days, [max(self.day, days[-1])]])) / STORAGE_DAYS
        return _through(np.swapaxes(later, 1, 2), np.diag(width))

    def stored(self, own: Array) -> Array:
        """(R, R) of the same walk after the last day of the records alone."""
        flown = own.sum(axis=1)
        return np.asarray(flown @ flown.T * max(self.day - self.estimates.days[-1], 0.0) / STORAGE_DAYS)


@dataclass(frozen=True)
class Seen:
    """What is asked of one flight. degc: (K,); reads: (R, P) of coefficients; own: error -> (R, K, t)."""

    foresight: Foresight
    degc: Array
    reads: Array
    own: Mapping[Error, Array]

    @cached_property
    def rest(self) -> Array:
        """(R, R) of all but the curves."""
        return np.asarray(sum(self.without_curves().values()))

    def without_curves(self) -> dict[str, Array]:
        """Part -> (R, R) of all but the curves' own."""
        G, f, degc = self.reads, self.foresight, self.degc
        found = {part: np.zeros((len(G), len(G))) for part in PARTS}
        found["estimate"] += G @ f.estimates.noise @ G.T
        for error, own in self.own.items():
            budget = f.unit.budgets[error]
            constant = own.sum(axis=1) - G @ f.estimates.constant[error]
            found["estimate"] += budget.systematic_size**2 / 3.0 * constant @ constant.T
            stored = budget.storage_sigma**2 * f.stored(own)
            found["storage"] += stored
            found["estimate"] += budget.storage_sigma**2 * f.walked(G, error, own) - stored
            found["in_run"] += _through(own, f.drift[error])
            s, length = budget.run_to_run_sigma(degc), budget.temperature_correlation
            warmer = np.subtract.outer(degc, degc)
            alike = 1.0 if length is None else np.exp(-0.5 * (warmer / length) ** 2)
            found["run_to_run"] += _through(own, np.outer(s, s) * alike)
        return found

    def curves(self, moments: Mapping[Error, Moment]) -> Array:
        """(R, R) of what tables miss of the curves."""
        weights, missed = self.of_curves(), np.zeros(2 * (len(self.reads),))
        for error, moment in moments.items():
            at = moment.at(np.concatenate([self.foresight.estimates.degc, self.degc]))
            missed += _through(np.swapaxes(weights[error], 1, 2), at)
        return missed

    def misread(self, moments: Mapping[Error, Moment]) -> Array:
        """(R, R) of what thermometers do to the curves."""
        known, found = self.foresight.estimates, np.zeros(2 * (len(self.reads),))
        for error, moment in moments.items():
            for sigma, one in known.slope[error]:
                off = sigma**2 * moment.of_slopes(known.degc, sigma)
                found += _through(np.swapaxes(_over(self.reads, one), 1, 2), off)
        return found

    def of_curves(self) -> dict[Error, Array]:
        """Error -> (R, t, N + K) what its curve weighs at the records' temperatures, then in flight."""
        curve = self.foresight.estimates.curve
        return {
            error: np.concatenate([-_over(self.reads, curve[error]), np.swapaxes(own, 1, 2)], axis=2)
            for error, own in self.own.items()
        }


def _over(G: Array, estimates: Array) -> Array:
    """(R, P) · (P, t, N) -> (R, t, N)."""
    _, terms, records = estimates.shape
    return np.asarray((G @ estimates.reshape(-1, terms * records)).reshape(-1, terms, records))


def _through(rows: Array, kernel: Array) -> Array:
    """(R, R) Σ over terms of rows K rowsᵀ; rows: (R, K, t)."""
    by_term = np.moveaxis(rows, 2, 0)
    return np.asarray((by_term @ kernel @ np.swapaxes(by_term, 1, 2)).sum(axis=0))
