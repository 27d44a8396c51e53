"""The effects: what each adds, its terms, units and parameters, and where it comes from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from planner.report.blocks import Items, Report, Section


def effects_report(documents: Sequence[Mapping[str, Any]]) -> Report:
    """A paragraph for each effect."""
    return Report("Effects", "", "", sections=tuple(map(_effect, documents)))


def _effect(e: Mapping[str, Any]) -> Section:
    title = e["name"] if e["title"] == e["name"] else f"{e['name']}: {e['title']}"
    return Section(e["name"], title, (Items(tuple(_lines(e)), title),))


def _lines(e: Mapping[str, Any]) -> Iterator[str]:
    yield f"{e['equation']}   ({e['group'].replace('_', ' ')})"
    for sensor, terms in e["terms"].items():
        yield f"{sensor}: {', '.join(map(_term, terms))} in {e['units'][sensor]}"
    for p in e["parameters"]:
        low, high = p["range"]
        unit = "" if p["unit"] == "1" else f" {p['unit']}"
        yield f"parameter {p['name']}: {p['default']:g}{unit}, {low:g} … {high:g}{unit}, {p['scale']}"
    yield f"needs {', '.join(e['needs']) or 'nothing'}"
    if e["temperature_of"]:
        yield f"over temperature of {e['temperature_of']}{', carried in its table' if e['tabled'] else ''}"
    if e["bench_only"]:
        yield "of the bench or its references: it does not fly"
    if e["misfit"]:
        yield f"records do not say enough of it: {e['misfit']:.0%} of it cannot be followed"
    if e["source"]:
        yield f"source: {e['source']}"
    origin = e["from"]
    yield f"from {origin['distribution']} {origin['version']}, {origin['target']}"


def _term(term: Mapping[str, Any]) -> str:
    """`x`, or `up (on x, y, z)` where its name does not say its channel."""
    name, channels = term["name"], term["channels"]
    return name if channels == [name[:1]] else f"{name} (on {', '.join(channels)})"
