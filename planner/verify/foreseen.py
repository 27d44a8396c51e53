"""What a campaign leaves in flight, foreseen: covariances of what is asked of the rests of all errors.

The rest of a term in flight is what the unit has there less what its calibration says,

    e(T, t) = c + f(T) + r' + g'(t) + w(D) − Σ_n hat_n(T) θ̂_n,    θ̂ from the campaign (estimates)

and every chance of it is followed by itself: constants and curves that the tables miss, the walk up to the
flight, the flight's own power-on and drift, the campaign's runs, drift, noise and references. Nothing here is
the planner's: its information matrices are not asked, and curves count by verify's own second moments.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from planner.nouns.array import Array
from planner.spec.budget import STORAGE_DAYS
from planner.verify.draws import Exposed, Unit
from planner.verify.estimate_covariance import Estimates
from planner.verify.residuals import carrier, flying, share
from planner.verify.second_moments import Error, Moment
from planner.verify.strays import squares

PARTS = ("run_to_run", "in_run", "storage", "temperature", "estimate")
KEPT = 48  # drifts of 3 MB where 120 instants ask for three components each at 240 moments
FAMILIES = 8  # whose moments' part in the estimates is kept
REMEMBERED = 128  # starts whose tables are read once for all requirements and families
Asked = Mapping[Error, Array]
"""Error -> (R, K, t): what is asked of its terms at the moments of the flight."""


@dataclass(frozen=True)
class Foresight:
    """A plan, its campaign and its flight. time: (K,) s, moments of the flight; day: of the flight."""

    unit: Unit
    estimates: Estimates
    time: Array
    day: float
    _read: dict[tuple[object, ...], list[tuple[Error, int, list[int], Array]]] = field(default_factory=dict)
    _drifted: dict[tuple[Error, int], tuple[Array, Array]] = field(default_factory=dict)
    _misread: dict[int, tuple[Mapping[Error, Moment], Array]] = field(default_factory=dict, init=False)

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
        for error, term, places, weights in self.read(degc):
            if error in asked:
                G[:, places] = np.ascontiguousarray(asked[error][:, :, term]) @ weights
        return G

    def read(self, degc: Array) -> list[tuple[Error, int, list[int], Array]]:
        """Error, term, places of its coefficients, and their weights (..., K, N) at temperatures (..., K)."""
        key = (*degc.shape, degc.tobytes())
        if key not in self._read:
            if len(self._read) >= REMEMBERED:
                self._read.clear()
            self._read[key] = [*self._reads(degc)]
        return self._read[key]

    def _reads(self, degc: Array) -> Iterator[tuple[Error, int, list[int], Array]]:
        for sensor, first, e in self.estimates.estimators:
            for effect, term in dict.fromkeys((c.effect, c.index) for c in e.model.columns):
                mine, weights = e.reads(effect, term, degc)
                yield (sensor, effect), term, [first + i for i in mine], weights

    def _flown(self, asked: Asked, degc: Array) -> dict[Error, Array]:
        """Every budgeted error -> (R, K, t): what is asked of it, through the error that carries it."""
        return {error: self.own(error, asked[error[0], self.by(error)], degc) for error in self.unit.budgets}

    def by(self, error: Error) -> str:
        """The effect as which an error flies."""
        return carrier(*error, list(self.unit.budgets))

    def own(self, error: Error, asked: Array, degc: Array) -> Array:
        """(R, K, t) asked of an error at temperatures (K,), of what is asked of the one that carries it."""
        by = self.by(error)
        if by == error[1]:
            return asked
        seen = Exposed(degc, self.time, self.day)
        return np.asarray(asked * share(*error, by, degc, seen))

    def drifted(self, error: Error, own: Array) -> Array:
        """(R, R) of an error's drift: the same at all starts, where the same is asked there."""
        key = (error, id(own))
        if key not in self._drifted:
            if len(self._drifted) >= KEPT:
                self._drifted.clear()
            # with what is asked, so that nothing else has its id
            self._drifted[key] = own, _through(own, self.drift[error])
        return self._drifted[key][1]

    def walked(self, G: Array, error: Error, own: Array) -> Array:
        """(R, R) of a walk of unit sigma in STORAGE_DAYS, from day 0 through the records to the flight."""
        days = self.estimates.days
        weights = np.concatenate([-_over(G, self.estimates.walk[error]), own.sum(axis=1)[:, :, None]], axis=2)
        later = np.cumsum(weights[:, :, ::-1], axis=2)[:, :, ::-1]  # each step is in all that follows
        width = np.diff(np.concatenate([[0.0], days, [max(self.day, days[-1])]])) / STORAGE_DAYS
        over = (later * np.sqrt(width)).reshape(len(later), -1)
        return np.asarray(over @ over.T)

    def misread(self, moments: Mapping[Error, Moment]) -> Array:
        """(P, P) of what thermometers that err and chambers that stray do to the curves, in the estimates.

        Found once for a family's moments: whatever is asked, and wherever a flight starts, it is the same.
        """
        if id(moments) not in self._misread:
            if len(self._misread) >= FAMILIES:
                self._misread.clear()
            # with the moments, so that nothing else has their id
            found = self._misread_by(moments)
            found.flags.writeable = False
            self._misread[id(moments)] = moments, found
        return self._misread[id(moments)][1]

    def _misread_by(self, moments: Mapping[Error, Moment]) -> Array:
        known = self.estimates
        found = np.zeros(known.noise.shape)
        common: dict[int, list[Array]] = {}  # thermometer -> what it makes of the slopes that all units have
        for error, moment in moments.items():
            found += np.tensordot(squares(moment, known.degc), known.strays[error], axes=1)
            for thermometer, (sigma, one) in enumerate(known.slope[error]):
                found += sigma**2 * _through(np.swapaxes(one, 1, 2), moment.of_slopes(known.degc, sigma))
                if moment.mean is not None:
                    all_units = sigma * one @ moment.mean_slopes(known.degc, sigma)
                    common.setdefault(thermometer, []).append(all_units)
        return found + sum(coherent(np.hstack(several)) for several in common.values())

    def told(self, moments: Mapping[Error, Moment]) -> Array:
        """(P, P) of the curves in the estimates, with what thermometers and chambers do to them."""
        known, found = self.estimates, self.misread(moments).copy()
        for error, moment in moments.items():
            found += moment.through(np.ascontiguousarray(np.moveaxis(known.curve[error], 1, 0)), known.degc)
        return found

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
            if budget.in_run_sigma > 0:
                found["in_run"] += f.drifted(error, own)
            s, length = budget.run_to_run_sigma(degc), budget.temperature_correlation
            if length is None:
                met = np.tensordot(own, s, axes=(1, 0))
                found["run_to_run"] += met @ met.T
            else:
                alike = np.exp(-0.5 * (np.subtract.outer(degc, degc) / length) ** 2)
                found["run_to_run"] += _through(own, np.outer(s, s) * alike)
        return found

    def curves(self, moments: Mapping[Error, Moment]) -> Array:
        """(R, R) of what tables miss of the curves."""
        weights, missed = self.of_curves(), np.zeros(2 * (len(self.reads),))
        at = np.concatenate([self.foresight.estimates.degc, self.degc])
        common = np.zeros((len(self.reads), 0))
        for error, moment in moments.items():
            by_term = np.ascontiguousarray(np.moveaxis(weights[error], 1, 0))
            missed += moment.through(by_term, at)
            if moment.mean is not None:
                common = np.hstack([common, moment.common(by_term, at)])
        return missed + coherent(common)

    def misread(self, moments: Mapping[Error, Moment]) -> Array:
        """(R, R) of what thermometers and chambers do to the curves."""
        return np.asarray(self.reads @ self.foresight.misread(moments) @ self.reads.T)

    def of_curves(self) -> dict[Error, Array]:
        """Error -> (R, t, N + K) what its curve weighs at the records' temperatures, then in flight."""
        curve = self.foresight.estimates.curve
        return {
            error: np.concatenate([-_over(self.reads, curve[error]), np.swapaxes(own, 1, 2)], axis=2)
            for error, own in self.own.items()
        }


def coherent(each: Array) -> Array:
    """(R, R) of what terms (R, n) add that are the same in all units, beyond their own squares."""
    whole = each.sum(axis=1)
    return np.outer(whole, whole) - each @ each.T


def _over(G: Array, estimates: Array) -> Array:
    """(R, P) · (P, t, N) -> (R, t, N)."""
    _, terms, records = estimates.shape
    return np.asarray((G @ estimates.reshape(-1, terms * records)).reshape(-1, terms, records))


def _through(rows: Array, kernel: Array) -> Array:
    """(R, R) Σ over terms of rows K rowsᵀ; rows: (R, K, t)."""
    by_term = np.ascontiguousarray(np.moveaxis(rows, 2, 0))  # strided arrays take ten times as long
    return np.asarray((by_term @ kernel @ np.swapaxes(by_term, 1, 2)).sum(axis=0))
