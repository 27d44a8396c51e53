"""One experiment, prepared once and run chunk by chunk: campaigns, calibrations and flights of a plan.

A chunk is CHUNK units, drawn by generators keyed by (seed, chunk): who runs it does not matter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from planner import catalog
from planner.protocols import SENSORS, Sensor
from planner.records import Array, Trajectory
from planner.simulate.campaign import Settings, Unit, prepared
from planner.simulate.design import DEFAULT_LATITUDE, Design, design, steps_of
from planner.simulate.settings import settings_of
from planner.spec.budget import STORAGE_DAYS, ErrorBudget
from planner.spec.model import Given, Requirement, Spec
from planner.units import unit_factor
from planner.verify.calibrations import (
    ChannelEstimator,
    calibrated,
    conditions_of_units,
    estimators,
    readings,
    white_noise,
)
from planner.verify.draws import Exposed, drawn_errors, generator
from planner.verify.flights import (
    FlightModel,
    exact_coefficients,
    flight_model,
    lengths_of,
    part_coefficients,
    vectors_of,
)
from planner.verify.residuals import FOLDED, PARTS, Left, left_over
from planner.verify.tally import Tally

CHUNK = 100
Where = Literal["flight", "range"]


@dataclass(frozen=True)
class Experiment:
    """Everything that a chunk needs, and nothing that a worker would have to look up.

    flight: None when the spec gives the sensitivities: then the linear combination stands for the flight
    given: error -> metres per SI unit; where: temperatures of the flight itself, or anywhere in the range
    half_widths: error -> SI, what the plan claims of the estimate; day: of the flight
    """

    unit: Unit
    design: Design
    estimators: Mapping[Sensor, tuple[ChannelEstimator, ...]]
    flight: FlightModel | None
    given: Mapping[str, float]
    requirements: tuple[Requirement, ...]
    half_widths: Mapping[str, float]
    settings: Settings
    seed: int
    where: Where
    range_degc: tuple[float, float]
    room_degc: float
    day: float

    @property
    def errors(self) -> tuple[tuple[Sensor, str], ...]:
        """(sensor, effect) of every budgeted error, in the order of the tallies."""
        return tuple(self.unit.budgets)


def experiment(
    document: Mapping[str, Any],
    spec: Spec,
    trajectory: Trajectory | None,
    *,
    seed: int,
    where: Where = "flight",
    settings: Settings | None = None,
) -> Experiment:
    """The plan's tree (plan.json) on a spec, prepared.

    Without a day of its own the flight comes two months after the calibration, which is what a budget's
    storage part says. Raises InputError for a plan without records, or with fewer than coefficients.
    """
    settings = settings or settings_of(spec)
    laid = design(steps_of(document), spec, DEFAULT_LATITUDE)
    unit = _with_declared(prepared(spec), spec)
    given = spec.sensitivities.given if isinstance(spec.sensitivities, Given) else {}
    flown = None
    if not given and trajectory is not None:
        flown = flight_model(trajectory, list(unit.budgets), spec.requirement)
    day = trajectory.day if trajectory is not None and trajectory.day > 0 else STORAGE_DAYS
    return Experiment(
        unit=unit,
        design=laid,
        estimators=estimators(laid, spec, settings),
        flight=flown,
        given={name: quantity.si for name, quantity in given.items()},
        requirements=spec.requirement,
        half_widths=_half_widths(document),
        settings=settings,
        seed=seed,
        where=where,
        range_degc=spec.plan.temperatures.range,
        room_degc=spec.plan.temperatures.room,
        day=day,
    )


def _with_declared(unit: Unit, spec: Spec) -> Unit:
    """Declared effects without a budget too: the unit has none of them, but its calibration finds some."""
    known = catalog.effects()
    declared = [
        (sensor, name)
        for name in spec.effects
        for sensor in SENSORS
        if sensor in known[name].sensors and name not in FOLDED
    ]
    empty = {key: ErrorBudget() for key in declared if key not in unit.budgets}
    return replace(unit, budgets={**unit.budgets, **empty})


def _half_widths(document: Mapping[str, Any]) -> dict[str, float]:
    return {
        name: float(a["parts"]["estimate"]) * unit_factor(a["unit"])[0]
        for name, a in document["allowances"].items()
    }


def run_chunk(e: Experiment, number: int, flights: int = CHUNK) -> Tally:
    """Campaign, calibration and flight of one chunk's units."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1):  # sums split over threads would differ in the last bit
        left = units_left(e, number, flights)
        return _tally(e, left, number, flights)


def units_left(e: Experiment, number: int, flights: int = CHUNK) -> list[Left]:
    """What the calibrations of one chunk's units leave in flight."""
    key = (e.seed, number)
    exposed = _exposed(e, flights, key)
    conditions = conditions_of_units(e.design, flights, e.settings, key)
    temperature = conditions.temperature_degc.reshape(flights, -1)
    errors = drawn_errors(e.unit, e.design, temperature, exposed, e.settings, key)
    theta = {}
    for sensor in SENSORS:
        y = readings(sensor, conditions, errors, white_noise(sensor, e.design, flights, e.settings, key))
        theta[sensor] = [
            calibrated(estimator, conditions, y[:, i], flights)
            for i, estimator in enumerate(e.estimators[sensor])
        ]
    return left_over(errors, e.estimators, theta, exposed)


def _exposed(e: Experiment, flights: int, key: tuple[int, int]) -> Exposed:
    if e.flight is None:
        profile, time = np.array([e.room_degc]), np.zeros(1)
    else:
        time = e.flight.moments
        flown = e.flight.trajectory
        profile = np.interp(time, flown.time_s, flown.temperature_degc)
    if e.where == "flight":
        return Exposed(profile, time, e.day)
    low, high = e.range_degc
    start = generator(*key, "flight_temperature").uniform(low, high, size=(flights, 1))
    return Exposed(np.clip(start + profile - profile[0], low, high), time, e.day)


# ---------------------------------------------------------------- what it means for the requirements


def _tally(e: Experiment, left: Sequence[Left], number: int, flights: int) -> Tally:
    exact, linear = _navigated(e, left)
    last = [a[-1] - b[-1] for a, b in zip(exact, linear, strict=True)]
    return Tally(
        number=number,
        flights=flights,
        lengths=np.stack([lengths_of(v) for v in exact]),
        linear=np.stack([lengths_of(v) for v in linear]),
        apart=np.array([float(np.sum(v**2)) for v in last]),
        squares=_squares(e, left),
        sizes=np.array([np.sum(x.parts[:, :, -1] ** 2, axis=(1, 2)) for x in left]),
        largest=np.array([np.abs(x.parts).max(axis=(1, 2, 3)) for x in left]),
        counts=np.array([float(flights * len(x.terms)) for x in left]),
        claimed=np.array([_claimed(e, x) for x in left]),
    )


def _navigated(e: Experiment, left: Sequence[Left]) -> tuple[list[Array], list[Array]]:
    """(k, c, B) of every requirement: nonlinear, and by the linear combination."""
    if e.flight is None:
        every = [_given(e, left, [x.total for x in left])] * len(e.requirements)
        return every, every
    coefficients = exact_coefficients(e.flight, left)
    flown = e.flight.navigate(coefficients)
    exact = [vectors_of(flown, e.flight.instants, r) for r in e.requirements]
    linear = [_linear(e.flight, coefficients, r) for r in e.requirements]
    return exact, linear


def _given(e: Experiment, left: Sequence[Left], values: Sequence[Array]) -> Array:
    """(1, 1, B): published coefficients are for all axes together, so one axis stands for them."""
    total = sum(e.given.get(x.name, 0.0) * value[:, -1, 0] for x, value in zip(left, values, strict=True))
    return np.asarray(total)[None, None, :]


def _linear(flight: FlightModel, coefficients: Array, requirement: Requirement) -> Array:
    return np.asarray(vectors_of(flight.linear, flight.instants, requirement) @ coefficients.T)


def _squares(e: Experiment, left: Sequence[Left]) -> Array:
    """(R, E, 5) sums over the flights of |what a part of an error adds|² at the last instant."""
    found = np.zeros((len(e.requirements), len(left), len(PARTS)))
    for i, x in enumerate(left):
        for p in range(len(PARTS)):
            for r, vectors in enumerate(_of_part(e, x, x.parts[p])):
                found[r, i, p] = float(np.sum(vectors**2))
    return found


def _of_part(e: Experiment, x: Left, value: Array) -> list[Array]:
    """(c, B) of every requirement."""
    if e.flight is None:
        return [_given(e, [x], [value])[0]] * len(e.requirements)
    coefficients = part_coefficients(e.flight, x.sensor, x.effect, x.terms, value)
    return [vectors_of(e.flight.linear, e.flight.instants, r)[-1] @ coefficients.T for r in e.requirements]


def _claimed(e: Experiment, x: Left) -> tuple[float, float]:
    """How many estimates lie within the half-width that the plan claims, at their nodes; and of how many."""
    claim = e.half_widths.get(x.name, 0.0)
    inside = np.abs(x.at_nodes) <= claim * (1 + 1e-9)
    return float(inside.sum()), float(inside.size)
