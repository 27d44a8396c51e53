"""One experiment, prepared once and run chunk by chunk: campaigns, calibrations and flights of a plan.

A chunk is CHUNK units, drawn by generators keyed by (seed, chunk): who runs it does not matter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from planner.protocols import SENSORS, Sensor
from planner.solvers.one_thread import one_thread
from planner.spec.model import Given, Requirement, Spec
from planner.units import unit_factor
from planner.verify.along_flight import day_of
from planner.verify.beside import beside_of
from planner.verify.calibrations import Estimator, calibrated, estimators, readings, white_noise
from planner.verify.chance import Chance, chance_of
from planner.verify.draws import Campaign, DrawnError, Exposed, Unit, drawn_errors, generator, unit_of
from planner.verify.families import usual_family
from planner.verify.flights import (
    FlightModel,
    beside_coefficients,
    exact_coefficients,
    flight_model,
    instants_of,
    lengths_of,
    part_coefficients,
    vectors_of,
)
from planner.verify.records import Records, records_of
from planner.verify.references import Met, directions, met_by_units
from planner.verify.residuals import PARTS, Left, flying, left_over
from planner.verify.smooth import prior_of, tables_of
from planner.verify.starts import Starts, as_flown
from planner.verify.strays import strays_of
from planner.verify.tally import Tally

CHUNK = 100


@dataclass(frozen=True)
class Experiment:
    """Everything that a chunk needs, and nothing that a worker would have to look up.

    flight: None when the spec gives the sensitivities: then the linear combination stands for the flight
    given: error -> metres per SI unit; starts: at which temperatures; family: of the units' curves
    half_widths: error -> SI, what the plan claims of the estimate; day: of the flight
    """

    spec: Spec
    unit: Unit
    records: Records
    estimators: Mapping[Sensor, tuple[Estimator, ...]]
    flight: FlightModel | None
    given: Mapping[str, float]
    half_widths: Mapping[str, float]
    chance: Chance
    seed: int
    starts: Starts
    family: str
    day: float

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """The spec's."""
        return self.spec.requirement

    @property
    def errors(self) -> list[tuple[Sensor, str]]:
        """(sensor, effect) of every error that flies, in the order of the tallies."""
        return flying(list(self.unit.budgets))

    @property
    def beside(self) -> tuple[str, ...]:
        """Names of what flies beside the errors, in the order of the tallies."""
        return () if self.flight is None else self.flight.beside.names


def experiment(
    document: Mapping[str, Any],
    spec: Spec,
    trajectory: Trajectory | None,
    *,
    seed: int,
    starts: Starts | None = None,
    family: str | None = None,
    chance: Chance | None = None,
    declares: Sequence[str] | None = None,
) -> Experiment:
    """The plan's tree (plan.json) on a spec, prepared.

    Without other words it is flown as warm as the flight is, with the curves that stand first. Without a day
    of its own the flight comes `flown_after` the campaign's end. declares: the effects that the calibration
    knows, where the units have others besides; the spec's without other words. Raises InputError for a plan
    without records, or with fewer than coefficients.
    """
    chance, family = chance or chance_of(spec), family or usual_family(spec)
    records, unit = records_of(document, spec), unit_of(spec, family)
    strays = strays_of(records, chance, prior_of(spec))
    given = spec.sensitivities.given if isinstance(spec.sensitivities, Given) else {}
    day, flown = records.end_day + spec.flown_after_days, None
    if trajectory is not None:
        day = day_of(trajectory, spec, records.end_day)
    if not given and trajectory is not None:
        flown = _flight(spec, unit, chance, replace(trajectory, day=day))
    return Experiment(
        spec=spec,
        unit=unit,
        records=records,
        estimators=estimators(
            records,
            unit,
            declares or spec.effects,
            chance,
            directions(records, spec),
            tables_of(spec),
            strays,
        ),
        flight=flown,
        given={name: quantity.si for name, quantity in given.items()},
        half_widths=_half_widths(document),
        chance=chance,
        seed=seed,
        starts=starts or as_flown(spec),
        family=family,
        day=day,
    )


def flown_with(e: Experiment, starts: Starts, family: str) -> Experiment:
    """The same plan and units' seeds, flown from other temperatures, or with other curves."""
    unit = e.unit if family == e.family else unit_of(e.spec, family)
    return replace(e, starts=starts, family=family, unit=unit)


def _flight(spec: Spec, unit: Unit, chance: Chance, trajectory: Trajectory) -> FlightModel:
    instants = instants_of(trajectory, spec.requirement)
    drifting = [b.in_run_time for b in unit.budgets.values() if b.in_run_sigma > 0]
    beside = beside_of(spec, chance, trajectory, instants)
    errors = flying(list(unit.budgets))
    within = spec.plan.temperatures.range
    return flight_model(trajectory, errors, instants, beside, min(drifting, default=np.inf), within)


def _half_widths(document: Mapping[str, Any]) -> dict[str, float]:
    return {
        name: float(a["parts"]["estimate"]) * unit_factor(a["unit"])[0]
        for name, a in document["allowances"].items()
    }


@dataclass(frozen=True)
class Measured:
    """The campaigns of some units: what they met, what they are, and what they read, (B n, 3) a sensor."""

    met: Met
    errors: list[DrawnError]
    readings: Mapping[Sensor, Array]
    flight: Exposed


@one_thread()
def run_chunk(e: Experiment, number: int, flights: int = CHUNK) -> Tally:
    """Campaign, calibration and flight of one chunk's units."""
    return _tally(e, units_left(e, number, flights), number, flights)


def units_measured(e: Experiment, number: int, flights: int = CHUNK) -> Measured:
    """One chunk's units, drawn and measured."""
    key = (e.seed, number)
    exposed = _exposed(e, flights, key)
    met = met_by_units(e.records, flights, e.spec, e.chance, key)
    made = Campaign(e.records, met.true.temperature_degc.reshape(flights, -1), exposed)
    errors = drawn_errors(e.unit, made, e.chance, key)
    read = {
        sensor: readings(sensor, met.true, errors, white_noise(sensor, e.records, flights, e.chance, key))
        for sensor in SENSORS
    }
    return Measured(met, errors, read, exposed)


def units_left(e: Experiment, number: int, flights: int = CHUNK) -> list[Left]:
    """What the calibrations of one chunk's units leave in flight."""
    return left_by(e, units_measured(e, number, flights), flights)


def left_by(e: Experiment, made: Measured, flights: int) -> list[Left]:
    """What the calibrations of units that were measured leave in flight."""
    theta = {
        sensor: [calibrated(x, made.met.shown, made.readings[sensor], flights) for x in e.estimators[sensor]]
        for sensor in SENSORS
    }
    return left_over(made.errors, e.estimators, theta, made.flight)


def _exposed(e: Experiment, flights: int, key: tuple[int, int]) -> Exposed:
    if e.flight is None:
        profile, time = np.array([e.spec.plan.temperatures.room]), np.zeros(1)
    else:
        time = e.flight.moments
        flown = e.flight.trajectory
        profile = np.interp(time, flown.time_s, flown.temperature_degc)
    rng = generator(*key, "flight_temperature")
    return Exposed(e.starts.drawn(profile, flights, rng), time, e.day)


# ---------------------------------------------------------------- what it means for the requirements


def _tally(e: Experiment, left: Sequence[Left], number: int, flights: int) -> Tally:
    beside = {}
    if e.flight is not None:
        beside = e.flight.beside.drawn(e.flight.trajectory, flights, (e.seed, number))
    exact, linear = _navigated(e, left, beside)
    last = [a[-1] - b[-1] for a, b in zip(exact, linear, strict=True)]
    return Tally(
        number=number,
        flights=flights,
        lengths=np.stack([lengths_of(v) for v in exact]),
        linear=np.stack([lengths_of(v) for v in linear]),
        apart=np.array([float(np.sum(v**2)) for v in last]),
        at_instants=_at_instants(exact),
        squares=_squares(e, left),
        beside=_squares_beside(e, beside, flights),
        sizes=np.array([np.sum(x.parts[:, :, -1] ** 2, axis=(1, 2)) for x in left]),
        largest=np.array([np.abs(x.parts).max(axis=(1, 2, 3)) for x in left]),
        counts=np.array([float(flights * len(x.terms)) for x in left]),
        claimed=np.array([_claimed(e, x) for x in left]),
    )


def _at_instants(exact: Sequence[Array]) -> Array:
    """(R, 2, M) sums over the flights of |d|² and |d|⁴; exact: (k, c, B) of every requirement."""
    found = np.zeros((len(exact), 2, max(len(v) for v in exact)))
    with np.errstate(all="ignore"):  # a flight may have led beyond all numbers
        for r, v in enumerate(exact):
            square = np.sum(v**2, axis=1)
            found[r, :, : len(v)] = square.sum(axis=1), (square**2).sum(axis=1)
    return np.where(np.isfinite(found), found, np.inf)


def _navigated(
    e: Experiment, left: Sequence[Left], beside: Mapping[str, Array]
) -> tuple[list[Array], list[Array]]:
    """(k, c, B) of every requirement: nonlinear, and by the linear combination."""
    if e.flight is None:
        every = [_given(e, left, [x.total for x in left])] * len(e.requirements)
        return every, every
    coefficients = exact_coefficients(e.flight, left, beside)
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


def _linear_at_last(flight: FlightModel, coefficients: Array, requirement: Requirement) -> Array:
    """(c, B) at the last instant: of one that holds at any moment the others are a hundred times the work."""
    return np.asarray(vectors_of(flight.linear, flight.instants, requirement)[-1] @ coefficients.T)


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
    coefficients = part_coefficients(e.flight, x.sensor, x.effect, value, x.temperature_degc)
    return [_linear_at_last(e.flight, coefficients, r) for r in e.requirements]


def _squares_beside(e: Experiment, beside: Mapping[str, Array], flights: int) -> Array:
    """(R, W) the same of what flies beside the errors."""
    found = np.zeros((len(e.requirements), len(e.beside)))
    for i, name in enumerate(e.beside):
        if e.flight is not None:
            coefficients = beside_coefficients(e.flight, {name: beside[name]}, flights)
            for r, wanted in enumerate(e.requirements):
                found[r, i] = float(np.sum(_linear_at_last(e.flight, coefficients, wanted) ** 2))
    return found


def _claimed(e: Experiment, x: Left) -> tuple[float, float]:
    """How many estimates lie within the half-width that the plan claims, at their nodes; and of how many."""
    claim = e.half_widths.get(x.name, 0.0)
    inside = np.abs(x.at_nodes) <= claim * (1 + 1e-9)
    return float(inside.sum()), float(inside.size)
