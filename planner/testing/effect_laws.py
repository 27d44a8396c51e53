"""What every effect must satisfy, whatever it models: what it declares, and what its regressors do.

The campaign, the fit and the diagnosis believe what an effect says of itself and never look after it: a
regressor that leans on a condition outside `needs`, or rows that know of each other, would give wrong figures
without a word.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields
from typing import get_args

import numpy as np

from planner import catalog
from planner.effects._dependence import CONDITIONS, moved, random_conditions
from planner.errors import InputError
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import Condition, Effect, Group, Parameter, Sensor
from planner.units import UnitError, unit_factor

ROWS = 1000  # some of them in the narrowest segment of any table: 25 deg/s of 10 rad/s
DRAWS = 6  # values of the parameters beside their defaults and the ends of their ranges
SAME = 1e-12  # of the largest regressor: other sums of the same terms differ by rounding alone
STEP = 1e-4  # of a parameter's range as it is carried, for a derivative
SMOOTH = 0.9  # share of the rows whose derivative must exist: the others may lie at a step or a knee

Shape = Mapping[str, float]
Check = Callable[["_Seen"], Iterator[str]]


def check_effect(effect: Effect, seed: int = 0) -> None:
    """Hold an effect to our laws, over random conditions and parameters of a seed.

    Raises InputError that lists everything that is wrong.
    """
    name = str(getattr(effect, "name", type(effect).__name__))
    wrong = catalog.faults_of(effect, "effects", name)
    if not wrong:
        wrong = [*_declared(effect), *_parameters(effect)]
    if not wrong:
        with np.errstate(all="ignore"):  # what is not finite is said in words
            for sensor in effect.sensors:
                wrong += _lawless(_Seen(effect, sensor, np.random.default_rng(seed)))
            wrong += _idle_needs(effect, seed)
    if wrong:
        said = "\n".join(f"  {fault}" for fault in dict.fromkeys(wrong))
        raise InputError(f"the effect {name!r} is not as planner needs it:\n{said}")


# ---------------------------------------------------------------- what it says of itself


def _declared(effect: Effect) -> Iterator[str]:
    """Names, group, units, needs, terms, and what belongs together."""
    if _is_another(effect):
        origin = catalog.origins("effects")[effect.name]
        yield f"the name is that of another: the {origin}"
    if effect.group not in get_args(Group):
        yield f"group {effect.group!r} is none of {', '.join(get_args(Group))}"
    for sensor, unit in effect.units.items():
        try:
            unit_factor(unit)
        except UnitError as error:
            yield f"units of the {sensor}: {error}"
    strange = sorted(set(effect.needs) - set(CONDITIONS))
    if strange:
        yield f"needs {', '.join(strange)}: conditions are {', '.join(CONDITIONS)}"
    if effect.variable is not None and effect.variable not in effect.needs:
        yield f"its variable {effect.variable!r} is not among its needs"
    if not 0.0 <= effect.misfit < 1.0:
        yield f"misfit {effect.misfit:g} is no share: 0 … 1, 1 excluded"
    for field in ("title", "equation"):
        if not str(getattr(effect, field)).strip():
            yield f"its {field} is empty; people read it"
    for sensor in effect.sensors:
        yield from _terms(effect, sensor)
    if effect.temperature_of == effect.name:
        yield "temperature_of names the effect itself"


def _is_another(effect: Effect) -> bool:
    """Whether an installed plug-in of this name is of another class."""
    if effect.name not in catalog.effects():
        return False
    if catalog.wrong_with("effects", effect.name):
        return True
    known = type(catalog.effects()[effect.name])
    return (known.__qualname__, known.__module__) != (type(effect).__qualname__, type(effect).__module__)


def _terms(effect: Effect, sensor: Sensor) -> Iterator[str]:
    terms = effect.terms(sensor)
    names = [t.name for t in terms]
    if not terms:
        yield f"{sensor}: it has no terms"
    if len(set(names)) < len(names):
        yield f"{sensor}: two terms have one name, {', '.join(names)}"
    for term in terms:
        if not set(term.channels) <= {0, 1, 2} or len(set(term.channels)) < len(term.channels):
            yield f"{sensor}: term {term.name!r} acts on {term.channels}; channels are 0, 1, 2, each once"
    one_each = sorted(t.channels for t in terms) == [(0,), (1,), (2,)]
    if effect.tabled and (effect.temperature_of is None or effect.group == "misalignment" or not one_each):
        yield (
            f"{sensor}: tabled is for the change of a bias or scale factor over temperature, with "
            "temperature_of and one term a channel"
        )


def _parameters(effect: Effect) -> Iterator[str]:
    names = [p.name for p in effect.parameters]
    if len(set(names)) < len(names):
        yield f"two parameters have one name, {', '.join(names)}"
    for p in effect.parameters:
        if not p.name.isidentifier():
            yield f"parameter {p.name!r} is no name; write letters, digits and underscores"
        try:
            p.read(p.shown(p.default))
        except UnitError as error:
            yield f"parameter {p.name}: {error}"
    if dict(effect.nonlinear) != {p.name: p.default for p in effect.parameters}:
        yield "`nonlinear` must be the parameters' defaults"


# ---------------------------------------------------------------- what its regressors do


class _Seen:
    """An effect on one sensor, with rows of conditions and values of its parameters to ask it about."""

    def __init__(self, effect: Effect, sensor: Sensor, rng: np.random.Generator) -> None:
        self.effect, self.sensor, self.rng = effect, sensor, rng
        self.here, self.there = random_conditions(rng, ROWS), random_conditions(rng, ROWS)
        self.shapes = list(_shapes(effect.parameters, rng))

    def ask(self, conditions: Conditions, shape: Shape | None = None) -> Array:
        """The regressors."""
        return np.asarray(self.effect.regressors(self.sensor, conditions, shape))

    def everywhere(self) -> Iterator[tuple[Shape, Array]]:
        """Parameters and regressors, at every value of the parameters."""
        for shape in self.shapes:
            yield shape, self.ask(self.here, shape)


def _shapes(parameters: Sequence[Parameter], rng: np.random.Generator) -> Iterator[Shape]:
    """The defaults, each end of the ranges, and values between, drawn as they are carried."""
    yield {p.name: p.default for p in parameters}
    if parameters:
        yield {p.name: p.low for p in parameters}
        yield {p.name: p.high for p in parameters}
    for _ in range(DRAWS if parameters else 0):
        yield {p.name: p.value(rng.uniform(*p.bounds)) for p in parameters}


def _lawless(seen: _Seen) -> list[str]:
    """The laws in their order; those after the form are asked only of what has the form."""
    for laws in (
        (_form,),
        (_own_channels, _no_more_than_needs, _rows, _left_alone, _defaults, _group, _slopes),
    ):
        wrong = [f"{seen.sensor}: {fault}" for law in laws for fault in _asked(law, seen)]
        if wrong:
            return wrong
    return []


def _asked(law: Check, seen: _Seen) -> Iterator[str]:
    """What a law says, or that the effect itself gave up."""
    try:
        yield from law(seen)
    except Exception as error:  # an effect is other people's code and may raise anything
        yield f"its regressors fail: {type(error).__name__}: {error}"


def _form(seen: _Seen) -> Iterator[str]:
    terms = len(seen.effect.terms(seen.sensor))
    for rows in (0, 1, ROWS):
        found = seen.ask(seen.here.at(np.arange(rows)))
        if found.shape != (rows, 3, terms) or found.dtype != np.float64:
            yield (
                f"regressors of {rows} rows are {found.dtype} {found.shape}; they must be float64 "
                f"({rows}, 3, {terms}): rows, channels, terms"
            )
    for shape, found in seen.everywhere():
        if not np.isfinite(found).all():
            yield f"regressors are not finite{_at(shape)}"
            return


def _own_channels(seen: _Seen) -> Iterator[str]:
    every = np.concatenate([found for _, found in seen.everywhere()])
    for index, term in enumerate(seen.effect.terms(seen.sensor)):
        acts = [channel for channel in range(3) if np.any(every[:, channel, index] != 0.0)]
        if not set(acts) <= set(term.channels):
            yield f"term {term.name!r} acts on channels {acts} and declares {list(term.channels)}"
        elif set(acts) < set(term.channels):
            yield f"term {term.name!r} declares channels {list(term.channels)} and never acts but on {acts}"


def _no_more_than_needs(seen: _Seen) -> Iterator[str]:
    for condition in CONDITIONS:
        if condition not in seen.effect.needs and _changes(seen, condition):
            yield f"regressors depend on {condition}, which `needs` does not name"


def _changes(seen: _Seen, condition: Condition) -> bool:
    other = moved(seen.here, seen.there, [condition])
    return any(not np.array_equal(found, seen.ask(other, shape)) for shape, found in seen.everywhere())


def _rows(seen: _Seen) -> Iterator[str]:
    whole = seen.ask(seen.here)
    if not np.array_equal(whole, seen.ask(seen.here)):
        yield "the same question has two answers"
        return
    if getattr(seen.effect, "history", False):
        return  # what came before a row is part of its conditions
    some = seen.rng.permutation(ROWS)[: ROWS // 3]
    if not _same(seen.ask(seen.here.at(some)), whole[some]):
        yield "rows know of each other: fewer rows, or in another order, give other regressors"


def _same(a: Array, b: Array) -> bool:
    return bool(np.abs(a - b).max(initial=0.0) <= SAME * np.abs(b).max(initial=0.0))


def _left_alone(seen: _Seen) -> Iterator[str]:
    before = seen.here.at(np.arange(ROWS))
    first = seen.ask(seen.here)
    kept = first.copy()
    if first.flags.writeable:
        first[:] = 7.0
    if not np.array_equal(seen.ask(seen.here), kept):
        yield "the answer is not the caller's own: writing into it changes the next"
    if any(
        not np.array_equal(getattr(seen.here, f.name), getattr(before, f.name)) for f in fields(Conditions)
    ):
        yield "regressors change the conditions that they were asked about"


def _defaults(seen: _Seen) -> Iterator[str]:
    usual = {p.name: p.default for p in seen.effect.parameters}
    nothing: tuple[Shape | None, ...] = (None, {})
    whole = seen.ask(seen.here, usual)
    if not all(np.array_equal(whole, seen.ask(seen.here, left)) for left in nothing):
        yield "parameters that are left out are not at their defaults"
    for p in seen.effect.parameters:
        alone = {p.name: seen.shapes[-1][p.name]}
        if not np.array_equal(seen.ask(seen.here, alone), seen.ask(seen.here, {**usual, **alone})):
            yield f"with {p.name} alone given, the others are not at their defaults"


def _group(seen: _Seen) -> Iterator[str]:
    """κ and M multiply the input: without one they add nothing."""
    sensed: Condition = "rate" if seen.sensor == "gyro" else "specific_force"
    nothing = Conditions(**{f.name: np.zeros_like(getattr(seen.here, f.name)) for f in fields(Conditions)})
    if seen.effect.group != "bias" and np.any(seen.ask(moved(seen.here, nothing, [sensed])) != 0.0):
        yield f"an effect of group {seen.effect.group} adds nothing at zero input; this one is a bias there"


def _slopes(seen: _Seen) -> Iterator[str]:
    """A fit goes along the derivative of each parameter, as it is carried."""
    for p in seen.effect.parameters:
        rough, any_change = 0.0, False
        for shape in seen.shapes:
            wide, narrow = (_slope(seen, p, shape, step) for step in (STEP, STEP / 2.0))
            scale = max(float(np.abs(narrow).max()), 1e-300)
            rough = max(rough, float(np.mean(np.abs(wide - narrow) > 0.05 * scale)))
            any_change |= not np.array_equal(seen.ask(seen.here, shape), _at_other_end(seen, p, shape))
        if rough > 1.0 - SMOOTH:
            yield f"the derivative with respect to {p.name} does not exist in {rough:.0%} of the rows"
        if not any_change:
            yield f"parameter {p.name} changes nothing"


def _slope(seen: _Seen, p: Parameter, shape: Shape, step: float) -> Array:
    """Central difference per unit of what a fit carries, within the range."""
    low, high = p.bounds
    half = step * (high - low)
    middle = min(max(p.carried(shape[p.name]), low + half), high - half)
    up, down = (seen.ask(seen.here, {**shape, p.name: p.value(middle + s * half)}) for s in (1.0, -1.0))
    return np.asarray((up - down) / (2.0 * half))


def _at_other_end(seen: _Seen, p: Parameter, shape: Shape) -> Array:
    end = p.high if shape[p.name] < p.value(sum(p.bounds) / 2.0) else p.low
    return seen.ask(seen.here, {**shape, p.name: end})


def _idle_needs(effect: Effect, seed: int) -> list[str]:
    """Conditions that it declares and that move it on none of its sensors."""
    every = [_Seen(effect, sensor, np.random.default_rng(seed)) for sensor in effect.sensors]
    try:
        idle = [c for c in CONDITIONS if c in effect.needs and not any(_changes(s, c) for s in every)]
    except Exception:  # said already, sensor by sensor
        return []
    return [f"`needs` names {condition}, and nothing depends on it" for condition in idle]


def _at(shape: Shape) -> str:
    return " at " + ", ".join(f"{name} {value:.4g}" for name, value in shape.items()) if shape else ""
