"""A design, or a flight, and a spec's budgets → what the unit says at 1000 Hz from power-on (K 3.2).

    y(t) = (1 + κ)(M u(t)) + b + coloured(t) + white(t),   then bursts, spikes, a thermometer that dies

The unit is the one that `simulate` draws by the same seed: systematic errors, curves, power-ons and storage
are those of its records. What happens within a record is drawn for every sample: in-run processes, coloured
noise (first-order Gauss-Markov, K 1.3), white noise of the same density; warm-up and other effects follow
their own equations at every instant.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace

import numpy as np
from numpy.typing import NDArray

from planner.campaign.design import Design
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.trajectory import Trajectory
from planner.protocols import SENSORS, Sensor
from planner.response import Acting, response
from planner.simulate.campaign import (
    Settings,
    Truth,
    Unit,
    drawn_coefficients,
    hidden_coefficients,
    shown_and_true,
)
from planner.simulate.curves.grid import along
from planner.simulate.hidden import HiddenEffect
from planner.simulate.motions import exposed, records_of, warmed
from planner.simulate.processes import coloured, generator
from planner.units import STANDARD_GRAVITY_MPS2, to_si

SLOW_HZ = 10.0  # at which in-run processes are drawn; between, straight lines
BURST_S, BURST_TIMES = 0.1, 20.0  # of the white noise, for up to 100 ms (K 4.3.3, fig 4.12)
SPIKE_SAMPLES = 2  # 1 … 2 ms at 1000 Hz (K 4.3.2, fig 4.10)
FULL_SCALE: Mapping[Sensor, float] = {
    "gyro": np.radians(500.0),
    "accelerometer": 20.0 * STANDARD_GRAVITY_MPS2,
}
DEAD_DEGC = -273.15
_CHUNK = 100_000


@dataclass(frozen=True)
class Disturbed:
    """What disturbs the samples beside white noise, SI. coloured: sigma of each sensor; time: its s

    spikes: share of the samples that begin one; bursts: of them in an hour
    dies: s since power-on from which the thermometer says −273.15 degC; None: it lives
    """

    coloured: Mapping[Sensor, float] = field(default_factory=dict)
    time: float = 1.0
    spikes: float = 0.0
    bursts: float = 0.0
    dies: float | None = None


@dataclass(frozen=True)
class Signals:
    """One power-on. time: (n,) s since then; gyro: (n, 3) rad/s; acc: (n, 3) m/s²; temperature_degc: (n,)

    step: (n,) the record's, empty between records; run: its number; start_s: of the power-on in the plan
    """

    time: Array
    gyro: Array
    acc: Array
    temperature_degc: Array
    step: NDArray[np.str_]
    run: int
    start_s: float


@dataclass(frozen=True)
class Recorded:
    """A unit on a bench, recorded at `rate` Hz. true: what it is exposed to in every record of the design."""

    design: Design
    true: Conditions
    unit: Unit
    settings: Settings
    disturbed: Disturbed
    hidden: Sequence[HiddenEffect]
    seed: int
    rate: float


def campaign_signals(drawn: Recorded) -> Iterator[Signals]:
    """Every power-on of the design, from the moment of power-on to the end of its last record."""
    d = drawn.design
    for rows in d.runs:
        records = records_of(d, rows)
        time = np.arange(int(records.end[-1] * drawn.rate)) / drawn.rate
        number = records.at(time)
        of = rows[number]
        rate, force = exposed(d, records, time)
        degc, ramped = warmed(d, records, time, drawn.true.temperature_degc[rows])
        conditions = Conditions(
            rate=rate + (drawn.true.rate - d.conditions.rate)[of],
            specific_force=force + (drawn.true.specific_force - d.conditions.specific_force)[of],
            temperature_degc=degc,
            temperature_rate=ramped,
            time_on=time,
            day=d.conditions.day[of],
        )
        step = np.where(records.inside(time), d.step[of], "")
        run = int(d.run[rows[0]])
        start = float(d.conditions.day[rows[0]] * 86400.0 - d.conditions.time_on[rows[0]])
        yield _read(drawn, conditions, of, step, run, start)


def flight_signals(drawn: Recorded, flight: Trajectory) -> Signals:
    """The flight as a power-on of its day, after the design's last one, by its ideal readings."""
    spacing = float(flight.time_s[1] - flight.time_s[0])
    middle = flight.time_s[:-1] + spacing / 2.0
    time = np.arange(int(flight.time_s[-1] * drawn.rate)) / drawn.rate

    def at(increments: Array) -> Array:
        return np.stack([np.interp(time, middle, x / spacing) for x in increments.T], axis=1)

    conditions = Conditions(
        rate=at(flight.angle_increment),
        specific_force=at(flight.velocity_increment),
        temperature_degc=np.interp(time, flight.time_s, flight.temperature_degc),
        temperature_rate=np.zeros(len(time)),
        time_on=np.interp(time, flight.time_s, flight.time_on),
        day=np.full(len(time), flight.day),
    )
    design = _with_one_more(drawn.design, conditions)
    with_flight = replace(drawn, design=design, true=_joined(drawn.true, conditions))
    last = len(with_flight.design) - 1
    of = np.full(len(time), last, dtype=np.int64)
    run = int(with_flight.design.run[-1])
    return _read(with_flight, conditions, of, np.full(len(time), ""), run, 0.0)


def _with_one_more(d: Design, flown: Conditions) -> Design:
    """The design with one more record, the flight's, in a run of its own: earlier draws stay the same."""
    return replace(
        d,
        conditions=_joined(d.conditions, flown),
        run=np.append(d.run, d.run[-1] + 1),
        duration=np.append(d.duration, 1.0),
        step=np.append(d.step, "flight"),
        bench=np.append(d.bench, d.bench[-1]),
        installation=np.append(d.installation, d.installation[-1]),
        asked=(*d.asked, d.asked[-1]),
    )


def _joined(records: Conditions, flown: Conditions) -> Conditions:
    """The records' conditions, and the first of a flight."""
    names = [f.name for f in fields(Conditions)]
    return Conditions(*(np.concatenate([getattr(records, x), getattr(flown, x)[:1]]) for x in names))


# ---------------------------------------------------------------- what the unit says


def _read(
    drawn: Recorded, met: Conditions, of: NDArray[np.int64], step: NDArray[np.str_], run: int, start: float
) -> Signals:
    readings = {}
    for sensor in SENSORS:
        acting = list(_acting(drawn, sensor, met, of, run))
        ideal = [
            response(sensor, met.at(part), [replace(a, values=a.values[part]) for a in acting])
            for part in _parts(len(of))
        ]
        readings[sensor] = _noisy(drawn, sensor, np.concatenate(ideal), run)
    error = drawn.settings.temperature_error
    shown = met.temperature_degc + error * generator(drawn.seed, "thermometer", str(run)).normal()
    if drawn.disturbed.dies is not None:
        shown = np.where(met.time_on >= drawn.disturbed.dies, DEAD_DEGC, shown)
    time = np.arange(len(of)) / drawn.rate
    return Signals(time, readings["gyro"], readings["accelerometer"], shown, step, run, start)


def _parts(count: int) -> list[slice]:
    return [slice(k, min(k + _CHUNK, count)) for k in range(0, count, _CHUNK)]


def _acting(
    drawn: Recorded, sensor: Sensor, met: Conditions, of: NDArray[np.int64], run: int
) -> Iterator[Acting]:
    """Every error of the unit with its coefficients at every sample, (n, t)."""
    apart = replace(drawn.settings, in_run=False)
    for d in drawn_coefficients(sensor, drawn.design, drawn.true, drawn.unit, apart, drawn.seed):
        every = d.values[of]
        for i, term in enumerate(d.terms):
            if term.curve is not None and term.temperatures_degc is not None:
                here, there = (
                    along(t, term.temperatures_degc, term.curve)
                    for t in (met.temperature_degc, drawn.true.temperature_degc)
                )
                every[:, i] += here - there[of]
            if drawn.settings.in_run and d.budget is not None and d.budget.in_run_sigma > 0:
                rng = generator(drawn.seed, "in_run", sensor, d.effect.name, term.term, str(run))
                lasting = drawn.settings.correlation_time(d.budget)
                every[:, i] += d.budget.in_run_sigma * _slowly(len(of), lasting, drawn.rate, rng)
        yield Acting(d.effect, every)
    for d in hidden_coefficients(sensor, drawn.hidden, drawn.seed):
        yield Acting(d.effect, np.broadcast_to(d.values, (len(of), len(d.values))), d.parameters)


def _slowly(count: int, lasting: float, rate: float, rng: np.random.Generator) -> Array:
    """(n,) a first-order Gauss-Markov process of unit variance, drawn at SLOW_HZ."""
    slow = min(SLOW_HZ, rate)
    knots = coloured(int(count / rate * slow) + 2, 1.0 / slow, lasting, rng)
    return np.interp(np.arange(count) / rate, np.arange(len(knots)) / slow, knots)


def _noisy(drawn: Recorded, sensor: Sensor, y: Array, run: int) -> Array:
    """With coloured and white noise, bursts and spikes."""
    shape, key = y.shape, (sensor, str(run))
    disturbed, dt = drawn.disturbed, 1.0 / drawn.rate
    white = drawn.settings.white[sensor] / np.sqrt(dt)
    size = np.full(len(y), white)
    for begin in _moments(disturbed.bursts * dt / 3600.0, drawn, "bursts", run, len(y)):
        size[begin : begin + int(BURST_S * drawn.rate)] *= BURST_TIMES
    y = y + size[:, None] * generator(drawn.seed, "white", *key).normal(size=shape)
    if disturbed.coloured.get(sensor, 0.0) > 0:
        rng = generator(drawn.seed, "coloured", *key)
        own = [coloured(len(y), dt, disturbed.time, rng) for _ in range(3)]
        y += disturbed.coloured[sensor] * np.stack(own, axis=1)
    rng = generator(drawn.seed, "spikes", *key)
    for begin in np.flatnonzero(rng.uniform(size=len(y)) < disturbed.spikes).tolist():
        wrong = rng.choice([0.0, -1.0, 1.0]) * FULL_SCALE[sensor]
        y[begin : begin + int(rng.integers(1, SPIKE_SAMPLES + 1)), int(rng.integers(3))] = wrong
    return y


def _moments(chance: float, drawn: Recorded, what: str, run: int, count: int) -> list[int]:
    """Samples at which something begins that shakes the whole unit."""
    if chance <= 0:
        return []
    begins = np.flatnonzero(generator(drawn.seed, what, str(run)).uniform(size=count) < chance)
    return [int(k) for k in begins]


# ---------------------------------------------------------------- what a user sets


def recorded(
    design: Design,
    unit: Unit,
    seed: int,
    settings: Settings,
    disturbed: Disturbed,
    hidden: Sequence[HiddenEffect] = (),
    rate: float = 1000.0,
) -> tuple[Recorded, Truth]:
    """A unit of the spec's budgets on a bench, ready to be recorded at `rate` Hz, and its truth."""
    _, true, references = shown_and_true(design, unit, seed, settings)
    found = Recorded(design, true, unit, settings, disturbed, hidden, seed, rate)
    terms = [
        term
        for sensor in SENSORS
        for d in (
            *drawn_coefficients(sensor, design, true, unit, settings, seed),
            *hidden_coefficients(sensor, hidden, seed),
        )
        for term in d.terms
    ]
    return found, Truth(seed, tuple(terms), references.by_name)


def disturbed_by(written: Mapping[str, object]) -> tuple[Disturbed, dict[str, object]]:
    """What keys of `--set` say of signals alone, and the other keys. Raises UnitError, ValueError."""
    rest = dict(written)
    sigma: dict[Sensor, float] = {}
    for sensor, unit in (("gyro", "deg/s"), ("accelerometer", "g")):
        if f"coloured_{sensor}" in rest:
            sigma[sensor] = to_si(rest.pop(f"coloured_{sensor}"), unit)  # type: ignore[index]  # one of SENSORS
    dies = rest.pop("thermometer_dies", None)
    found = Disturbed(
        sigma,
        to_si(rest.pop("coloured_time", "1 s"), "s"),
        float(str(rest.pop("spikes_of_samples", 0.0))),
        float(str(rest.pop("bursts_per_hour", 0.0))),
        None if dies is None else to_si(dies, "s"),
    )
    if found.time <= 0 or min([*sigma.values(), found.spikes, found.bursts]) < 0 or found.spikes > 0.1:
        raise ValueError("coloured noise, spikes and bursts must not be negative, nor spikes over 0.1")
    return found, rest
