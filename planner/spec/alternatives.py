"""Choices that a test leaves open: benches, the length of its records, its motions.

    tests: {static: {bench: [rate_table, table_2], record: [60 s, 5 min], motions: [6, 12], …}}

Every combination becomes a test of its own, so that the planner decides as it decides among tests: how often
each is made, or not at all. The first combination keeps the name, the others add what is other in them
(`static-table_2`). Of a range of lengths both ends and their geometric mean are on offer.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from typing import Any

from planner.errors import Fault
from planner.spec.places import fault_at
from planner.spec.yaml12 import Document, Path
from planner.units import UnitError, parse

MOST = 12  # combinations of one test
LONGEST_NAME = 40
Way = tuple[str, Any, Path]  # what the name adds, the value, where it stands below the test


def with_alternatives(document: Document) -> tuple[Document, list[Fault]]:
    """The document with a test for every combination, and what is wrong with the choices."""
    tests = document.value.get("tests") if isinstance(document.value, dict) else None
    if not isinstance(tests, dict):
        return document, []
    faults: list[Fault] = []
    expanded: dict[Any, Any] = {}
    places = dict(document.values), dict(document.keys)
    for name, test in tests.items():
        expanded[name] = test
        choices = _choices(test) if isinstance(test, dict) and isinstance(name, str) else {}
        if not choices:
            continue
        unused = _is_unused(document, name, test)
        wrong = [] if unused else _wrong(document, name, test, choices)
        faults += [fault_at(document, "P423", ("tests", name, key), said) for key, said in wrong]
        every = product(*choices.values())
        for combination in [next(every)] if wrong or unused else every:
            added = "".join(f"-{way[0]}" for way in combination if way[0])
            own = (name + added)[:LONGEST_NAME]
            chosen = dict(zip(choices, combination, strict=True))
            expanded[own] = copy.deepcopy(test) | {key: way[1] for key, way in chosen.items()}
            _place(places, name, own, chosen)
    value = document.value | {"tests": expanded}
    return replace(document, value=value, values=places[0], keys=places[1]), faults


def _choices(test: Mapping[Any, Any]) -> dict[str, list[Way]]:
    """Key -> its ways, of the keys that leave one open."""
    found = {"bench": _benches(test.get("bench")), "record": _records(test.get("record"))}
    found["motions"] = _motions(test.get("motions"))
    return {key: ways for key, ways in found.items() if ways}


def _benches(written: Any) -> list[Way]:
    if not isinstance(written, list) or not written or not all(isinstance(b, str) for b in written):
        return []
    return [(_word(b) if i else "", b, ("bench", i)) for i, b in enumerate(written)]


def _records(written: Any) -> list[Way]:
    if not isinstance(written, list) or len(written) != 2:
        return []
    try:
        low, high = (parse(one).si for one in written)
    except UnitError:
        return []
    if not 0.0 < low < high:
        return []
    middle = f"{(low * high) ** 0.5:.6g} s"
    lengths = [(written[0], 0), (middle, 0), (written[1], 1)]
    return [(_word(str(t)) if i else "", t, ("record", place)) for i, (t, place) in enumerate(lengths)]


def _motions(written: Any) -> list[Way]:
    if not isinstance(written, list) or len(written) < 2:
        return []
    if not (all(isinstance(m, list) for m in written) or all(type(m) is int for m in written)):
        return []
    return [(f"motions_{i + 1}" if i else "", m, ("motions", i)) for i, m in enumerate(written)]


def _word(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9_]+", "", text.replace(".", "_"))


def _is_unused(document: Document, name: str, test: Mapping[Any, Any]) -> bool:
    """Whether hands fix the test at 0 repeats, so that none of its choices is made."""
    plan = document.value.get("plan")
    fixed = plan.get("fixed") if isinstance(plan, dict) else None
    by_hand = fixed.get(name) if isinstance(fixed, dict) else None
    said = by_hand if isinstance(by_hand, dict) else {}
    return any(
        type(value) is int and value == 0
        for value in (said.get("repeats", test.get("repeats")), said.get("temperatures"))
    )


def _wrong(
    document: Document, name: str, test: Mapping[Any, Any], choices: Mapping[str, list[Way]]
) -> list[tuple[str, str]]:
    """(key, what is wrong) of choices that nobody can make."""
    plan = document.value.get("plan")
    fixed = plan.get("fixed") if isinstance(plan, dict) else None
    by_hand = isinstance(fixed, dict) and name in fixed
    if by_hand or "repeats" in test:
        said = "leaves a choice, but the test is fixed by hand; write the one that is made"
        return [(key, said) for key in choices]
    count = 1
    for ways in choices.values():
        count *= len(ways)
    if count > MOST:
        said = f"makes {count} combinations with the other choices; at most {MOST} can be"
        return [(next(iter(choices)), said)]
    return []


def _place(
    places: tuple[dict[Path, Any], dict[Path, Any]], name: str, own: str, chosen: Mapping[str, Way]
) -> None:
    """Where the parts of a combination stand: where those of its test do."""
    for known in places:
        root = ("tests", name)
        mine = {path: at for path, at in known.items() if path[:2] == root}
        for path, at in mine.items():
            if path[2:3] and path[2] in chosen:
                below = chosen[str(path[2])][2]
                if path[2 : 2 + len(below)] != below:
                    continue
                known["tests", own, str(path[2]), *path[2 + len(below) :]] = at
            else:
                known["tests", own, *path[2:]] = at
