"""What a sweep answers: where the knee of the curve is, and which point is the cheapest for each limit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from planner.report.blocks import Table
from planner.report.numbers import hours
from planner.units import UnitError, from_si, parse, to_degc, to_si

Document = Mapping[str, Any]
LEAST_BEND = 0.05  # of the rectangle about the curve; what bends less is called straight


@dataclass(frozen=True)
class Cheapest:
    """Of all points with one value of a key the shortest campaign. x: in the key's unit; text: as written."""

    x: float
    text: str
    time_s: float
    point: Document


def unit_of(sweep: Document, key: str) -> str:
    """The unit in which the values of a key are compared: that of the first that has one."""
    units = (_unit(p["values"][key]) for p in sweep["points"])
    return next((unit for unit in units if unit), "")


def _unit(value: Any) -> str:
    try:
        to_degc(value)
    except UnitError:
        try:
            return parse(value).unit
        except UnitError:
            return ""
    return "degC"


def number_of(value: Any, unit: str) -> float | None:
    """`0.5 km` in m is 500; None for a word, and for a value of another dimension."""
    try:
        return to_degc(value) if unit == "degC" else from_si(to_si(value, unit), unit)
    except UnitError:
        return None


def numbers_of(sweep: Document, key: str) -> list[float | None]:
    """The number of every point in the key's unit."""
    unit = unit_of(sweep, key)
    return [number_of(p["values"][key], unit) for p in sweep["points"]]


def abscissa(sweep: Document) -> str | None:
    """The key with the most different numbers; the first of equals."""
    counts = {key: len({*numbers_of(sweep, key)} - {None}) for key in sweep["keys"]}
    best = max(counts, key=lambda key: counts[key], default=None)
    return best if best is not None and counts[best] >= 2 else None


def cheapest_of(sweep: Document, key: str) -> list[Cheapest]:
    """The shortest campaign for each value of a key that has a plan, in the order of the values."""
    best: dict[float, Cheapest] = {}
    for p, x in zip(sweep["points"], numbers_of(sweep, key), strict=True):
        if p["status"] != "planned" or x is None:
            continue
        if x not in best or p["time_s"] < best[x].time_s:
            best[x] = Cheapest(x, str(p["values"][key]), p["time_s"], p)
    return [best[x] for x in sorted(best)]


def knee(curve: Sequence[Cheapest]) -> int | None:
    """Index of the point that lies furthest below the chord from end to end, both axes scaled to 1.

    There the curve turns from dear to cheap (Satopää and others, 2011: Finding a "Kneedle" in a haystack).
    None for fewer than three points, and where nothing lies LEAST_BEND below the chord.
    """
    if len(curve) < 3:
        return None
    times = [point.time_s for point in curve]
    span, height = curve[-1].x - curve[0].x, max(times) - min(times)
    if height <= 0:
        return None
    chord = [times[0] + (times[-1] - times[0]) * (point.x - curve[0].x) / span for point in curve]
    below = [(line - time) / height for line, time in zip(chord, times, strict=True)]
    best = max(range(len(curve)), key=below.__getitem__)
    return best if below[best] >= LEAST_BEND else None


def knee_words(curve: Sequence[Cheapest], at: int, key: str) -> str:
    """The knee, and what the next points on either side cost or save."""
    here = curve[at]
    beside = [curve[i] for i in (at - 1, at + 1) if 0 <= i < len(curve)]
    told = ", ".join(
        f"{point.text} {'costs' if point.time_s > here.time_s else 'saves'} "
        f"{hours(abs(point.time_s - here.time_s))} h{' more' if point.time_s > here.time_s else ''}"
        for point in beside
        if point.time_s != here.time_s
    )
    return f"The knee is at {key} {here.text}, {hours(here.time_s)} h{f': {told}' if told else ''}."


def cheapest_table(sweep: Document, curve: Sequence[Cheapest], key: str) -> Table | None:
    """The cheapest point of each value, and what the other keys are there; None where there is one key."""
    others = [k for k in sweep["keys"] if k != key]
    if not others:
        return None
    rows = tuple((c.text, hours(c.time_s), *(str(c.point["values"][k]) for k in others)) for c in curve)
    return Table(f"The cheapest point of each {key}", (key, "hours", *others), rows)
