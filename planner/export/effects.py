"""What effects there are, as data; and the skeleton of a new one."""

from __future__ import annotations

from importlib.resources import files
from string import Template
from typing import Any

from planner import catalog
from planner.errors import InputError
from planner.nouns.sensor import Sensor
from planner.protocols import SENSORS, Effect, Parameter
from planner.spec.places import did_you_mean


def effects_document() -> dict[str, Any]:
    """Every effect that loads, and every plug-in of any kind that is offered and does not."""
    return {
        "effects": [effect_document(effect) for effect in catalog.effects().values()],
        "unloadable": [{**one.origin.document(), "reason": one.reason} for one in catalog.unloadable()],
    }


def effect_named(name: str) -> Effect:
    """One effect. Raises InputError for an unknown name, and for one that does not load."""
    if name not in catalog.effects():
        hint = did_you_mean(name, catalog.effects())
        raise InputError(f"no effect is called {name!r}{hint or '; `planner effects` lists them'}")
    return catalog.effects()[name]


def effect_document(effect: Effect) -> dict[str, Any]:
    """One effect with all that it says of itself; parameters in their own units."""
    origin = catalog.origin_of(effect.name)
    return {
        "name": effect.name,
        "title": effect.title,
        "equation": effect.equation,
        "source": effect.source,
        "group": effect.group,
        "sensors": list(effect.sensors),
        "units": dict(effect.units),
        "terms": {sensor: _terms(effect, sensor) for sensor in effect.sensors},
        "parameters": [_parameter(p) for p in effect.parameters],
        "needs": sorted(effect.needs),
        "variable": effect.variable,
        "temperature_of": effect.temperature_of,
        "tabled": effect.tabled,
        "bench_only": effect.bench_only,
        "misfit": effect.misfit,
        "from": {
            "distribution": origin.distribution,
            "version": origin.version,
            "target": origin.target,
        },
    }


def _terms(effect: Effect, sensor: Sensor) -> list[dict[str, Any]]:
    return [{"name": t.name, "channels": ["xyz"[i] for i in t.channels]} for t in effect.terms(sensor)]


def _parameter(p: Parameter) -> dict[str, Any]:
    return {
        "name": p.name,
        "unit": p.unit,
        "default": p.displayed(p.default),
        "range": [p.displayed(p.low), p.displayed(p.high)],
        "scale": p.scale,
    }


def effect_template(name: str) -> str:
    """The module of a new effect, commented, that keeps the laws as it stands.

    Raises InputError for what is no name of an effect, and for one that is there already.
    """
    if not name.isidentifier() or name != name.lower() or name.startswith("_") or name in SENSORS:
        raise InputError(
            f"--template {name!r}: write small letters, digits and underscores, e.g. self_heating"
        )
    if name in catalog.effects():
        raise InputError(
            f"--template {name}: there is the {catalog.origins('effects')[name]}; choose another name"
        )
    text = files("planner.export").joinpath("templates/effect.py.txt").read_text(encoding="utf-8")
    title = name.replace("_", " ").strip()
    return Template(text).substitute(
        name=name,
        title=title,
        Title=title.capitalize(),
        Class="".join(part.capitalize() for part in name.split("_")),
        package=f"{name.replace('_', '-')}-effect",
    )
