"""Which plug-ins a spec names: what cannot be used is a fault, what is not ours goes into the plan."""

from __future__ import annotations

from collections.abc import Iterator

from planner import catalog
from planner.origin import Kind, Origin
from planner.protocols import SENSORS
from planner.spec.model import Spec
from planner.spec.review import Review
from planner.spec.yaml12 import Path


def plugins_load(sheet: Review) -> bool:
    """Note every plug-in that the spec names and that cannot be used; whether there are none."""
    sound = True
    for path, kind, name in named(sheet.spec):
        wrong = catalog.wrong_with(kind, name)
        if wrong:
            sound = False
            sheet.fault("P244", path, wrong)
    return sound


def foreign_plugins(spec: Spec) -> tuple[Origin, ...]:
    """The plug-ins of other packages that the spec names, each once, by kind and name."""
    used = {(kind, name) for _, kind, name in named(spec)}
    origins = (_origin(kind, name) for kind, name in sorted(used))
    return tuple(dict.fromkeys(origin for origin in origins if origin is not None and origin.foreign))


def _origin(kind: Kind, name: str) -> Origin | None:
    if kind == "effects" and name in catalog.effects():
        return catalog.origin_of(name)
    return catalog.origins(kind).get(name)


def named(spec: Spec) -> Iterator[tuple[Path, Kind, str]]:
    """(place, kind, name) of everything that the spec calls by a plug-in's name."""
    for index, name in enumerate(spec.effects):
        yield ("effects", index), "effects", name
    for sensor in SENSORS:
        for name in getattr(spec.unit, sensor):
            yield ("unit", sensor, name), "effects", name
    flight = spec.trajectory
    if isinstance(flight, str):
        yield ("trajectory",), "trajectories", flight
    elif isinstance(flight, dict) and isinstance(flight.get("name"), str):
        yield ("trajectory", "name"), "trajectories", flight["name"]
    for name, bench in spec.benches.items():
        path: Path = ("benches", name) if bench.kind is None else ("benches", name, "kind")
        yield path, "benches", bench.kind or name
