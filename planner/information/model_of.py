"""A spec and its flight → the model of its promise, over what is on offer or a campaign."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from planner import catalog
from planner.campaign.noise import budget_of
from planner.campaign.out_of_range import out_of_range
from planner.errors import InputError
from planner.information.curves import Curves
from planner.information.in_flight import SCENARIOS, Asked, asked
from planner.information.kinds import Kinds, kinds_of
from planner.information.misread import misread_of
from planner.information.offers import Offers, offered, offers_of
from planner.information.promise import Promise
from planner.information.smooth import smooth_of
from planner.nouns.array import Array
from planner.nouns.choices import TestVisits
from planner.nouns.deadline import Deadline
from planner.nouns.sensor import ErrorName
from planner.nouns.trajectory import Trajectory
from planner.plan.campaign_by_total import used_benches
from planner.plan.flight_response import FlightResponse, flight_response
from planner.plan.spec_to_trajectory import on_its_day
from planner.protocols import SENSORS
from planner.spec.flight_temperature import TemperatureShares
from planner.spec.model import Requirement, Spec

QUICK_SCENARIOS = 16  # flight temperatures that the search looks at
IN_A_PEAK = 4  # times as many where the worst is looked for: fast curves rise and fall within 2 % of a range
HASTE_S, HASTY_INSTANTS = 20.0, 12  # for a plan that must be there sooner, of a requirement at any moment
QUICK_INSTANTS = 4  # of a requirement at any moment


@dataclass(frozen=True)
class Flight:
    """A spec with its flight's linear combination and its families of curves.

    day: of the flight since the first calibration, 0: not said; deadline: of the plan
    on: day -> the linear combination of that day's flight; None where nothing that flies goes by the days
    foreseen: exact figures (families, requirements) of the campaigns that were asked so far
    exactly: days in store -> requirements as exact figures see them
    """

    spec: Spec
    response: FlightResponse
    curves: Curves
    day: float = 0.0
    deadline: Deadline = field(default_factory=Deadline)
    on: Callable[[float], FlightResponse] | None = None
    foreseen: dict[tuple[TestVisits, ...], Array] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )
    exactly: dict[float, tuple[Asked, ...]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    later: dict[float, Flight] = field(default_factory=dict, init=False, repr=False, compare=False)

    def under(self, spec: Spec) -> Flight:
        """The same flight with another spec of the same errors; shapes of curves stay drawn."""
        return replace(self, spec=spec, curves=self.curves.under(spec))

    @property
    def limits(self) -> Array:
        """(requirements,) SI."""
        return np.array([wanted.limit.si for wanted in self.spec.requirement])

    @cached_property
    def unseen(self) -> Flight:
        """The same flight under other curves, and more of them, than a campaign is searched by."""
        on_offer = np.unique([t for _, degc in offered(self.spec) for t in degc])
        return replace(self, curves=Curves(self.spec, self.curves.drawn, unseen=True, on_offer=on_offer))

    def in_store(self, span_days: float) -> float:
        """Days from the end of a campaign of `span_days` to the flight."""
        return max(self.day - span_days, 0.0) if self.day > 0 else self.spec.flown_after_days

    def after(self, span_days: float) -> Flight:
        """The same flight after a campaign of `span_days`, with what goes by the days as it is then."""
        if self.on is None or self.day > 0 or span_days == 0.0:
            return self
        if span_days not in self.later:
            response = self.on(span_days + self.in_store(span_days))
            self.later[span_days] = replace(self, response=response)
        return self.later[span_days]


def flight_of(spec: Spec, trajectory: Trajectory, deadline: Deadline | None = None) -> Flight:
    """The flight of a spec for the errors that it budgets, and for those that are fitted all the same.

    A declared effect is fitted on every sensor that it acts on. Where no budget speaks of it the unit has
    nothing of it, but what the fit makes of noise is corrected with in flight.
    """
    errors = [ErrorName.of(sensor, effect) for sensor in SENSORS for effect in getattr(spec.unit, sensor)]
    errors += [error for error in _fitted(spec) if error not in errors]
    within = _starts(spec, trajectory)
    budgets = [budget_of(spec.unit, error) for error in errors]
    in_run_s = min((b.in_run_time for b in budgets if b is not None and b.in_run_sigma > 0.0), default=np.inf)
    aligned = spec.initial_alignment
    first = on_its_day(trajectory, spec)

    def on(day: float) -> FlightResponse:
        flown = replace(first, day=day)
        return flight_response(flown, errors, spec.requirement, aligned, within, in_run_s)

    by_days = any("day" in catalog.effects()[error.effect].needs for error in errors)
    return Flight(
        spec,
        on(first.day),
        Curves(spec),
        trajectory.day,
        deadline or Deadline(),
        on if by_days else None,
    )


def _starts(spec: Spec, trajectory: Trajectory) -> tuple[float, float]:
    """The lowest and the highest temperature of any flight: of the range, or the trajectory's own."""
    every = np.concatenate([spec.plan.temperatures.range, trajectory.temperature_degc])
    return float(every.min()), float(every.max())


def _fitted(spec: Spec) -> Iterator[ErrorName]:
    """The declared effects of each sensor that has budgets, by what carries them; none of the bench."""
    known = catalog.effects()
    for sensor in SENSORS:
        mine = [known[e] for e in spec.effects if sensor in known[e].sensors and not known[e].bench_only]
        if getattr(spec.unit, sensor):
            names = (e.temperature_of if e.tabled and e.temperature_of else e.name for e in mine)
            yield from (ErrorName.of(sensor, name) for name in dict.fromkeys(names))


def scenarios(
    spec: Spec, wanted: Requirement, response: FlightResponse, count: int
) -> tuple[Array, Array | None]:
    """(S,) temperatures at which flights start, and their weights; None: the worst counts.

    Over the range they are those of Gauss and Legendre: beyond the outermost nodes of a table the misfit
    rises as steeply as it may, where even parts would hardly look. The worst is looked for end to end, and
    where curves were measured: between these lines are straight, and tables miss most at a corner.
    """
    low, high = spec.plan.temperatures.range
    if isinstance(wanted.temperature, TemperatureShares):
        return wanted.temperature.temperatures_degc, wanted.temperature.shares
    if wanted.temperature == "flight":
        return response.temperature_degc[:1], np.ones(1)
    if wanted.temperature == "worst":
        corners = [t for t in _measured_at(spec) if low < t < high]
        return np.union1d(np.linspace(low, high, IN_A_PEAK * count + 1), corners), None
    at, share = np.polynomial.legendre.leggauss(count)
    return 0.5 * (low + high) + 0.5 * (high - low) * at, 0.5 * share


def _measured_at(spec: Spec) -> Iterator[float]:
    """degC at which curves were measured, of every error."""
    for budget in (b for sensor in SENSORS for b in getattr(spec.unit, sensor).values()):
        one = budget.measured_curve
        for measured in [*(budget.measured_curves or ()), *([] if one is None else [one])]:
            yield from measured.temperatures_degc.tolist()


def asked_of(flight: Flight, *, exact: bool, days: float | None = None) -> tuple[Asked, ...]:
    """Every requirement of the spec in flight; exact: at all its instants and more temperatures.

    days: from the campaign's end to the flight; left out: of one that takes no time
    """
    stored = flight.in_store(0.0) if days is None else days
    if not exact:
        return _asked_of(flight, stored, exact=False)
    if stored not in flight.exactly:
        flight.exactly[stored] = _asked_of(flight, stored, exact=True)
    return flight.exactly[stored]


def _asked_of(flight: Flight, stored: float, *, exact: bool) -> tuple[Asked, ...]:
    spec, found = flight.spec, []
    for index, wanted in enumerate(spec.requirement):
        start, weights = scenarios(spec, wanted, flight.response, SCENARIOS if exact else QUICK_SCENARIOS)
        instants = _looked_at(flight, wanted) if exact else QUICK_INSTANTS
        found.append(asked(index, spec, flight.response, start, weights, instants, stored))
    return tuple(found)


def _looked_at(flight: Flight, wanted: Requirement) -> int:
    """Instants of an exact figure: all, but for who has little time."""
    every = len(flight.response.time_s)
    if wanted.at != "any" or flight.deadline.seconds >= HASTE_S or every <= HASTY_INSTANTS:
        return every
    flight.deadline.note(f"moments that are looked at ({HASTY_INSTANTS} instead of {every})")
    return HASTY_INSTANTS


def on_offer(flight: Flight, also: Sequence[float] = ()) -> tuple[Offers, Promise]:
    """What a campaign may be made of, and what any of them promises (quickly).

    Raises InputError where no test has a bench of a kind whose motions are known: its records tell nothing.
    """
    kinds = kinds_of(flight.spec, offered(flight.spec, also), flight.curves)
    if not kinds.kinds:
        benches = " and ".join(f"benches.{name}" for name in used_benches(flight.spec))
        raise InputError(
            f"what the records of a test tell is known of the kind of its bench, and {benches} has none; "
            f"add 'kind:', one of {', '.join(catalog.benches())}"
        )
    wanted = asked_of(flight, exact=False)
    return offers_of(flight.spec, kinds.kinds), promise_of(flight, kinds, wanted)


def promise_of(flight: Flight, kinds: Kinds, wanted: tuple[Asked, ...]) -> Promise:
    """The model of a promise over kinds of power-on."""
    ends = np.array(flight.spec.plan.temperatures.range)
    degc = [kinds.degc, ends, *(a.temperature_degc.ravel() for a in wanted)]
    points: Array = np.unique(np.round(np.concatenate(degc), 6)).astype(np.float64)
    families = flight.curves.moments(points)
    smooth = smooth_of(flight.spec, points, flight.curves.of_prior.moments)
    flying = flight.response.flying
    budgets = {f.error: budget_of(flight.spec.unit, f.error) for f in flying}
    unbudgeted = frozenset(error for error, budget in budgets.items() if budget is None)
    constants = {
        error.parts: budget.systematic_size**2 / 3.0
        for error, budget in budgets.items()
        if budget is not None and budget.systematic_size > 0.0 and error.effect not in flight.spec.effects
    }
    unread = {error: out_of_range(flight.spec, error) for error in budgets}
    misread = misread_of(flight.spec, kinds, flight.curves)
    means = flight.curves.means(points)
    return Promise(
        kinds, wanted, flying, points, families, smooth, unbudgeted, constants, unread, misread, means
    )


def bare_promise(flight: Flight) -> Promise:
    """What units promise that nobody has calibrated."""
    return promise_of(flight, Kinds((), ()), asked_of(flight, exact=False))
