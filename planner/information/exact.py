"""The promise of one campaign that was chosen, with its days: what plan.json says of it.

The walk of errors over the days of the campaign couples its power-ons; what the campaign saw of it counts.
A requirement at any moment is judged by draws of the whole flight.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from planner.campaign.alike_power_ons import alike_together
from planner.campaign.design import design
from planner.campaign.model import Campaign
from planner.campaign.power_ons import of_design
from planner.information.curve_weights import CurveWeights
from planner.information.curves import about_means
from planner.information.drawn import DRAWS as FLIGHTS
from planner.information.drawn import Drawn, drawn, nearly
from planner.information.in_flight import Asked
from planner.information.kinds import Kind, Kinds, campaign_of, channel_kinds
from planner.information.model_of import Flight, asked_of, promise_of
from planner.information.promise import Promise
from planner.nouns.array import Array
from planner.nouns.choices import Campaign as Choice
from planner.nouns.choices import TestVisits
from planner.nouns.step import Step
from planner.plan.flight_response import FlightResponse
from planner.plan.schedule_to_steps import steps
from planner.protocols import Sensor
from planner.solvers.gaussian_length import exceedance

SETTLED = 1e-7
CLOSE = 0.004  # to a limit, twice what a quantile by usual draws scatters by
BY_FAR = 1.0 + CLOSE
CLOSELY = 4 * FLIGHTS  # flights that tell on which side of it a campaign is


Pool = Callable[[tuple[Sensor, str]], NDArray[np.float32]]  # error -> (N, n) curves


@dataclass(frozen=True)
class Foreseen:
    """What a campaign promises. families: name -> (requirements,) quantile or rms, SI; infinite: undetermined

    promise, counts: the model and the campaign (1, g) in it; days: from its end to the flight
    response: the linear combination of the flight on its day
    """

    families: Mapping[str, tuple[float, ...]]
    promise: Promise
    counts: Array
    days: float
    response: FlightResponse

    @property
    def figures(self) -> Array:
        """(families, requirements)."""
        return np.array([*self.families.values()])

    @property
    def largest(self) -> tuple[float, ...]:
        """(requirements,) over the families."""
        return tuple(float(x) for x in np.max([*self.families.values()], axis=0))

    def binding(self, requirement: int) -> str:
        """The family under which a requirement is used most."""
        return max(self.families, key=lambda f: self.families[f][requirement])


def foreseen(flight: Flight, steps: Sequence[Step], draws: int = FLIGHTS) -> Foreseen:
    """The promise of the campaign that these steps make of one unit; draws: flights for a quantile."""
    return foreseen_of(flight, _made(flight, steps), draws)


def unseen(flight: Flight, visits: Sequence[TestVisits]) -> Foreseen:
    """The exact promise of a campaign, by curves that no search has seen: what plan.json says of it."""
    exact = foreseen(flight.unseen, laid_out(flight, visits, first_only=True))
    flight.foreseen[tuple(visits)] = exact.figures
    return exact


def unseen_figures(flight: Flight, visits: Sequence[TestVisits]) -> Array:
    """(families, requirements) of `unseen`; of a campaign that was asked before they are remembered."""
    known = flight.foreseen.get(tuple(visits))
    return unseen(flight, visits).figures if known is None else known


def quickly(flight: Flight, promise: Promise, counts: Array) -> Foreseen:
    """The promise of counts (1, g) by the search's figures: nothing walks while the campaign lasts."""
    stored, figures = flight.in_store(0.0), promise.figures(counts)[0]
    each = zip(promise.families, figures, strict=True)
    return Foreseen(
        {name: tuple(map(float, row)) for name, row in each}, promise, counts, stored, flight.response
    )


def foreseen_of(flight: Flight, made: Campaign, draws: int = FLIGHTS) -> Foreseen:
    """The promise of a campaign on the spec's flights; arguments as of `foreseen`."""
    promise, counts, flown, days = _promised(flight, made)
    wanted = promise.asked
    figures = np.empty((len(promise.families), len(wanted)))
    if squares := [k for k, a in enumerate(wanted) if a.share is None]:
        only = replace(promise, asked=tuple(wanted[k] for k in squares))
        figures[:, squares] = only.figures(counts)[0]
    if shared := [k for k, a in enumerate(wanted) if a.share is not None]:
        figures[:, shared] = _quantiles(flown, promise, counts, shared, draws)
    each = zip(promise.families, figures, strict=True)
    return Foreseen(
        {name: tuple(map(float, row)) for name, row in each}, promise, counts, days, flown.response
    )


def broken_by_far(flight: Flight, visits: Sequence[TestVisits], families: Sequence[str]) -> bool:
    """Whether a figure of `unseen` is beyond its limit by more than draws scatter by, under some family.

    families: in the order in which they are asked, until one says so. What it denies may be broken, too.
    """
    judged = flight.unseen
    made = _made(judged, laid_out(flight, visits, first_only=True))
    promise, counts, judged, _ = _promised(judged, made)
    squares = tuple(a for a in promise.asked if a.share is None)
    for name in families:
        only = promise.among([name])
        if squares:
            figures = replace(only, asked=squares).figures(counts)[0, 0]
            if np.any(figures > [BY_FAR * a.limit for a in squares]):
                return True
        pool = _pool(judged, promise, name)
        for f in [f for f in _flown(only, counts) if f.asked.share is not None]:
            within = BY_FAR * f.asked.limit
            if f.undetermined or not f.judged(only, name, pool, FLIGHTS).are_within(within):
                return True
    return False


def _made(flight: Flight, steps: Sequence[Step]) -> Campaign:
    """The campaign that steps make of one unit."""
    runs = alike_together(of_design(design(steps, flight.spec), flight.spec), flight.spec)
    return campaign_of(flight.spec, runs, flight.curves)


def _promised(flight: Flight, made: Campaign) -> tuple[Promise, Array, Flight, float]:
    """The model of a campaign, its counts (1, g) in it, the flight on its day, and how long it is after."""
    span = float(made.runs.on_day.max(initial=0.0))
    days, flight = flight.in_store(span), flight.after(span)
    wanted = asked_of(flight, exact=True, days=days)
    kinds = _kinds(flight, made).together(made.runs.counts)
    promise = promise_of(flight, kinds, wanted)
    return promise, np.ones((1, len(kinds.kinds))), flight, days


def _kinds(flight: Flight, made: Campaign) -> Kinds:
    """Every power-on of the campaign that is unlike the others as a kind of its own."""
    runs = made.runs
    degc = np.round(runs.conditions.temperature_degc[runs.starts], 6)
    bench = [""] * len(degc) if runs.bench is None else runs.bench[runs.starts]
    kinds = tuple(Kind("", float(t), str(b)) for t, b in zip(degc, bench, strict=True))
    slopes = flight.curves.slopes_by_family(runs.conditions.temperature_degc)
    return Kinds(kinds, tuple(channel_kinds(c, slopes) for c in made.channels.values()))


def laid_out(flight: Flight, visits: Sequence[TestVisits], *, first_only: bool = False) -> tuple[Step, ...]:
    """The steps of visits on the benches; first_only: of the first units alone, of which one is foreseen."""
    return steps(flight.spec, Choice(tuple(visits), (), 0.0, 0.0, False), first_only=first_only)


# ---------------------------------------------------------------- quantiles


@dataclass(frozen=True)
class _Flown:
    """What one requirement sees of a campaign. without: (families, S, ρ, ρ), nothing of the curves in it

    means: error -> (N,) what all units' curves have in common, SI
    """

    asked: Asked
    without: Array
    parts: Sequence[CurveWeights]
    means: Mapping[tuple[Sensor, str], Array]
    undetermined: bool

    @property
    def shift(self) -> Array:
        """(S, ρ) of d, the same in all units."""
        own = [p.of_mean(self.means[p.error]) for p in self.parts if p.error in self.means]
        return np.asarray(sum(own, np.zeros(self.without.shape[1:3])))

    def judged(self, promise: Promise, family: str, pool: Pool, draws: int) -> Drawn:
        """The flights under one family."""
        rest = self.without[[*promise.families].index(family)]
        around = about_means(promise.families[family], self.means)
        squares = [(p, p.second_moment(around[p.error])) for p in self.parts if p.error in around]
        found = drawn(self.asked, rest, squares, pool, draws, shift=self.shift)
        return _Gaussian(self.asked, sum((own for _, own in squares), rest)) if found is None else found


def _quantiles(
    flight: Flight, promise: Promise, counts: Array, shared: Sequence[int], draws: int
) -> list[list[float]]:
    """(families, requirements) of some requirements, with the curves drawn; infinite: one is undetermined.

    What comes close to its limit is drawn again with more flights, where draws are no fewer than usual.
    """
    flown, found = _flown(promise, counts), list[list[float]]()
    every, closely = [flown[k] for k in shared], draws == FLIGHTS
    for name in promise.families:
        pool = _pool(flight, promise, name)

        def quantile(f: _Flown, draws: int, name: str = name, pool: Pool = pool) -> float:
            return np.inf if f.undetermined else f.judged(promise, name, pool, draws).quantile()

        usual = [(f, quantile(f, draws)) for f in every]
        found.append([quantile(f, CLOSELY) if closely and _is_close(f, x) else x for f, x in usual])
    return found


def _pool(flight: Flight, promise: Promise, family: str) -> Pool:
    """Of one family, the curves of each error at the promise's points, less their mean, looked up once."""

    @cache
    def pool(error: tuple[Sensor, str]) -> NDArray[np.float32]:
        whole = flight.curves.pool(family, error, promise.points)
        mean = promise.means.get(error)
        return whole if mean is None else whole - mean[:, None].astype(np.float32)

    return pool


def _is_close(f: _Flown, figure: float) -> bool:
    return abs(figure / f.asked.limit - 1.0) < CLOSE


def _flown(promise: Promise, counts: Array) -> list[_Flown]:
    """Of every requirement."""
    left, undetermined = promise.without_curves().covariances(counts)
    unknown = bool(undetermined[0])
    parts = [[]] * len(left) if unknown else promise.through_curves(counts[0])
    each = [np.broadcast_to(S[0], (len(promise.families), *S.shape[2:])) for S in left]
    known = zip(promise.asked, each, parts, strict=True)
    return [_Flown(a, without, own, promise.means, unknown) for a, without, own in known]


@dataclass(frozen=True)
class _Gaussian:
    """Flights at one instant of which all is Gaussian; S: (S, c, c)."""

    asked: Asked
    S: Array

    def quantile(self) -> float:
        """The root of the mean (or largest) exceedance, by bisection."""
        near = nearly(self.asked, self.S)
        low, high = 0.5 * near, 2.0 * near
        while high - low > SETTLED * high:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self.are_within(middle) else (middle, high)
        return high

    def are_within(self, length: float) -> bool:
        assert self.asked.share is not None
        beyond = exceedance(self.S, np.full(len(self.S), length), 1e-8)
        weights = self.asked.weights
        return bool((beyond.max() if weights is None else beyond @ weights) <= 1.0 - self.asked.share)
