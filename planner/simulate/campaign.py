"""A design and a spec's budgets → the dwell table that the bench would have measured, and the truth.

    y_i = (1 + κ_i)(M u)_i + b_i + noise

Every coefficient of every effect that the spec budgets is a constant (systematic), a curve over temperature,
a draw per power-on (run_to_run), a first-order Gauss-Markov process within the power-on (in_run) and a random
walk over the days (storage); the same regressors as everywhere turn them into readings (K 2.1, 3.1). u is
what the unit is truly exposed to: the table says the nominal, from which the bench's references are off.
Every random number has a key of its own (seed, what, which): other draws change nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from planner import catalog
from planner.campaign.design import Design
from planner.campaign.noise import SOAKED_STRAY_K
from planner.campaign.power_ons import of_design
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.dwell_table import DwellTable
from planner.protocols import SENSORS, Effect, Sensor
from planner.response import Acting
from planner.simulate.curves.grid import along
from planner.simulate.curves.measured import OneUnit
from planner.simulate.families import curve_families
from planner.simulate.hidden import HiddenEffect, coefficients
from planner.simulate.processes import gauss_markov, generator, power_on_draws, walk
from planner.simulate.references import TrueReferences, drawn_references
from planner.simulate.temperature_curves import CurveFamily
from planner.spec.budget import ErrorBudget
from planner.spec.curve_names import FamilyName
from planner.spec.model import Spec
from planner.spec.noise_density import usual
from planner.spec.references import BenchAccuracy


@dataclass(frozen=True)
class Settings:
    """How to draw, SI.

    white: noise density of each sensor, per root hertz (a record of T seconds has white/√T)
    in_run_time: correlation time of every in-run process, s; None: each its own, from the spec
    temperature_jitter: how far a soaked chamber strays, K; temperature_error: of the unit's thermometer, K
    case: `random` draws sizes within the budget, `worst` takes all of it; signs: `random` or `plus`
    run_to_run, in_run, storage, temperature_residual: whether the budget's part is drawn at all
    spikes: share of readings that are `spike_size` sigma off
    references: whether the bench's references are off by their stated accuracy, or perfect
    """

    white: Mapping[Sensor, float] = field(default_factory=lambda: {s: usual(s) for s in SENSORS})
    in_run_time: float | None = None
    temperature_jitter: float = SOAKED_STRAY_K
    temperature_error: float = 0.0
    case: Literal["random", "worst"] = "random"
    signs: Literal["random", "plus"] = "random"
    run_to_run: bool = True
    in_run: bool = True
    storage: bool = True
    temperature_residual: bool = True
    spikes: float = 0.0
    spike_size: float = 40.0
    references: bool = True

    def correlation_time(self, budget: ErrorBudget) -> float:
        """Of the in-run process of an error, s."""
        return budget.in_run_time if self.in_run_time is None else self.in_run_time


@dataclass(frozen=True)
class TrueTerm:
    """One coefficient of the unit, SI: constant; curve over `temperatures_degc` comes on top of it."""

    error: str
    term: str
    value: float
    unit: str
    hidden: bool = False
    curve: Array | None = None
    temperatures_degc: Array | None = None
    nonlinear: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Truth:
    """The unit as it was drawn, and the bench: what an estimator should find.

    references: `rate_table.level_x` -> how far a reference is off (SI), see `planner.simulate.references`
    """

    seed: int
    terms: tuple[TrueTerm, ...]
    references: Mapping[str, float] = field(default_factory=dict)

    def at(self, error: str, term: str, temperature_degc: float) -> float:
        """The coefficient at a temperature, SI; zero for one that the unit does not have."""
        total = 0.0
        for t in self.terms:
            if t.error == error and t.term == term:
                total += t.value
                if t.curve is not None and t.temperatures_degc is not None:
                    here = np.array([temperature_degc])
                    total += float(along(here, t.temperatures_degc, t.curve)[0])
        return total


@dataclass(frozen=True)
class Unit:
    """A spec prepared for many draws: budgets and families of curves by (sensor, effect), benches by name."""

    budgets: Mapping[tuple[Sensor, str], ErrorBudget]
    families: Mapping[tuple[Sensor, str], CurveFamily]
    accuracies: Mapping[str, BenchAccuracy] = field(default_factory=dict)


def prepared(spec: Spec, shape: FamilyName = "measured") -> Unit:
    """What does not depend on the seed: budgets, and the temperature curves by one family's name."""
    budgets = {(s, effect): budget for s in SENSORS for effect, budget in getattr(spec.unit, s).items()}
    accuracies = {name: bench.accuracy for name, bench in spec.benches.items()}
    return Unit(budgets, curve_families(spec, shape), accuracies)


def simulate(
    design: Design,
    unit: Unit,
    seed: int,
    *,
    hidden: Sequence[HiddenEffect] = (),
    settings: Settings | None = None,
    name: str = "u1",
) -> tuple[DwellTable, Truth]:
    """One unit drawn from its budgets and measured by the design. Same arguments, same bytes."""
    settings = settings or Settings()
    shown, conditions, references = shown_and_true(design, unit, seed, settings)
    readings: dict[Sensor, Array] = {}
    terms: list[TrueTerm] = []
    for sensor in SENSORS:
        readings[sensor], found = _measured(sensor, design, conditions, unit, hidden, settings, seed)
        terms += found
    temperature = shown.temperature_degc
    if settings.temperature_error > 0:
        stray = generator(seed, "thermometer").normal(size=len(design))
        temperature = temperature + settings.temperature_error * stray
    table = DwellTable(
        unit=np.full(len(design), name),
        run=design.run,
        day=shown.day,
        time_on=shown.time_on,
        duration=design.duration,
        temperature_degc=temperature,
        temperature_rate=shown.temperature_rate,
        ref_rate=shown.rate,
        ref_acc=shown.specific_force,
        gyro=readings["gyro"],
        acc=readings["accelerometer"],
        step=design.step,
        bench=design.bench,
        source=f"simulated, seed {seed}",
    )
    return table, Truth(seed, tuple(terms), references.by_name)


def shown_and_true(
    design: Design, unit: Unit, seed: int, settings: Settings
) -> tuple[Conditions, Conditions, TrueReferences]:
    """What the bench shows in every record, what the unit is truly exposed to, and why they differ."""
    shown = _strayed(design.conditions, settings, seed)
    references = drawn_references(design, unit.accuracies if settings.references else {}, seed)
    return shown, references.true_conditions(design, shown), references


def _strayed(nominal: Conditions, settings: Settings, seed: int) -> Conditions:
    """The chamber strays around the soaked temperature, and drifts a little during a record."""
    rng, n = generator(seed, "chamber"), len(nominal.day)
    jitter = settings.temperature_jitter * rng.normal(size=n)
    drift = settings.temperature_jitter / 300.0 * rng.normal(size=n)
    return replace(
        nominal,
        temperature_degc=nominal.temperature_degc + jitter,
        temperature_rate=nominal.temperature_rate + drift,
    )


# ---------------------------------------------------------------- readings of one sensor


def _measured(
    sensor: Sensor,
    design: Design,
    conditions: Conditions,
    unit: Unit,
    hidden: Sequence[HiddenEffect],
    settings: Settings,
    seed: int,
) -> tuple[Array, list[TrueTerm]]:
    """(n, 3) readings, and the coefficients that made them."""
    drawn = drawn_coefficients(sensor, design, conditions, unit, settings, seed)
    for d in hidden_coefficients(sensor, hidden, seed):
        drawn.append(replace(d, values=np.broadcast_to(d.values, (len(design), len(d.values)))))
    runs = replace(of_design(design), conditions=conditions)
    y = runs.response(sensor, [Acting(d.effect, d.values, d.parameters) for d in drawn])
    return _noisy(y, sensor, design, settings, seed), [t for d in drawn for t in d.terms]


@dataclass(frozen=True)
class Drawn:
    """One effect of the unit: coefficients (n, n_terms) in every record, or (n_terms,); the truth of them.

    parameters: nonlinear ones; budget: None of a hidden effect
    """

    effect: Effect
    values: Array
    terms: list[TrueTerm]
    parameters: Mapping[str, float] = field(default_factory=dict)
    budget: ErrorBudget | None = None


def drawn_coefficients(
    sensor: Sensor, design: Design, conditions: Conditions, unit: Unit, settings: Settings, seed: int
) -> list[Drawn]:
    """Every budgeted error of a sensor under true conditions of the records."""
    return [
        Drawn(
            catalog.effects()[e],
            *_coefficients(_Sized(s, e, b, unit.families.get((s, e))), design, conditions, settings, seed),
            budget=b,
        )
        for (s, e), b in unit.budgets.items()
        if s == sensor
    ]


def hidden_coefficients(sensor: Sensor, hidden: Sequence[HiddenEffect], seed: int) -> list[Drawn]:
    """Every undeclared error of a sensor, the same in all records."""
    found = []
    for i, extra in enumerate(h for h in hidden if sensor in h.sensors):
        values = coefficients(extra, sensor, generator(seed, "hidden", sensor, extra.text, str(i)))
        effect = catalog.effects()[extra.effect]
        parameters = {**effect.nonlinear, **extra.nonlinear}
        terms = [
            TrueTerm(
                f"{sensor}.{effect.name}", t.name, float(v), effect.units[sensor], True, nonlinear=parameters
            )
            for t, v in zip(effect.terms(sensor), values, strict=True)
        ]
        found.append(Drawn(effect, np.asarray(values), terms, extra.nonlinear))
    return found


def _noisy(y: Array, sensor: Sensor, design: Design, settings: Settings, seed: int) -> Array:
    rng = generator(seed, "white", sensor)
    sigma = settings.white[sensor] / np.sqrt(design.duration)
    y = y + sigma[:, None] * rng.normal(size=y.shape)
    if settings.spikes > 0:
        struck = generator(seed, "spikes", sensor).uniform(size=y.shape) < settings.spikes
        y = y + struck * settings.spike_size * sigma[:, None] * np.sign(rng.normal(size=y.shape))
    return y


@dataclass(frozen=True)
class _Sized:
    """One budgeted error and its family of temperature curves."""

    sensor: Sensor
    effect: str
    budget: ErrorBudget
    family: CurveFamily | None


def _coefficients(
    sized: _Sized, design: Design, conditions: Conditions, settings: Settings, seed: int
) -> tuple[Array, list[TrueTerm]]:
    """(n, n_terms) coefficients of one error in every record, and the truth of them."""
    effect = catalog.effects()[sized.effect]
    names = [t.name for t in effect.terms(sized.sensor)]
    values = np.zeros((len(design), len(names)))
    truth = []
    for i, name in enumerate(names):
        key = (sized.sensor, sized.effect, name)
        rng = generator(seed, "systematic", *key)
        size = _size(sized.budget.systematic_size, settings, rng)
        grid, curve = _curve(sized, settings, rng)
        values[:, i] = size + _random(sized.budget, key, design, conditions, settings, seed)
        if grid is not None and curve is not None:
            values[:, i] += along(conditions.temperature_degc, grid, curve)
        truth.append(
            TrueTerm(
                f"{sized.sensor}.{sized.effect}", name, size, effect.units[sized.sensor], False, curve, grid
            )
        )
    return values, truth


def _size(largest: float, settings: Settings, rng: np.random.Generator) -> float:
    sign = rng.choice([-1.0, 1.0])
    share = rng.uniform()
    return (
        largest
        * (share if settings.case == "random" else 1.0)
        * (sign if settings.signs == "random" else 1.0)
    )


def _curve(sized: _Sized, settings: Settings, rng: np.random.Generator) -> tuple[Array | None, Array | None]:
    """Grid and values of the error's curve over temperature."""
    family = sized.family
    if family is None or not settings.temperature_residual:
        return None, None
    if isinstance(family, OneUnit) and settings.signs == "plus":
        return family.grid, family.values
    return family.grid, family.draw(rng)


def _random(
    budget: ErrorBudget,
    key: tuple[str, ...],
    design: Design,
    conditions: Conditions,
    settings: Settings,
    seed: int,
) -> Array:
    """(n,) run-to-run, in-run and storage parts of one coefficient."""
    total = np.zeros(len(design))
    if settings.run_to_run and budget.has_run_to_run:
        temperature = conditions.temperature_degc
        rng = generator(seed, "run_to_run", *key)
        draw = power_on_draws(design, temperature, budget.temperature_correlation, rng)
        total += budget.run_to_run_sigma(temperature) * draw
    if settings.in_run and budget.in_run_sigma > 0:
        total += budget.in_run_sigma * gauss_markov(
            design, settings.correlation_time(budget), generator(seed, "in_run", *key)
        )
    if settings.storage and budget.storage_sigma > 0:
        walked = walk(conditions.day, generator(seed, "storage", *key))
        sizes = np.diff(np.append(design.starts, len(design)))
        total += budget.storage_sigma * np.repeat(walked[design.starts], sizes)  # it stands while on
    return total
