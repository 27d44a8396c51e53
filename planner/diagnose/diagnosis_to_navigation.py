"""What was found → what it costs on the spec's trajectory, if nobody compensates it and once it is.

    before = ‖Σ_k v_k c_k‖,   v_k the navigation error per unit of coefficient c_k          (K 3.3, eqs 32-34)

The forcing of v_k is what the effect says it adds along the flight. An effect of the bench alone (a bent arm,
a reference without the Earth) adds nothing in flight; what it does is to bend the declared coefficients,

    δβ = (JᵀV⁻¹J)⁻¹ JᵀV⁻¹ g_k,   g_k its column on the bench's records,

and v_k is then the flight's answer to −J δβ. After: the same v_k with the half-widths of the coefficients'
intervals at the spec's confidence, combined by the requirement's rule.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner import catalog
from planner.diagnose.diagnosis_to_residual import ChannelFits, UnitFits
from planner.diagnose.weighed_fit import linear_jacobian
from planner.measurement import AXES, evaluate
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.diagnosis import FoundEffect, FoundTerm, NavigationCost
from planner.nouns.sensitivities import Constraint, Sensitivities, SensitivityColumn
from planner.nouns.sensor import ErrorName
from planner.nouns.trajectory import Trajectory
from planner.physics.error_dynamics import propagate_errors
from planner.plan.spec_to_sensitivity import conditions_of, constraints
from planner.protocols import SENSORS, Sensor
from planner.solvers.distributions import normal_quantile, student_quantile
from planner.solvers.gaussian_length import percentile
from planner.solvers.least_squares import least_squares
from planner.spec.model import Given, Spec

STARTS = 3  # what is straight between two temperatures is worst at an end; what is a table, near one
_ROUNDING = 1e-9  # of a requirement's limit: what the integration leaves of nothing

Column = Callable[[Conditions], Array]


@dataclass(frozen=True)
class _Term:
    """One coefficient: value and half-width at the spec's confidence, SI.

    flight: conditions -> (n, 3) what it adds in flight; taken: what the declared coefficients take up of it
    """

    error: str
    name: str
    sensor: Sensor
    value: float
    half: float
    flight: Column
    taken: Column


def navigation_costs(
    found: Sequence[FoundEffect], fits: UnitFits, spec: Spec, trajectory: Trajectory
) -> tuple[NavigationCost, ...]:
    """One entry per requirement, at the moment at which it is worst, for all found effects together.

    Of effects that change with temperature by their own equation also from the start at which it is worst.
    """
    terms = [t for effect in found for t in _terms(effect, fits, spec.plan.confidence)]
    if not terms:
        return ()
    each = [_flown(found, terms, fits, spec, warm) for warm in _starts(found, spec, trajectory)]
    return tuple(max(costs, key=lambda c: c.before) for costs in zip(*each, strict=True))


def _starts(found: Sequence[FoundEffect], spec: Spec, trajectory: Trajectory) -> list[Trajectory]:
    """The flight as it is, and where it matters at other temperatures at which requirements let it start."""
    if not _changes(found) or all(r.temperature == "flight" for r in spec.requirement):
        return [trajectory]
    low, high = spec.plan.temperatures.range
    own = trajectory.temperature_degc
    others = [np.clip(own - own[0] + t, low, high) for t in np.linspace(low, high, STARTS)]
    return [trajectory, *(replace(trajectory, temperature_degc=warm) for warm in others)]


def _changes(found: Sequence[FoundEffect]) -> bool:
    """Whether temperature changes what was found, by an equation or by the table that it would get."""
    return any("temperature_degc" in catalog.effects()[e.effect].needs for e in found)


def _flown(
    found: Sequence[FoundEffect], terms: Sequence[_Term], fits: UnitFits, spec: Spec, trajectory: Trajectory
) -> list[NavigationCost]:
    """On one flight."""
    flown = spec.model_copy(update={"sensitivities": "simulated"})
    last_day = max(trajectory.day, float(fits.table.day.max(initial=0.0)))
    bound = constraints(flown, _sensitivities(terms, trajectory, spec, last_day))
    how = "the found effects flown on the spec's trajectory"
    if isinstance(spec.sensitivities, Given):
        how += "; the spec's published coefficients say nothing of them"
    known = {e.effect: catalog.effects()[e.effect] for e in found}
    if last_day > trajectory.day and any("day" in effect.needs for effect in known.values()):
        how += f"; on the last day of the data, {last_day:.3g}"
    bench = sorted(name for name, effect in known.items() if effect.bench_only)
    if bench:
        how += f"; {', '.join(bench)} does not fly: what counts is how it bends the declared coefficients"
    if _changes(found):
        how += f"; started at {trajectory.temperature_degc[0]:.3g} degC"
    return [
        _cost([c for c in bound if c.requirement == i], terms, spec.plan.confidence, how)
        for i in range(len(spec.requirement))
    ]


def _cost(bound: Sequence[Constraint], terms: Sequence[_Term], confidence: float, how: str) -> NavigationCost:
    values = np.array([t.value for t in terms])
    half = np.array([t.half for t in terms])
    flight, taken = (np.array([_vectors(c, terms, kind) for c in bound]) for kind in ("flight", "taken"))
    as_calibrated = np.linalg.norm(np.einsum("itk,t->ik", flight - taken, values), axis=1)
    bench = np.array([catalog.effects()[ErrorName(t.error).effect].bench_only for t in terms])
    own = np.where(bench[None, :, None], -taken, flight)
    before = np.linalg.norm(np.einsum("itk,t->ik", own, values), axis=1)
    if before.max() <= _ROUNDING * bound[0].limit:
        how += "; nothing on this flight excites them"
    after = np.array([left_in_flight(c, v, half, confidence) for c, v in zip(bound, own, strict=True)])
    return NavigationCost(
        error=bound[0].error,
        unit=bound[0].unit,
        before=float(before.max()),
        after=float(after.max()),
        confidence=confidence,
        how=how,
        as_calibrated=float(as_calibrated.max()),
        limit=bound[0].limit,
    )


def left_in_flight(constraint: Constraint, vectors: Array, half: Array, confidence: float) -> float:
    """What intervals of half-width (t,) leave, by the requirement's rule; vectors (t, k)."""
    lengths = np.linalg.norm(vectors, axis=1) * half
    if constraint.rule == "worst_case":
        return float(lengths.sum())
    if constraint.rule == "rss" or constraint.percentile is None:
        return float(np.sqrt(np.sum(lengths**2)))
    spread = vectors * (half / float(normal_quantile((1.0 + confidence) / 2.0)))[:, None]
    return float(percentile(spread.T @ spread, constraint.percentile))


def _vectors(constraint: Constraint, terms: Sequence[_Term], kind: str) -> Array:
    """(t, k) of every term, in the terms' order."""
    rows = {name: iter(v) for name, v in constraint.vectors.items()}
    return np.array([next(rows[_label(t, kind)]) for t in terms])


def _label(term: _Term, kind: str) -> str:
    return term.error if kind == "flight" else f"{term.error} taken"


# ---------------------------------------------------------------- terms


def _terms(found: FoundEffect, fits: UnitFits, confidence: float) -> list[_Term]:
    """The effect's linear coefficients, and one more for each nonlinear parameter that is uncertain."""
    linear = [t for t in found.terms if not t.parameter]
    made = [_linear(found, t, linear, fits, confidence) for t in linear]
    uncertain = [_nonlinear(found, t, linear, confidence) for t in found.terms if t.parameter]
    return [*made, *(t for t in uncertain if t is not None)]


def _linear(
    found: FoundEffect, term: FoundTerm, siblings: Sequence[FoundTerm], fits: UnitFits, confidence: float
) -> _Term:
    shared = sum(t.name == term.name for t in siblings) > 1

    def flight(conditions: Conditions) -> Array:
        added = _regressor(found, term.name, conditions, found.nonlinear)
        return added * (np.array(list(AXES)) == term.channel[-1]) if shared else added

    if catalog.effects()[found.effect].bench_only:
        own: Column = _nothing
    else:
        own = flight
    return _Term(
        f"{found.sensor}.{found.effect}",
        term.name,
        found.sensor,
        term.value,
        _half(term, confidence),
        own,
        _taken_up(found, flight, fits),
    )


def _nothing(conditions: Conditions) -> Array:
    return np.zeros((len(conditions.day), 3))


def _nonlinear(
    found: FoundEffect, term: FoundTerm, linear: Sequence[FoundTerm], confidence: float
) -> _Term | None:
    """What half the parameter's interval changes in flight, as a term of unit half-width and no value."""
    if catalog.effects()[found.effect].bench_only or not np.isfinite([term.low, term.high]).all():
        return None
    share = _half(term, confidence) / max(abs(term.high - term.low) / 2.0, 1e-300)

    def change(conditions: Conditions) -> Array:
        ends = [{**found.nonlinear, term.name: end} for end in (term.low, term.high)]
        low, high = (
            sum((t.value * _regressor(found, t.name, conditions, end) for t in linear), np.zeros(3))
            for end in ends
        )
        return np.asarray(share * (high - low) / 2.0)

    return _Term(f"{found.sensor}.{found.effect}", f"{term.name}", found.sensor, 0.0, 1.0, change, _nothing)


def _regressor(
    found: FoundEffect, name: str, conditions: Conditions, nonlinear: Mapping[str, float]
) -> Array:
    effect = catalog.effects()[found.effect]
    index = [t.name for t in effect.terms(found.sensor)].index(name)
    return np.asarray(effect.regressors(found.sensor, conditions, nonlinear)[:, :, index])


def _half(term: FoundTerm, confidence: float) -> float:
    """Half-width of the interval at another confidence than its own 95 %."""
    half = (term.high - term.low) / 2.0
    if not np.isfinite(half):
        return abs(term.value)  # an interval without end tells no more than the coefficient's size
    freedom = term.freedom if np.isfinite(term.freedom) and term.freedom >= 1.0 else 1e6
    return float(
        half * student_quantile((1.0 + confidence) / 2.0, freedom) / student_quantile(0.975, freedom)
    )


# ---------------------------------------------------------------- what the declared coefficients take up


def _taken_up(found: FoundEffect, column: Column, fits: UnitFits) -> Column:
    """conditions -> (n, 3) the declared model's answer to a unit of the effect on the bench's records."""
    on_bench = column(fits.table.conditions())
    bent = [
        (c, _declared_answer(c, on_bench[:, AXES.index(c.channel[-1])]))
        for c in fits.channels
        if c.sensor == found.sensor and np.any(on_bench[:, AXES.index(c.channel[-1])])
    ]

    def taken(conditions: Conditions) -> Array:
        total = np.zeros((len(conditions.day), 3))
        for c, delta in bent:
            total[:, AXES.index(c.channel[-1])] = _declared_columns(c, conditions) @ delta
        return total

    return taken


def _declared_answer(fits: ChannelFits, column: Array) -> Array:
    """(p,) δβ of the declared coefficients per unit of the column (n,)."""
    white = fits.before.v.whiten(np.column_stack([fits.before.J, column]))
    return least_squares(white[:, :-1], white[:, -1])[0]


def _declared_columns(fits: ChannelFits, conditions: Conditions) -> Array:
    """(n, p) the declared model's derivative under other conditions."""
    model = replace(fits.before.model, conditions=conditions)
    return linear_jacobian(model, fits.before.theta, evaluate(model, fits.before.theta))


# ---------------------------------------------------------------- flight


def _sensitivities(terms: Sequence[_Term], trajectory: Trajectory, spec: Spec, day: float) -> Sensitivities:
    """Columns of every term twice: what it adds in flight, and what the declared model has taken up."""
    columns = [(t, kind) for kind in ("flight", "taken") for t in terms]

    def forcing(start: int, stop: int) -> tuple[list[Array], list[Array]]:
        conditions = conditions_of(trajectory, start, stop)
        conditions = replace(conditions, day=np.full(len(conditions.day), day))
        gyro, accelerometer = (
            [getattr(t, kind)(conditions)[:, :, None] for t, kind in columns if t.sensor == s]
            for s in SENSORS
        )
        return gyro, accelerometer

    instants = [float(r.at) for r in spec.requirement if not isinstance(r.at, str)]
    history = propagate_errors(trajectory, forcing, instants=instants)
    order = np.argsort([i for s in SENSORS for i, (t, _) in enumerate(columns) if t.sensor == s])
    return Sensitivities(
        time_s=history.time_s,
        columns=tuple(SensitivityColumn(_label(t, kind), t.name, "1") for t, kind in columns),
        position=history.position[:, :, order],
        velocity=history.velocity[:, :, order],
        attitude=history.attitude[:, :, order],
    )
