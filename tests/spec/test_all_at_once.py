"""Every fault is told at once: what is told of each break alone is told of several together."""

from __future__ import annotations

import copy
import json
import random
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from planner.errors import InputError
from planner.spec.load import spec_from_bytes
from planner.spec.yaml12 import Path as Place
from planner.spec.yaml12 import read_yaml, shown
from tests.spec.example import changed, faults, place

SPECS = sorted((Path(__file__).parents[2] / "requirements_specs").glob("*.yaml"))
VALUES: dict[str, Any] = {
    "other_unit": "3 kg",
    "list": [[[1]]],
    "nothing": None,
    "word": "zzword",
    "share": "195 %",
    "negative": -7,
    "mapping": {"q": {"q": 1}},
}
KEYS = ("unknown_key", "key_twice")
AGAIN = "@again"
SEEDS = range(24)


def test_percentile_bench_unknown_key_and_a_key_twice() -> None:
    """Four faults of four stages: a form, a contradiction, a key that nobody knows, and YAML itself."""
    text = changed(
        ("rule: worst_case", "rule: {percentile: 195 %}"),
        (
            "rates:      {bench: rate_table, calibrates: gyro.scale_factor, motions: 30,",
            "rates: {bench: rate_tabel, calibrates: gyro.scale_factor, calibrates: gyro.bias, motion: 30,",
        ),
    )
    assert [(fault.path, fault.code) for fault in faults(text)] == [
        ("requirement[0].rule.percentile", "P108"),
        ("tests.rates.bench", "P411"),
        ("tests.rates.calibrates", "P004"),
        ("tests.rates.motion", "P101"),
    ]
    assert faults(text)[2].column == place(text, "calibrates: gyro.bias, motion")[1]


def test_a_misspelt_key_draws_no_fault_of_what_it_was_to_say() -> None:
    """`chambr` is an unknown key; that the bench has no chamber, is not said."""
    for old, new in (
        ("chamber: {range", "chambr: {range"),
        ("run_to_run: 0.002 deg/s", "run_to_rum: 0.002 deg/s"),
    ):
        (fault,) = faults(changed((old, new)))
        assert fault.code == "P101"


def places(value: Any, path: Place = ()) -> Iterator[Place]:
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from places(item, (*path, key))


def at(tree: Any, path: Place) -> Any:
    for part in path:
        tree = tree[part]
    return tree


def break_at(tree: Any, path: Place, kind: str) -> None:
    if kind in VALUES:
        at(tree, path[:-1])[path[-1]] = VALUES[kind]
        return
    mapping = at(tree, path)
    key = next(iter(mapping))
    mapping["zz_unknown" if kind == "unknown_key" else f"{key}{AGAIN}"] = mapping[key]


def told(tree: Any) -> set[tuple[str, str]]:
    """(place, code) of all faults of a tree written as YAML."""
    text = re.sub(r'"(-?\d+(?:@again)?)":', r"\1:", json.dumps(tree, indent=1)).replace(AGAIN, "")
    try:
        spec_from_bytes(text.encode(), SPECS[0].parent / "broken.yaml")
    except InputError as refusal:
        return {(fault.path, fault.code) for fault in refusal.faults}
    return set()


def breaks(tree: Any, chance: random.Random) -> list[tuple[Place, str]]:
    """Two to four breaks that do not touch each other.

    None lies in another, no two are entries of one table, which are compared with one another, and the
    trajectory keeps its name, which says what its parameters are.
    """
    known, chosen = list(places(tree)), list[tuple[Place, str]]()
    most = chance.choice([2, 3, 4])
    while len(chosen) < most:
        path, kind = chance.choice(known), chance.choice([*VALUES, *KEYS])
        mapping = isinstance(at(tree, path), dict)
        if (kind in KEYS and not mapping) or len(path) < 2 or path[:2] == ("trajectory", "name"):
            continue
        table = [one[:-1] for one, _ in chosen if isinstance(one[-1], int) or re.match(r"-?\d", str(one[-1]))]
        inside = any(path[: len(one)] == one or one[: len(path)] == path for one, _ in chosen)
        if not inside and path[:-1] not in table:
            chosen.append((path, kind))
    return chosen


@pytest.mark.parametrize("seed", SEEDS)
def test_what_is_told_of_each_break_alone_is_told_of_all_together(seed: int) -> None:
    chance = random.Random(seed)
    spec = chance.choice(SPECS)
    tree = read_yaml(spec.read_bytes(), spec.name).value
    chosen = breaks(tree, chance)
    together = copy.deepcopy(tree)
    for path, kind in chosen:
        break_at(together, path, kind)
    found = told(together)
    for path, kind in chosen:
        alone = copy.deepcopy(tree)
        break_at(alone, path, kind)
        own = {(where, code) for where, code in told(alone) if where.startswith(shown(path))}
        assert own <= found, f"{spec.name}: {own - found} of {kind} at {shown(path)} beside {chosen}"
