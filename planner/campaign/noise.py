"""The noise of one channel: which variances its rows have, and what each of them is called.

    V = diag(N²/T + …) + Σ_e s_e² x_e x_eᵀ ∘ 1 + Σ_e σ_e² x_e x_eᵀ ∘ exp(−|Δt|/τ_e)   in every power-on

White noise of a record (∝ 1/duration), a part that averaging does not lower, one that grows with the input
(temperature reading and rate errors times slope); for every power-on a draw of each error that the spec lets
change from power-on to power-on, and within it the first-order Gauss-Markov process of each error that the
spec lets drift (K 2.1). Their sizes come from the data by REML, or from the spec for a campaign to be made:
its records also have what a chamber that strays by σ_T from record to record makes of curves that nobody
knows yet, σ_T² Σ_e E f_e'(T)² x_e².
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from planner import catalog
from planner.campaign.power_ons import PowerOns
from planner.measurement import ChannelModel, Parts
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.protocols import Effect
from planner.solvers.block_covariance import LARGEST
from planner.solvers.random_effects import Drift, RandomEffects
from planner.solvers.reml import Variances
from planner.spec.budget import ErrorBudget
from planner.spec.model import Unit

Kind = Literal[
    "white", "temperature_stray", "chamber_stray", "constant", "rate_noise", "run_to_run", "in_run", "prior"
]
SOAKED_STRAY_K = 0.05  # one sigma, by which a soaked chamber is warmer in one record than in another
RATE_NOISE_FROM = {"gyro": 0.5, "accelerometer": 30.0}  # rad/s, m/s²: below, a reading's error is no noise
LEAST_WHITE = 1e-8  # of the run-to-run variance: readings without any noise must not make V singular
LEAST_BESIDE_SHARED = 1e-8  # of what shared unknowns add; at 500 deg/s a good gyro has 1e-6 of a mounting
NO_NOISE = 1e-24  # SI²: of a sensor of which the spec knows neither noise nor spread
Slopes = Callable[[], Mapping[ErrorName, Array]]
"""Of curves that are not known: (n,) root mean square at the records, SI/K; asked when they are needed."""
BIAS, SCALE_FACTOR = "bias", "scale_factor"  # what every power-on may draw anew, whatever the spec says
LONGEST = 256  # records of a power-on, of a few of which blocks are dense
LEAST_TO_WANDER = 4  # power-ons, where they are that long
WORK = 3e8  # Σ m³ over power-ons of m records: a tenth of a second a factor


@dataclass(frozen=True)
class Component:
    """One variance: its kind, the error that it spreads, and which of its terms."""

    kind: Kind
    error: ErrorName
    term: str = ""


@dataclass(frozen=True)
class Noise:
    """The noise of one channel as the mixed model takes it.

    duration: mean of the records', s, to which the white variance belongs
    known: the run-to-run variances are the spec's, because the data have too few power-ons
    """

    components: tuple[Component, ...]
    effects: RandomEffects
    duration: float
    known: bool = False

    def of(self, keep: list[int]) -> Noise:
        """Some of the components only."""
        components = tuple(self.components[i] for i in keep)
        return Noise(components, self.effects.of(keep), self.duration, self.known)


@dataclass
class _Pieces:
    diagonals: dict[Component, Array] = field(default_factory=dict)
    slopes: dict[Component, Array] = field(default_factory=dict)
    drifts: dict[Component, Drift] = field(default_factory=dict)


def noise_model(
    model: ChannelModel,
    parts: Parts,
    runs: PowerOns,
    unit: Unit,
    weights: Array,
    *,
    sizes_known: bool = False,
) -> Noise:
    """The variances that this channel can have; rows stand power-on by power-on.

    weights: (n,) of the robust fit, 1 for a row that is believed
    sizes_known: the spec's are taken; data of one record a power-on cannot tell its draw from white noise
    """
    sensor, found = model.sensor, _Pieces()
    duration = runs.known_duration
    white = duration.mean() / duration
    bias, scale = ErrorName.of(sensor, BIAS), ErrorName.of(sensor, SCALE_FACTOR)
    found.diagonals[Component("white", bias)] = white / weights
    stray = _stray(model)
    if np.any(stray):
        found.diagonals[Component("temperature_stray", bias)] = stray**2 / weights
    if duration.max() > 1.5 * duration.min():
        found.diagonals[Component("constant", bias)] = np.ones_like(white) / weights
    if np.abs(model.u).max(initial=0.0) > RATE_NOISE_FROM[sensor]:
        found.diagonals[Component("rate_noise", scale)] = model.u**2 / weights
    if sizes_known or len(runs.starts) < len(duration):
        longest = LARGEST if sizes_known else LONGEST
        _draws(found, model, parts, runs, unit, _can_differ_within(runs, longest))
    effects = RandomEffects(
        runs.starts,
        np.array([*found.diagonals.values()]),
        np.array([*found.slopes.values()]) if found.slopes else np.empty((0, len(duration))),
        tuple(found.drifts.values()),
    )
    return Noise((*found.diagonals, *found.slopes, *found.drifts), effects, float(duration.mean()))


def _stray(model: ChannelModel) -> Array:
    """(n,) kelvins from the nearest node of the bias table; zero without a table of several nodes.

    The unit's curve has a slope of its own at a node, which the chords to the next nodes do not know.
    """
    nodes, t = model.nodes_of(BIAS), model.conditions.temperature_degc
    if nodes is None or len(nodes) < 2:
        return np.zeros(len(t))
    return np.asarray(np.min(np.abs(t[:, None] - nodes[None, :]), axis=1))


def with_stray(
    noise: Noise, model: ChannelModel, parts: Parts, unit: Unit, weights: Array, slopes: Slopes
) -> Noise:
    """The noise with what a chamber's stray makes of curves that are not known, where that is anything."""
    strays = strayed_variances(squared_columns(model, parts, unit), slopes())
    if not np.any(strays):
        return noise
    effects = noise.effects
    wider = replace(effects, diagonals=np.vstack([effects.diagonals, strays / weights]))
    stray, a = Component("chamber_stray", ErrorName.of(model.sensor, BIAS)), len(effects.diagonals)
    return replace(noise, components=(*noise.components[:a], stray, *noise.components[a:]), effects=wider)


def squared_columns(model: ChannelModel, parts: Parts, unit: Unit) -> dict[ErrorName, Array]:
    """Error -> (n,) Σ x² over its terms, fitted or not."""
    found: dict[ErrorName, Array] = {}
    for (error, _), z in (columns_of_errors(model, parts) | unfitted_columns(model, parts, unit)).items():
        found[error] = found.get(error, 0.0) + z**2
    return found


def strayed_variances(columns: Mapping[ErrorName, Array], slopes: Mapping[ErrorName, Array]) -> Array | float:
    """(n,) of what a chamber's stray makes of curves with slopes (n,), SI²; columns: squared."""
    return SOAKED_STRAY_K**2 * sum(slopes[error] ** 2 * x for error, x in columns.items() if error in slopes)


# ---------------------------------------------------------------- what a power-on draws


def _draws(
    found: _Pieces, model: ChannelModel, parts: Parts, runs: PowerOns, unit: Unit, within: bool
) -> None:
    """Run-to-run of bias and scale factor always, of other errors if the spec says so; in-run if it does."""
    beside = unfitted_columns(model, parts, unit)
    for (error, term), z in {**columns_of_errors(model, parts), **beside}.items():
        if not np.any(z):
            continue
        budget = budget_of(unit, error)
        shape = _shape(budget, model.conditions.temperature_degc)
        always = error.effect in (BIAS, SCALE_FACTOR) and (error, term) not in beside
        if shape is not None or always:
            name = Component("run_to_run", error, term)
            drawn = z if shape is None else z * shape
            length = None if budget is None else budget.temperature_correlation
            if (
                length is not None and within
            ):  # a power-on that goes through temperatures draws anew on its way
                found.drifts[name] = Drift(drawn, model.conditions.temperature_degc, length, smooth=True)
            else:
                found.slopes[name] = drawn
        if budget is not None and budget.in_run_sigma > 0.0 and within:
            drift = Drift(z, model.conditions.time_on, budget.in_run_time)
            found.drifts[Component("in_run", error, term)] = drift


def _can_differ_within(runs: PowerOns, longest: int) -> bool:
    """Whether what goes on changing within power-ons can be weighed: blocks of V are dense then.

    A few ramps of a chamber of a hundred records each are little work. Without what wanders on them an
    asymmetry was 3.4 sigma off and a warm-up 2.7, and "neighbouring records err alike" beside them. In one
    ramp alone what wanders and a curve over temperature are the same, and the curve has it.
    """
    most = int(np.max(runs.sizes))
    if most <= LARGEST:
        return True
    work = float(np.sum(runs.sizes.astype(float) ** 3))
    return most <= longest and work <= WORK and len(runs.sizes) >= LEAST_TO_WANDER


def unfitted_columns(model: ChannelModel, parts: Parts, unit: Unit) -> dict[tuple[ErrorName, str], Array]:
    """(error, term) -> (n,) what one unit of a budgeted error adds of which nothing is fitted.

    The unit has it all the same: its constant and its curve lead the estimates of the others astray, and what
    power-ons draw of it is noise of the records.
    """
    carried = {c.effect.name for c in model.carried}
    found: dict[tuple[ErrorName, str], Array] = {}
    for name in getattr(unit, model.sensor):
        effect = catalog.effects()[name]
        if name in carried or (effect.tabled and effect.temperature_of in carried):
            continue
        terms = [t for t, term in enumerate(effect.terms(model.sensor)) if model.channel in term.channels]
        every = _columns(model, parts, effect, terms)
        found |= {key: z for key, z in every.items() if np.any(z)}
    return found


def columns_of_errors(model: ChannelModel, parts: Parts) -> dict[tuple[ErrorName, str], Array]:
    """(error, term) -> (n,) what one unit of it adds, table or not: what a draw of a power-on multiplies."""
    found: dict[tuple[ErrorName, str], Array] = {}
    for c in model.carried:
        found |= _columns(model, parts, c.effect, c.terms)
    return found


def _columns(
    model: ChannelModel, parts: Parts, effect: Effect, terms: Sequence[int]
) -> dict[tuple[ErrorName, str], Array]:
    """(error, term) -> (n,) of some terms of one effect; a scale factor's are driven by the turned input."""
    conditions = model.with_input(parts.v) if effect.group == "scale_factor" else model.conditions
    full = effect.regressors(model.sensor, conditions)[:, model.channel]
    error, names = ErrorName.of(model.sensor, effect.name), effect.terms(model.sensor)
    return {(error, names[t].name): full[:, t] for t in terms}


def budget_of(unit: Unit, error: ErrorName) -> ErrorBudget | None:
    """What the spec says of an error; None for nothing."""
    found: ErrorBudget | None = getattr(unit, error.sensor).get(error.effect)
    return found


def _shape(budget: ErrorBudget | None, temperature_degc: Array) -> Array | None:
    """(n,) run-to-run sigma over temperature relative to its mean, as the spec's table has it."""
    if budget is None or budget.run_to_run_largest <= 0.0:
        return None
    table = budget.run_to_run_table
    if table is None:
        return np.ones(len(temperature_degc))
    sigma = budget.run_to_run_sigma(temperature_degc)
    return np.asarray(np.maximum(sigma, 1e-3 * budget.run_to_run_largest) / _mean_sigma(budget))


def _mean_sigma(budget: ErrorBudget) -> float:
    """What the variance of a `run_to_run` component belongs to: the mean of the spec's table."""
    table = budget.run_to_run_table
    return budget.run_to_run_largest if table is None else float(np.mean([*table.values()]))


# ---------------------------------------------------------------- by the spec


def spec_variances(noise: Noise, unit: Unit, white: float | None = None, shared: float = 0.0) -> Variances:
    """Variances as the spec has them, SI².

    white: variance of a record of mean duration in its place; shared: what unknowns of all power-ons add
    """
    theta = np.array([_from_spec(c, noise, unit, white) for c in noise.components])
    e, K = noise.effects, len(theta)
    drawn = [c.kind in ("run_to_run", "in_run") for c in noise.components]
    between = float(np.sum(np.where(drawn, theta * e.mean_sizes(), 0.0)))
    theta[0] = max(theta[0], LEAST_WHITE * between, LEAST_BESIDE_SHARED * shared, NO_NOISE)
    return Variances(theta, np.zeros((K, K)), theta > 0, float("nan"), True)


def _from_spec(c: Component, noise: Noise, unit: Unit, white: float | None) -> float:
    if c.kind in ("prior", "chamber_stray"):
        return 1.0
    if c.kind == "white":
        return unit.white_of_records(c.error.sensor) ** 2 / noise.duration if white is None else white
    budget = budget_of(unit, c.error)
    if budget is None:
        return 0.0
    if c.kind == "in_run":
        return budget.in_run_sigma**2
    return _mean_sigma(budget) ** 2 if c.kind == "run_to_run" and budget.run_to_run_largest > 0 else 0.0
