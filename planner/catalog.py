"""Finds the plug-ins: ours, one module each, and those that installed packages offer by entry points.

A package offers an effect by a line of its own `pyproject.toml`, and nothing here knows of it before:

    [project.entry-points."planner.effects"]
    self_heating = "their_package.self_heating:EFFECT"

Groups: `planner.effects`, `planner.trajectories`, `planner.benches`, `planner.readers`, `planner.exports`.
Names are read without importing anything; a plug-in is imported when it is asked for by its name, and all of
them when somebody goes through them (the diagnosis, `planner effects`). Whatever is wrong with one is an
InputError where it is needed, and a line of `unloadable` otherwise.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import importlib.util
import inspect
import keyword
import pkgutil
from collections.abc import Callable, Collection, ItemsView, Iterator, Mapping, ValuesView
from dataclasses import dataclass
from functools import cache
from typing import Any, Generic, TypeVar, get_args

from planner import __version__
from planner.errors import InputError
from planner.nouns.sensor import SENSORS
from planner.origin import OURS, Kind, Origin
from planner.protocols import (
    BenchKind,
    Effect,
    ExportFormat,
    Parameter,
    RawReader,
    Sensor,
    Term,
    TrajectoryFamily,
)

T = TypeVar("T")
KINDS: tuple[Kind, ...] = get_args(Kind)


@dataclass(frozen=True)
class _Shelf:
    """Where plug-ins of one kind stand with us, what they offer themselves by, and what they must be."""

    package: str
    constant: str
    protocol: type


_SHELVES: Mapping[Kind, _Shelf] = {
    "effects": _Shelf("planner.effects", "EFFECT", Effect),
    "trajectories": _Shelf("planner.trajectories", "FAMILY", TrajectoryFamily),
    "benches": _Shelf("planner.benches", "KIND", BenchKind),
    "readers": _Shelf("planner.readers", "READER", RawReader),
    "exports": _Shelf("planner.export.formats", "FORMAT", ExportFormat),
}


@dataclass(frozen=True)
class Unloadable:
    """An offered plug-in that cannot be used, and why."""

    origin: Origin
    reason: str

    def __str__(self) -> str:
        return (
            f"the {self.origin} ({self.origin.target}) cannot be used: {self.reason}; "
            "mend or uninstall that package"
        )


class Plugins(Mapping[str, T], Generic[T]):
    """The plug-ins of one kind by name, in the order of the names; each is imported when it is asked for.

    Effects that a name describes (_DESCRIBED) can be asked for and are in no list.
    Names, `in` and `len` import nothing. `items` and `values` import all and pass over those that do not
    load: `unloadable` tells which. Asking for one of those raises InputError.
    """

    def __init__(self, kind: Kind) -> None:
        self._kind = kind

    def __getitem__(self, name: str) -> T:
        if name not in self:
            raise KeyError(name)
        if name not in origins(self._kind):
            return _described(name)  # type: ignore[no-any-return]  # an effect, as only that kind has such
        found, reason = _loaded(self._kind, name)
        if reason:
            raise InputError(str(Unloadable(origins(self._kind)[name], reason)))
        return found  # type: ignore[no-any-return]  # what a plug-in of this kind is, only the caller's T says

    def __iter__(self) -> Iterator[str]:
        return iter(origins(self._kind))

    def __len__(self) -> int:
        return len(origins(self._kind))

    def __contains__(self, name: object) -> bool:
        return name in origins(self._kind) or (self._kind == "effects" and _described(name) is not None)

    def items(self) -> ItemsView[str, T]:
        """Name and plug-in of all that load."""
        return ItemsView(self._all())

    def values(self) -> ValuesView[T]:
        """All plug-ins that load."""
        return ValuesView(self._all())

    def _all(self) -> Mapping[str, T]:
        found = ((name, _loaded(self._kind, name)) for name in self)
        return {name: plugin for name, (plugin, reason) in found if not reason}


@cache
def effects() -> Mapping[str, Effect]:
    """All effects by name."""
    return Plugins("effects")


@cache
def trajectories() -> Mapping[str, TrajectoryFamily]:
    """All trajectory families by name."""
    return Plugins("trajectories")


@cache
def benches() -> Mapping[str, BenchKind]:
    """All kinds of bench by name."""
    return Plugins("benches")


@cache
def exports() -> Mapping[str, ExportFormat]:
    """All export formats by name."""
    return Plugins("exports")


@cache
def readers() -> Mapping[str, RawReader]:
    """All formats of raw recordings by name."""
    return Plugins("readers")


def origin_of(effect: str) -> Origin:
    """Where an effect comes from; one that its name describes, from where that is of which it is made."""
    known, made = origins("effects"), effects()[effect]
    plain = getattr(made, "plain", made).name
    return known.get(plain) or Origin("effects", effect, OURS, __version__, type(made).__module__)


def temperature_effects(effect: str) -> tuple[str, ...]:
    """Names of the effects that are the change of this one over temperature."""
    return tuple(name for name, one in effects().items() if one.temperature_of == effect)


def changes_with_temperature(effect: Effect) -> bool:
    """Whether a soaked unit has other errors when it is warmer by the effect's own equation.

    What follows the rate of temperature adds nothing to a unit that is soaked, and of an effect that has a
    table over temperature the table says what temperature makes.
    """
    needs = effect.needs
    return not effect.tabled and "temperature_degc" in needs and "temperature_rate" not in needs


def varies_as_declared(effect: str, declared: Collection[str]) -> bool:
    """Whether the declared effects say how this one changes over temperature, or none there is does."""
    known = effects()
    if any(known[name].temperature_of == effect for name in declared if name in known):
        return True
    return not temperature_effects(effect)


_DESCRIBED = {
    "curve_": ("planner.effects._measured_curve", "curve_of"),
    "scatter_over_input_": ("planner.effects._scatter_over_input", "scatter_of"),
    "_of_gyro": ("planner.effects._shaped", "shaped_of"),
    "_of_acc": ("planner.effects._shaped", "shaped_of"),
}
"""Part of a name -> module and function that make the effect of it."""


def _described(name: object) -> Any:
    """The effect that a name describes, None where it describes none."""
    for part, (module, function) in _DESCRIBED.items():
        if isinstance(name, str) and part in name:
            found = getattr(importlib.import_module(module), function)(name)
            if found is not None:
                return found
    return None


def unloadable(*kinds: Kind) -> list[Unloadable]:
    """Every plug-in, of these kinds or of all, that is offered and cannot be used; imports them all."""
    return [
        Unloadable(origin, reason)
        for kind in kinds or KINDS
        for name, origin in origins(kind).items()
        for reason in [_loaded(kind, name)[1]]
        if reason
    ]


def wrong_with(kind: Kind, name: str) -> str:
    """Why the plug-in of that name cannot be used, in a sentence; empty when it can, or is not there."""
    if name not in origins(kind):
        return ""
    reason = _loaded(kind, name)[1]
    return str(Unloadable(origins(kind)[name], reason)) if reason else ""


def forget() -> None:
    """Look again at what is installed, the next time that somebody asks."""
    _installed.cache_clear()
    origins.cache_clear()
    _loaded.cache_clear()


# ---------------------------------------------------------------- names, without importing


@cache
def origins(kind: Kind) -> Mapping[str, Origin]:
    """Name -> where it comes from, of all plug-ins of one kind, in the order of the names.

    Raises InputError for two of one name.
    """
    from planner import __version__

    shelf = _SHELVES[kind]
    found = {
        name: Origin(kind, name, OURS, __version__, f"{shelf.package}.{name}:{shelf.constant}")
        for name in modules(shelf.package)
    }
    for entry in sorted(_installed().select(group=f"planner.{kind}"), key=lambda e: e.name):
        here = Origin(kind, entry.name, *_distribution(entry), entry.value)
        there = found.setdefault(entry.name, here)
        if there is not here:
            raise InputError(
                f"two plug-ins of one name: the {there} ({there.target}) and the {here} ({here.target}); "
                "uninstall one of the packages, or rename its plug-in"
            )
    return dict(sorted(found.items()))


@cache
def _installed() -> importlib.metadata.EntryPoints:
    """What all installed packages offer; to look takes 10 ms, which once is enough."""
    every: Any = importlib.metadata.entry_points  # its type is that of Python before 3.12
    found: importlib.metadata.EntryPoints = every()
    return found


def modules(package: str) -> tuple[str, ...]:
    """Names of the modules of a package of ours; those with an underscore are shared machinery."""
    spec = importlib.util.find_spec(package)
    places = spec.submodule_search_locations if spec is not None else None
    names = (info.name for info in pkgutil.iter_modules(places or ()))
    return tuple(sorted(name for name in names if not name.startswith("_")))


def _distribution(entry: importlib.metadata.EntryPoint) -> tuple[str, str]:
    """Name and version; a package without proper metadata has neither."""
    metadata = None if entry.dist is None else entry.dist.metadata
    return (str(metadata["Name"] or "unnamed"), str(metadata["Version"] or "?")) if metadata else ("?", "?")


# ---------------------------------------------------------------- one plug-in


def plugins(package: str, constant: str) -> dict[str, Any]:
    """What every module of a package of ours offers by `constant`, by name; imports them all."""
    return {
        name: getattr(importlib.import_module(f"{package}.{name}"), constant) for name in modules(package)
    }


@cache
def _loaded(kind: Kind, name: str) -> tuple[Any, str]:
    """The plug-in, or why it cannot be used. Nobody else's fault may end the program here."""
    try:
        found = _imported(origins(kind)[name].target)
        wrong = faults_of(found, kind, name)
    except (Exception, SystemExit) as error:
        return None, f"{type(error).__name__}: {error}"
    return (None, "; ".join(wrong)) if wrong else (found, "")


def _imported(target: str) -> Any:
    """What stands at `package.module:OBJECT`."""
    module, _, path = target.partition(":")
    found: Any = importlib.import_module(module.strip())
    for part in filter(None, path.split("[")[0].strip().split(".")):
        found = getattr(found, part)
    return found


def faults_of(plugin: object, kind: Kind, name: str) -> list[str]:
    """What is wrong with the shape of a plug-in, compared with its protocol; empty when nothing is."""
    if isinstance(plugin, type):
        return [f"it is the class {plugin.__name__}; offer an instance, {plugin.__name__}()"]
    lacks = _lacks(plugin, _SHELVES[kind].protocol)
    own = getattr(plugin, "name", name)
    wrong = [f"it lacks {', '.join(lacks)}"] if lacks else []
    if kind == "effects" and "parameters" in lacks and hasattr(plugin, "nonlinear"):
        wrong.append(
            "`nonlinear` no longer says its parameters; declare e.g. parameters = "
            '(Parameter("time_constant", "s", 600.0, low=30.0, high=12000.0),)'
        )
    if own != name:
        wrong.append(f"it calls itself {own!r} and is offered as {name!r}")
    if kind == "effects" and (not name.isidentifier() or keyword.iskeyword(name) or name in SENSORS):
        wrong.append(f"{name!r} is no name of an effect; write letters, digits and underscores")
    if not wrong:
        wrong = _wrong_calls(plugin, _SHELVES[kind].protocol)
    return wrong or (_effect_faults(plugin) if isinstance(plugin, Effect) and kind == "effects" else [])


def _lacks(plugin: object, protocol: type) -> list[str]:
    """Members of the protocol that are not there."""
    members = {*inspect.get_annotations(protocol), *(m for m in vars(protocol) if not m.startswith("_"))}
    return sorted(member for member in members if not hasattr(plugin, member))


def _wrong_calls(plugin: object, protocol: type) -> list[str]:
    """Methods that cannot be called as the protocol calls them."""
    found = []
    for name, asked in vars(protocol).items():
        if name.startswith("_") or not inspect.isfunction(asked):
            continue
        wanted = list(inspect.signature(asked).parameters.values())[1:]  # without self
        try:
            _try_call(getattr(plugin, name), wanted)
        except (TypeError, ValueError):
            found.append(f"its {name} must be callable as {name}({', '.join(p.name for p in wanted)})")
    return found


def _try_call(method: Callable[..., Any], wanted: list[inspect.Parameter]) -> None:
    """Raises TypeError when a method does not take these arguments."""
    named = {p.name: None for p in wanted if p.kind is p.KEYWORD_ONLY}
    inspect.signature(method).bind(*(None for p in wanted if p.name not in named), **named)


def _effect_faults(effect: Effect) -> list[str]:
    """What an effect declares of itself, as far as that shows without asking for regressors."""
    wrong = []
    if not all(isinstance(p, Parameter) for p in effect.parameters):
        wrong.append("its parameters must be planner.effects.Parameter")
    strange: list[Sensor] = [s for s in effect.sensors if s not in SENSORS]
    if strange or not effect.sensors:
        wrong.append(f"its sensors must be some of {', '.join(SENSORS)}")
        return wrong
    if not all(isinstance(t, Term) for s in effect.sensors for t in effect.terms(s)):
        wrong.append("its terms must be planner.effects.Term, which say their channels")
    if set(effect.units) != set(effect.sensors):
        wrong.append("its units must name the unit on each of its sensors and no other")
    return wrong
