"""What a search left in plan.json, as far as it can be held against the rest of it without searching again.

Where the plan is by half-widths each point of the genetic algorithm's front uses up a limit, so no allowance
of one can change alone. By information its order can be seen here, and its campaigns are counted again
(recount_front). A price of a limit is of a requirement, and never negative. And nothing stands in the plan
that planner does not write.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from planner.nouns.plan_file import plan_schema
from planner.verify.findings import Document, Findings

_READ = ("path",)  # what the reader of the file adds
_USED_UP = 1e-6  # figures of a point have twelve digits, and are moved onto the limit by a solver


def check_keys(document: Document) -> Findings:
    """No key that plan.json does not have."""
    found = Findings("keys", "every key of plan.json is one that planner writes")
    schema = plan_schema()
    for place in _unknown({k: v for k, v in document.items() if k not in _READ}, schema, schema):
        found.fault(place, "is no key that planner writes")
    found.figures += 1
    return found


def check_front(document: Document) -> Findings:
    """The points of the genetic algorithm are of one front, and its campaign is the shortest of them."""
    found = Findings("front", "the genetic algorithm's points are of one front, on the limits of the plan")
    genetic = document.get("genetic")
    if genetic is None:
        return found
    points = genetic["front"]
    figures = [key for key in (points[0] if points else ()) if key not in ("time_s", "power_on_s")]
    if any(set(point) != set(points[0]) for point in points):
        found.fault("genetic, front", "points of different keys")
        return found
    times = [point["time_s"] for point in points]
    if times != sorted(times):
        found.fault("genetic, front", "the points are not in the order of their time")
    if document.get("method") == "information":
        _of_the_best(found, genetic["time_s"], points, document)
    else:
        _on_the_limit(found, points, figures, document)
        found.same("genetic, front", min(times, default=None), genetic["time_s"], 1e-9)
    return found


def check_prices(document: Document) -> Findings:
    """hours_per_limit: of requirements, never negative; none where the plan is by information."""
    found = Findings("hours_per_limit", "hours that a looser limit saves are of requirements, not negative")
    known = set(map(str, range(len(document["requirements"]))))
    by_information = document.get("method") == "information"
    for key, hours in document["hours_per_limit"].items():
        if key not in known or by_information:
            found.fault(f"hours_per_limit, {key}", "is of no requirement that has such a price")
        else:
            found.at_most(f"hours_per_limit, {key}", 0.0, hours, 0.0)
    return found


def _of_the_best(found: Findings, time_s: float, points: list[Document], document: Document) -> None:
    """The shortest campaign is one of the points and within the limits, and none within them is shorter.

    Where spreads are estimates a figure keeps room of its own, which a point does not tell.
    """
    meeting = [point["time_s"] for point in points if _meets(point, document)]
    if document.get("spread_factor", 1.0) == 1.0 and meeting:
        found.at_most("genetic, front", time_s, min(meeting), 1e-9)
    if not any(abs(time - time_s) <= 1e-6 * time_s for time in meeting):
        found.fault("genetic, time_s", "is that of no point within the limits")


def _meets(point: Document, document: Document) -> bool:
    return all(
        str(i) in point and point[str(i)] <= requirement["limit"] * (1 + 2e-6)
        for i, requirement in enumerate(document["requirements"])
    )


def _on_the_limit(found: Findings, points: list[Document], figures: list[str], document: Document) -> None:
    """Sum of moduli: Σ |coefficient| · allowance, of the requirement that is used most, is its limit."""
    requirements, rows = document["requirements"], document["sensitivities"]
    if any(requirement["rule"] != "worst_case" for requirement in requirements):
        return
    # a limit at any moment is used up at a moment of its own; where no search was needed none may be used up
    searched = document["genetic"]["generations"] > 0
    exact = searched and all(requirement["at"] == "end" for requirement in requirements)
    for i, point in enumerate(points):
        used = [
            sum(abs(row["value"]) * point[row["error"]] for row in rows if _is_of(row, n, figures))
            / requirement["limit"]
            for n, requirement in enumerate(requirements)
        ]
        found.at_most(f"genetic, front {i}", max(used), 1.0, _USED_UP)
        if exact:
            found.near(f"genetic, front {i}", max(used), 1.0, _USED_UP)


def _is_of(row: Document, requirement: int, figures: list[str]) -> bool:
    return row["requirement"] == requirement and row["error"] in figures


def _unknown(value: Any, schema: Mapping[str, Any], root: Mapping[str, Any], at: str = "") -> Iterator[str]:
    """Places of keys that a JSON Schema does not name."""
    schema = _resolved(value, schema, root)
    if isinstance(value, Mapping):
        names, others = schema.get("properties", {}), schema.get("additionalProperties")
        if not names and not isinstance(others, Mapping):
            return
        for key, inside in value.items():
            place = f"{at}.{key}" if at else str(key)
            if key in names:
                yield from _unknown(inside, names[key], root, place)
            elif isinstance(others, Mapping):
                yield from _unknown(inside, others, root, place)
            else:
                yield place
    elif isinstance(value, list) and isinstance(schema.get("items"), Mapping):
        for i, inside in enumerate(value):
            yield from _unknown(inside, schema["items"], root, f"{at} {i}")


def _resolved(value: Any, schema: Mapping[str, Any], root: Mapping[str, Any]) -> Mapping[str, Any]:
    """The schema behind a reference, or of the alternatives the one for such a value."""
    while "$ref" in schema:
        schema = root["$defs"][schema["$ref"].rpartition("/")[2]]
    kind = "object" if isinstance(value, Mapping) else "array" if isinstance(value, list) else ""
    for option in schema.get("anyOf", ()):
        inner = _resolved(value, option, root)
        if inner.get("type") == kind:
            return inner
    return schema
