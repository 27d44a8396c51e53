"""What `--vary` says: a key of the spec and its values; and the specs of the grid that they span."""

from __future__ import annotations

import copy
import hashlib
import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import yaml

from planner.errors import InputError

MOST_POINTS = 10_000
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_RANGE = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*\.\.\s*({_NUMBER})\s*(.*?)\s*")
_VALUE = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*")


@dataclass(frozen=True)
class Variation:
    """A key such as `requirement.0.limit`, and its values as a spec would write them."""

    key: str
    values: tuple[Any, ...]


@dataclass(frozen=True)
class GridPoint:
    """One spec of the grid. values: key -> value; text: its YAML; digest: of the text and the version."""

    values: Mapping[str, Any]
    text: str
    digest: str


def variation(text: str, points: int) -> Variation:
    """`KEY=A..B` (evenly spaced, both ends) or `KEY=A,B,C`; a unit may stand at the end for all.

    Raises InputError for anything else.
    """
    key, equals, said = text.partition("=")
    if not equals or not key.strip() or not said.strip():
        raise InputError(f"--vary {text!r}: write KEY=A..B or KEY=A,B,C, e.g. requirement.0.limit=5..50m")
    found = _RANGE.fullmatch(said)
    if found:
        return Variation(key.strip(), _between(text, (found[1], found[2], found[3], found[4]), points))
    if ".." in said:
        raise InputError(f"--vary {text!r}: A and B must be numbers with a unit, e.g. 5..50m")
    return Variation(key.strip(), _listed([part.strip() for part in said.split(",")], text))


def _between(text: str, ends: tuple[str, str, str, str], points: int) -> tuple[Any, ...]:
    low, low_unit, high, high_unit = ends
    unit = high_unit or low_unit
    if low_unit and low_unit != high_unit:
        raise InputError(f"--vary {text!r}: both ends must have one unit, not {low_unit!r} and {high_unit!r}")
    a, b = float(low), float(high)
    whole = all(re.fullmatch(r"[+-]?\d+", x) for x in (low, high)) and not unit
    values = np.linspace(a, b, points) if points > 1 else np.array([a])
    if whole:
        values = np.unique(np.rint(values))
    return tuple(_value(f"{x:.10g}", unit) for x in values)


def _listed(parts: Sequence[str], text: str) -> tuple[Any, ...]:
    if any(not part for part in parts):
        raise InputError(f"--vary {text!r}: a value is missing between commas")
    last = _VALUE.fullmatch(parts[-1])
    unit = last[2] if last else ""
    found = []
    for part in parts:
        match = _VALUE.fullmatch(part)
        found.append(_value(match[1], match[2] or unit) if match else part)
    return tuple(dict.fromkeys(found))


def _value(number: str, unit: str) -> Any:
    """As YAML would read it."""
    if unit:
        return f"{number} {unit}"
    return int(number) if re.fullmatch(r"[+-]?\d+", number) else float(number)


# ---------------------------------------------------------------- the grid


def grid(tree: Mapping[str, Any], variations: Sequence[Variation], version: str) -> list[GridPoint]:
    """Every combination of values put into the spec's tree, the last key fastest.

    Raises InputError for a key that leads nowhere, and for too many points.
    """
    count = int(np.prod([len(v.values) for v in variations]))
    if count > MOST_POINTS:
        raise InputError(
            f"{count} points are too many, the most is {MOST_POINTS}; give fewer values or --points"
        )
    keys = [v.key for v in variations]
    if len(set(keys)) < len(keys):
        raise InputError(f"--vary: {next(k for k in keys if keys.count(k) > 1)} is given twice")
    return list(_points(tree, variations, version))


def _points(tree: Mapping[str, Any], variations: Sequence[Variation], version: str) -> Iterator[GridPoint]:
    for values in itertools.product(*(v.values for v in variations)):
        changed = copy.deepcopy(dict(tree))
        named = dict(zip((v.key for v in variations), values, strict=True))
        for key, value in named.items():
            _put(changed, key, value)
        text = yaml.safe_dump(changed, sort_keys=False, allow_unicode=True)
        yield GridPoint(named, text, hashlib.sha256(f"{version}\n{text}".encode()).hexdigest())


def _put(tree: Any, key: str, value: Any) -> None:
    """Set a value in place; the part before the last must be there, so that no typing error plans nothing."""
    *path, last = key.split(".")
    at = tree
    for depth, part in enumerate(path):
        at = _part(at, part, ".".join(path[: depth + 1]))
    if isinstance(at, list):
        _part(at, last, key)
        at[int(last)] = value
    elif isinstance(at, dict):
        at[last] = value
    else:
        raise InputError(
            f"--vary {key}: {'.'.join(path)} is a single value in the spec, not a mapping or a list"
        )


def _part(at: Any, part: str, where: str) -> Any:
    if isinstance(at, list) and part.isdigit() and int(part) < len(at):
        return at[int(part)]
    if isinstance(at, dict):
        found = next((k for k in at if str(k) == part), None)
        if found is not None:
            return at[found]
        raise InputError(f"--vary: the spec has no {where}; it has {', '.join(map(str, at))} there")
    raise InputError(f"--vary: the spec has no {where}")
