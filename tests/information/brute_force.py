"""Units drawn one by one, measured, fitted and flown: what a promise is held to, by other code.

Every power-on draws anew, drift goes from record to record, the walk from day to day, curves come from the
simulator's families, the fit is dense weighted least squares, the flight the linear response with the
temperature along it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planner import catalog
from planner.campaign.design import Design, design
from planner.nouns.array import Array
from planner.nouns.step import Step
from planner.plan.flight_response import FlightResponse
from planner.protocols import SENSORS, Sensor
from planner.simulate.families import curve_families
from planner.spec.budget import STORAGE_DAYS, ErrorBudget
from planner.spec.flight_temperature import TemperatureShares
from planner.spec.model import PercentileRule, Requirement, Spec
from tests import oracle

POOL = 4000  # curves of a family; units take them in random order and sign
WORST = 13  # starts, 5 K apart, among which the worst is looked for


@dataclass(frozen=True)
class Fleet:
    """So many units of a spec, with one campaign and one flight each."""

    spec: Spec
    response: FlightResponse
    steps: Sequence[Step]
    family: str
    units: int
    rng: np.random.Generator

    def figure(self, wanted: Requirement) -> float:
        """Quantile or root mean square of the largest |d| over the instants that are asked for."""
        components, instants = self.response.of(wanted)
        J = self.response.errors[instants][:, components]
        low, high = self.spec.plan.temperatures.range
        flown = self.response.temperature_degc
        if wanted.temperature == "flight":
            each = [np.broadcast_to(flown, (self.units, len(flown)))]
        else:
            each = [
                np.clip(s[:, None] + flown - flown[0], low, high) for s in self._starts(wanted, low, high)
            ]
        noise = self._white(components, instants)
        errors = self._left(each)
        return max(_figure(wanted, np.einsum("xcfk,bfk->bxc", J, e, optimize=True) + noise) for e in errors)

    def _starts(self, wanted: Requirement, low: float, high: float) -> list[Array]:
        B = self.units
        if isinstance(wanted.temperature, TemperatureShares):
            t = wanted.temperature
            return [self.rng.choice(t.temperatures_degc, size=B, p=t.shares)]
        if wanted.temperature == "worst":
            return [np.full(B, t) for t in np.linspace(low, high, WORST)]
        return [self.rng.uniform(low, high, B)]

    def _white(self, components: slice, instants: list[int]) -> Array:
        W = self.response.white[instants][:, components]
        n = self.rng.normal(size=(self.units, *W.shape[2:]))
        n *= np.array([self.spec.unit.white(s) for s in SENSORS])[:, None]
        return np.asarray(np.einsum("xcsb,usb->uxc", W, n, optimize=True))

    def _left(self, each: list[Array]) -> list[Array]:
        """Per temperatures (B, K) along flights: (B, F, K) what calibration leaves of every term."""
        made = design(self.steps, self.spec)
        found = [np.zeros((self.units, len(self.response.flying), len(self.response.moments))) for _ in each]
        for sensor in SENSORS:
            for channel in range(3):
                for place, errors in self._channel(made, sensor, channel, each):
                    for total, e in zip(found, errors, strict=True):
                        total[:, place] = e
        return found

    # ------------------------------------------------------------ one channel

    def _channel(
        self, made: Design, sensor: Sensor, channel: int, each: list[Array]
    ) -> list[tuple[int, list[Array]]]:
        terms = [
            (i, f)
            for i, f in enumerate(self.response.flying)
            if f.error.sensor == sensor and f.channel == channel
        ]
        declared = [e for e in self.spec.effects if not catalog.effects()[e].tabled]
        tabled = {
            catalog.effects()[e].temperature_of for e in self.spec.effects if catalog.effects()[e].tabled
        }
        truth = {i: self._drawn(f.error.effect, sensor, made, each) for i, f in terms}
        xs = {i: _regressor(f.error.effect, f.term, sensor, channel, made) for i, f in terms}
        y = sum(xs[i] * truth[i][0] for i, f in terms if f.error.effect in declared)
        white = self.spec.unit.white(sensor) / np.sqrt(made.duration)
        y = y + white * self.rng.normal(size=(self.units, len(made)))
        t = made.conditions.temperature_degc
        columns: list[Array] = []
        reads: dict[int, tuple[slice, Array | None]] = {}
        strong = np.abs(_input(sensor, channel, made))
        for i, f in terms:
            if f.error.effect not in declared:
                continue
            own = None
            if f.error.effect in tabled:
                told = (
                    strong >= 0.05 * strong.max()
                    if f.error.effect == "scale_factor"
                    else np.ones(len(t), bool)
                )
                own = np.unique(t[told])
            new = [xs[i]] if own is None else list(xs[i][:, None].T * _hats(t, own).T)
            reads[i] = slice(len(columns), len(columns) + len(new)), own
            columns += new
        A = np.array(columns).T
        V = self._covariance(
            made, sensor, channel, white, [f.error.effect for i, f in terms if i in reads], xs, terms
        )
        estimate = y @ np.linalg.solve(V, A) @ np.linalg.inv(A.T @ np.linalg.solve(V, A))
        found = []
        for i, _ in terms:
            errors = list(truth[i][1])
            if i in reads:
                place, own = reads[i]
                for s, along in enumerate(each):
                    h = np.ones((1, 1, 1)) if own is None else _hats(along, own)
                    errors[s] = errors[s] - np.einsum(
                        "bkn,bn->bk", np.broadcast_to(h, (*along.shape, h.shape[-1])), estimate[:, place]
                    )
            found.append((i, errors))
        return found

    def _covariance(
        self,
        made: Design,
        sensor: Sensor,
        channel: int,
        white: Array,
        effects: list[str],
        xs: dict[int, Array],
        terms: list,
    ) -> Array:  # type: ignore[type-arg]  # arrays of any kind
        budgets = getattr(self.spec.unit, sensor)
        sizes = {e: oracle.size_of(budgets[e]) for e in dict.fromkeys(effects)}
        V = oracle.covariance(sensor, made.conditions, made.run, sizes, white)[channel::3, channel::3]
        day = made.conditions.day
        for i, f in terms:
            if f.error.effect in sizes:
                walk = budgets[f.error.effect].storage_sigma ** 2 * np.minimum.outer(day, day) / STORAGE_DAYS
                V = V + np.outer(xs[i], xs[i]) * walk
        return np.asarray(V)

    def _drawn(
        self, effect: str, sensor: Sensor, made: Design, each: list[Array]
    ) -> tuple[Array, list[Array]]:
        """(B, n) at the records and, for each of the temperatures, (B, K) in flight: one term of an error."""
        budget: ErrorBudget = getattr(self.spec.unit, sensor)[effect]
        B, rng, n = self.units, self.rng, len(made)
        t, on, day = made.conditions.temperature_degc, made.conditions.time_on, made.conditions.day
        records, K = np.zeros((B, n)), len(self.response.moments)
        flown = [np.zeros((B, K)) for _ in each]
        for rows in made.runs:
            records[:, rows] += rng.normal(size=(B, 1)) * budget.run_to_run_sigma(t[rows])
            records[:, rows] += self._drift(budget, on[rows])
        r, g = rng.normal(size=(B, 1)), self._drift(budget, self.response.moments)
        walk, before = np.zeros(B), 0.0
        for i in np.argsort(day, kind="stable"):
            walk = walk + budget.storage_sigma * np.sqrt((day[i] - before) / STORAGE_DAYS) * rng.normal(
                size=B
            )
            records[:, i] += walk
            before = day[i]
        walk = walk + budget.storage_sigma * np.sqrt(self.spec.flown_after_days / STORAGE_DAYS) * rng.normal(
            size=B
        )
        family = curve_families(self.spec, self.family).get((sensor, effect))  # type: ignore[arg-type]  # a name is drawn as text
        curve = np.zeros((B, 1))
        if family is not None:
            pool = family.draws(POOL, rng)
            curve = pool[rng.integers(POOL, size=B)] * rng.choice([-1.0, 1.0], (B, 1))
            place = (t + self._warmer(made) - family.grid[0]) / np.diff(family.grid[:2])
            records += _between(curve, np.broadcast_to(place, (B, n)))
        if effect not in self.spec.effects:
            walk = walk + rng.uniform(-1.0, 1.0, B) * budget.systematic_size
        for total, along in zip(flown, each, strict=True):
            total += r * budget.run_to_run_sigma(along) + g + walk[:, None]
            if family is not None:
                total += _between(curve, np.interp(along, family.grid, np.arange(len(family.grid))))
        return records, flown

    def _warmer(self, made: Design) -> Array:
        """(B, n) K that units are warmer than their bench's thermometer says: one draw a unit and bench."""
        return np.asarray(
            sum(off[:, None] * (made.bench == bench) for bench, off in self._thermometers.items())
        )

    @cached_property
    def _thermometers(self) -> dict[str, Array]:
        sigma = {name: b.accuracy.temperature if b.accuracy else 0.0 for name, b in self.spec.benches.items()}
        return {name: s * self.rng.normal(size=self.units) if s else np.zeros(1) for name, s in sigma.items()}

    def _drift(self, budget: ErrorBudget, at: Array) -> Array:
        """(B, m) first-order Gauss-Markov from moment to moment."""
        found = np.empty((self.units, len(at)))
        value = budget.in_run_sigma * self.rng.normal(size=self.units)
        for k in range(len(at)):
            if k:
                keep = np.exp(-(at[k] - at[k - 1]) / budget.in_run_time)
                fresh = budget.in_run_sigma * np.sqrt(1.0 - keep**2)
                value = keep * value + fresh * self.rng.normal(size=self.units)
            found[:, k] = value
        return found


def _figure(wanted: Requirement, d: Array) -> float:
    length = np.sqrt(np.sum(d**2, axis=2))
    if isinstance(wanted.rule, PercentileRule):
        return float(np.quantile(length.max(axis=1), wanted.rule.percentile))
    return float(np.sqrt(np.mean(length**2, axis=0).max()))


def _regressor(effect: str, term: str, sensor: Sensor, channel: int, made: Design) -> Array:
    known = catalog.effects()[effect]
    place = [t.name for t in known.terms(sensor)].index(term)
    return np.asarray(known.regressors(sensor, made.conditions)[:, channel, place])


def _input(sensor: Sensor, channel: int, made: Design) -> Array:
    c = made.conditions
    return np.asarray((c.rate if sensor == "gyro" else c.specific_force)[:, channel])


def _hats(t: Array, nodes: Array) -> Array:
    """(..., N) straight lines between nodes, the end segments for 5 K more, constant beyond."""
    if len(nodes) == 1:
        return np.ones((*np.shape(t), 1))
    t = np.clip(t, nodes[0] - 5.0, nodes[-1] + 5.0)
    k = np.clip(np.searchsorted(nodes, t) - 1, 0, len(nodes) - 2)
    share = (t - nodes[k]) / (nodes[k + 1] - nodes[k])
    eye = np.eye(len(nodes))
    return np.asarray(eye[k] * (1.0 - share[..., None]) + eye[k + 1] * share[..., None])


def _between(curve: Array, place: Array) -> Array:
    """(B, m) of curves (B, G) at places (B, m) of their grid."""
    k = np.clip(place.astype(int), 0, curve.shape[1] - 2)
    share = place - k
    return np.asarray(
        np.take_along_axis(curve, k, 1) * (1.0 - share) + np.take_along_axis(curve, k + 1, 1) * share
    )
