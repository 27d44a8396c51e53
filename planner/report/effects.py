"""The effects on the terminal: what each adds, its terms, units and parameters, and where it comes from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console


def print_effects(documents: Sequence[Mapping[str, Any]], console: Console) -> None:
    """Print each effect as a paragraph."""
    for document in documents:
        name, title = document["name"], document["title"]
        console.print(f"[bold]{name}[/bold]: {title}" if title != name else f"[bold]{name}[/bold]")
        for line in _lines(document):
            console.print(f"    {line}", markup=False)


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
