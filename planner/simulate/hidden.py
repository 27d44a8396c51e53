"""`--hidden g_sensitivity=0.01deg/s/g`: an effect that the spec does not declare, for the simulator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from planner import catalog
from planner.errors import InputError
from planner.protocols import SENSORS, Effect, Sensor
from planner.spec.places import did_you_mean
from planner.units import UnitError, parse, unit_factor


@dataclass(frozen=True)
class HiddenEffect:
    """size: SI, the largest of its terms (or of the one `term`); sensors: on which it acts.

    nonlinear: its nonlinear parameters that are not at their defaults, as the effect takes them
    """

    effect: str
    sensors: tuple[Sensor, ...]
    term: str | None
    size: float
    text: str
    nonlinear: Mapping[str, float] = field(default_factory=dict)


def hidden_effect(text: str) -> HiddenEffect:
    """Read `[sensor.]effect[.term]=value[,parameter=value…]`, e.g. `warm_up=0.01 deg/s,time_constant=600 s`.

    Raises InputError for an unknown effect, sensor, term or parameter, a value whose unit fits none of its
    sensors, and a parameter outside its range.
    """
    first, *others = text.split(",")
    place, equals, value = first.partition("=")
    if not equals:
        raise InputError(f"--hidden {text!r}: write EFFECT=VALUE, e.g. g_sensitivity=0.01deg/s/g")
    parts = place.strip().split(".")
    asked: Sequence[Sensor] = SENSORS
    if parts[0] in SENSORS:
        asked = (parts[0],)
        parts = parts[1:]
    effect = _known(parts[0] if parts else "", text)
    try:
        quantity = parse(value)
    except UnitError as error:
        raise InputError(f"--hidden {text!r}: {error}") from error
    sensors = tuple(
        s for s in asked if s in effect.sensors and unit_factor(effect.units[s])[1] == quantity.dimension
    )
    if not sensors:
        units = (
            ", ".join(f"{effect.units[s]} ({s})" for s in asked if s in effect.sensors)
            or "none of its sensors"
        )
        raise InputError(f"--hidden {text!r}: the value of {effect.name} must have a unit like {units}")
    term = parts[1] if len(parts) > 1 else None
    _check_term(effect, sensors[0], term, text)
    return HiddenEffect(
        effect.name, sensors, term, quantity.si, text, dict(_parameter(effect, o, text) for o in others)
    )


def _parameter(effect: Effect, written: str, text: str) -> tuple[str, float]:
    """Name and value of one nonlinear parameter, as the effect takes it."""
    name, _, value = (part.strip() for part in written.partition("="))
    known = {p.name: p for p in effect.parameters}
    if name not in known:
        there = ", ".join(known) or "none"
        raise InputError(f"--hidden {text!r}: {effect.name} has no parameter {name!r}; it has {there}")
    p = known[name]
    try:
        return name, p.read(value)
    except UnitError as error:
        advice = "" if "write" in str(error) else f"; write e.g. {name}={p.shown(p.default)}"
        raise InputError(f"--hidden {text!r}: {error}{advice}") from error


def _known(name: str, text: str) -> Effect:
    effects = catalog.effects()
    if name in effects:
        return effects[name]
    hint = did_you_mean(name, effects) or f"; there are {', '.join(effects)}"
    raise InputError(f"--hidden {text!r}: no effect is called {name!r}{hint}")


def _check_term(effect: Effect, sensor: Sensor, term: str | None, text: str) -> None:
    names = [t.name for t in effect.terms(sensor)]
    if term is not None and term not in names:
        raise InputError(f"--hidden {text!r}: {effect.name} has no term {term!r}; it has {', '.join(names)}")


def coefficients(hidden: HiddenEffect, sensor: Sensor, rng: np.random.Generator) -> np.ndarray:
    """(n_terms,) SI: the one term, or a random direction whose largest component is the size."""
    names = [t.name for t in catalog.effects()[hidden.effect].terms(sensor)]
    if hidden.term is not None:
        return np.array([hidden.size if name == hidden.term else 0.0 for name in names])
    direction = rng.normal(size=len(names))
    return np.asarray(hidden.size * direction / np.abs(direction).max())
