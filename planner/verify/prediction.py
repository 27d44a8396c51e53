"""What the flights of an experiment are foreseen to find: any requirement, family and start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from planner.nouns.array import Array
from planner.spec.model import PercentileRule, Spec
from planner.verify.asked import Navigation, covariances, figure, navigation, worst_start
from planner.verify.drawn_figures import Pool, drawn_quantile, pools_of
from planner.verify.estimate_covariance import estimates
from planner.verify.experiment import Experiment
from planner.verify.families import curves_in
from planner.verify.flights import FlightModel
from planner.verify.foreseen import Foresight, Seen
from planner.verify.second_moments import Error, Moment, moments_of
from planner.verify.starts import Starts, anywhere, at_one

FINE = 25  # starts among which the worst is looked for


@dataclass(frozen=True)
class DrawnCurves:
    """The curves of a spec's families, drawn when they are asked for."""

    spec: Spec
    _moments: dict[str, Mapping[Error, Moment]] = field(default_factory=dict)
    _pools: dict[str, Mapping[Error, Pool]] = field(default_factory=dict)

    def moments(self, family: str) -> Mapping[Error, Moment]:
        """Second moments of the curves of a family."""
        if family not in self._moments:
            self._moments[family] = moments_of(curves_in(self.spec, family))
        return self._moments[family]

    def pools(self, family: str) -> Mapping[Error, Pool]:
        """Curves of a family to take from."""
        if family not in self._pools:
            self._pools[family] = pools_of(curves_in(self.spec, family))
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
    _flights: dict[tuple[object, ...], list[Seen]] = field(default_factory=dict)
    _figures: dict[tuple[object, ...], dict[str, float]] = field(default_factory=dict)
    _drawn: dict[tuple[object, ...], float] = field(default_factory=dict)
    _worst: dict[tuple[int, str], tuple[Starts, float]] = field(default_factory=dict)
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
        return [navigation(self.flight, wanted, self.foresight.errors) for wanted in self.e.requirements]

    @cached_property
    def profile(self) -> Array:
        """(K,) degC along the flight."""
        flown = self.flight.trajectory
        return np.interp(self.flight.moments, flown.time_s, flown.temperature_degc)

    def figures(self, index: int, starts: Starts, families: tuple[str, ...]) -> dict[str, float]:
        """Family -> the quantile or root mean square of a requirement, SI."""
        key = (index, starts.word, *starts.degc.tolist(), *families)
        if key not in self._figures:
            degc, shares = starts.grid(self.profile)
            moments, wanted = {name: self.curves.moments(name) for name in families}, self.asked[index]
            found = covariances(wanted, self.foresight, degc, moments)
            self._figures[key] = {name: figure(wanted, each, shares) for name, each in found.items()}
        return self._figures[key]

    def drawn(self, index: int, family: str, starts: Starts) -> float:
        """The figure of a requirement with curves drawn from a family, SI; a root mean square needs none."""
        rule = self.e.requirements[index].rule
        if not isinstance(rule, PercentileRule):
            return self.figures(index, starts, (family,))[family]
        at = (index, starts.word, *starts.degc.tolist())
        if (*at, family) not in self._drawn:
            degc, shares = starts.grid(self.profile)
            wanted, pools, moments = self.asked[index], self.curves.pools(family), self.curves.moments(family)
            if at not in self._flights:
                self._flights[at] = [self.foresight.seen(wanted.at(one), one) for one in degc]
            quantile = drawn_quantile(wanted, self._flights[at], shares, pools, moments, rule.percentile)
            self._drawn[*at, family] = quantile
        return self._drawn[*at, family]

    def worst(self, index: int, family: str) -> tuple[Starts, float]:
        """The start of the range at which a requirement is worst, and its figure there."""
        if (index, family) not in self._worst:
            self._worst[index, family] = self._looked_for(index, family)
        return self._worst[index, family]

    def _looked_for(self, index: int, family: str) -> tuple[Starts, float]:
        spec = self.e.spec
        grid = np.linspace(*spec.plan.temperatures.range, FINE)
        wanted, moments = self.asked[index], self.curves.moments(family)
        degc, most = worst_start(wanted, self.foresight, moments, anywhere(spec), self.profile, grid)
        return at_one(spec, degc), most
