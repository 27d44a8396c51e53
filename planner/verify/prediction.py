"""What the flights of an experiment are foreseen to find: any requirement, family and start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from planner.nouns.array import Array
from planner.spec.model import PercentileRule, Spec
from planner.verify.asked import Navigation, covariances, figure, navigation, root_mean_square
from planner.verify.drawn_figures import Pool, Quantile, drawn_quantile, pools_of
from planner.verify.estimate_covariance import estimates
from planner.verify.experiment import Experiment
from planner.verify.families import curves_in
from planner.verify.flights import FlightModel
from planner.verify.foreseen import Foresight
from planner.verify.second_moments import Error, Moment, moments_of
from planner.verify.smooth import Tables, prior_of, tables_of
from planner.verify.starts import Starts, anywhere, at_one
from planner.verify.variances import AtStarts
from planner.verify.worst import badness, peaks

STARTS = 81  # among which the worst is looked for: four in a wave of the fastest curves
FINER = 17  # and between the neighbours of that one: tables miss most in a peak between two nodes


@dataclass(frozen=True)
class DrawnCurves:
    """The curves of a spec's families, drawn when they are asked for; and what else its campaigns share."""

    spec: Spec
    _moments: dict[str, Mapping[Error, Moment]] = field(default_factory=dict)
    _pools: dict[str, Mapping[Error, Pool]] = field(default_factory=dict)
    _asked: dict[int, tuple[FlightModel, list[Navigation]]] = field(default_factory=dict)

    @cached_property
    def tables(self) -> Tables:
        """How the spec's calibrations read their tables."""
        return tables_of(self.spec)

    @cached_property
    def prior(self) -> Mapping[Error, Sequence[Moment]]:
        """What a fit knows of the curves: their second moments in every family."""
        return prior_of(self.spec)

    def asked(self, flight: FlightModel, errors: Sequence[Error]) -> list[Navigation]:
        """What the spec's requirements ask of a flight."""
        if id(flight) not in self._asked:  # kept with the flight, so that no other one has its id
            every = [navigation(flight, wanted, errors) for wanted in self.spec.requirement]
            self._asked[id(flight)] = flight, every
        return self._asked[id(flight)][1]

    def moments(self, family: str) -> Mapping[Error, Moment]:
        """Second moments of the curves of a family."""
        if family not in self._moments:
            self._moments[family] = moments_of(curves_in(self.spec, family))
        return self._moments[family]

    def pools(self, family: str) -> Mapping[Error, Pool]:
        """Curves of a family to take from."""
        if family not in self._pools:
            rules = [wanted.rule for wanted in self.spec.requirement]
            share = max((rule.percentile for rule in rules if isinstance(rule, PercentileRule)), default=0.0)
            self._pools[family] = pools_of(curves_in(self.spec, family), share)
        return self._pools[family]


Row = tuple[Error, str]
Parts = tuple[list[Row], dict[str, Array]]


@dataclass(frozen=True)
class Prediction:
    """An experiment that has a flight, foreseen. curves: of its spec

    covariances, shares: what verify has found of it so far, by starts and family
    """

    e: Experiment
    flight: FlightModel
    curves: DrawnCurves
    _flights: dict[tuple[object, ...], AtStarts] = field(default_factory=dict)
    _figures: dict[tuple[object, ...], float] = field(default_factory=dict)
    _drawn: dict[tuple[object, ...], Quantile] = field(default_factory=dict)
    _worst: dict[tuple[int, str], Starts] = field(default_factory=dict)
    covariances: dict[tuple[object, ...], Parts] = field(default_factory=dict)
    shares: dict[tuple[object, ...], dict[str, float]] = field(default_factory=dict)

    @cached_property
    def foresight(self) -> Foresight:
        """Its campaign."""
        e = self.e
        known = estimates(e.records, e.unit, e.estimators, e.spec, e.chance)
        return Foresight(e.unit, known, self.flight.moments, e.day)

    @cached_property
    def asked(self) -> list[Navigation]:
        """Its requirements."""
        return self.curves.asked(self.flight, self.foresight.errors)

    @cached_property
    def profile(self) -> Array:
        """(K,) degC along the flight."""
        flown = self.flight.trajectory
        return np.interp(self.flight.moments, flown.time_s, flown.temperature_degc)

    def _at(self, index: int, degc: Array) -> AtStarts:
        """A requirement at temperatures (S, K) along the flight."""
        key = (index, *degc.shape, degc.tobytes())
        if key not in self._flights:
            self._flights[key] = AtStarts(self.asked[index], self.foresight, degc)
        return self._flights[key]

    def figures(self, index: int, starts: Starts, families: tuple[str, ...]) -> dict[str, float]:
        """Family -> the quantile or root mean square of a requirement, SI."""
        return {family: self._figure(index, starts, family) for family in families}

    def _figure(self, index: int, starts: Starts, family: str) -> float:
        key = (index, *starts.key, family)
        if key not in self._figures:
            degc, shares = starts.grid(self.profile)
            n, at, moments = self.asked[index], self._at(index, degc), self.curves.moments(family)
            if isinstance(n.wanted.rule, PercentileRule):
                whole = covariances(n, at.seen, {family: moments})[family]
                self._figures[key] = figure(n, whole, shares)
            else:
                self._figures[key] = root_mean_square(n, at.variances(family, moments), shares)
        return self._figures[key]

    def drawn(self, index: int, family: str, starts: Starts) -> float:
        """The figure of a requirement with curves drawn from a family, SI; a root mean square needs none."""
        return self.quantile(index, family, starts).value

    def quantile(self, index: int, family: str, starts: Starts) -> Quantile:
        """The same, with what it may err by its draws."""
        rule = self.e.requirements[index].rule
        if not isinstance(rule, PercentileRule):
            return Quantile(self._figure(index, starts, family), 0.0)
        key = (index, *starts.key, family)
        if key not in self._drawn:
            degc, shares = starts.grid(self.profile)
            wanted, pools, moments = self.asked[index], self.curves.pools(family), self.curves.moments(family)
            flights = self._at(index, degc).seen
            self._drawn[key] = drawn_quantile(wanted, flights, shares, pools, moments, rule.percentile)
        return self._drawn[key]

    def worst(self, index: int, family: str) -> Starts:
        """The start of the range at which a requirement is worst.

        Where two far from each other are nearly as bad, quantiles decide: their tails differ.
        """
        if (index, family) not in self._worst:
            spec = self.e.spec
            every = np.linspace(*spec.plan.temperatures.range, STARTS)
            found = []
            for place in peaks(self._badness(index, family, every)):
                near = np.linspace(every[max(place - 1, 0)], every[min(place + 1, STARTS - 1)], FINER)
                found.append(at_one(spec, float(near[np.argmax(self._badness(index, family, near))])))
            if len(found) > 1:
                found.sort(key=lambda start: -self.drawn(index, family, start))
            self._worst[index, family] = found[0]
        return self._worst[index, family]

    def _badness(self, index: int, family: str, degc: Array) -> Array:
        """Of the starts at temperatures (S,)."""
        at = self._at(index, anywhere(self.e.spec).along(self.profile, degc))
        return badness(at, family, self.curves.moments(family))
