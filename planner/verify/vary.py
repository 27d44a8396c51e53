"""What `--vary` says: a key of the spec and its values; and the specs of the grid that they span."""

from __future__ import annotations

import copy
import hashlib
import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, overload

import numpy as np
import yaml

from planner.errors import InputError
from planner.spec.places import did_you_mean
from planner.units import UnitError, dimension_of

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
    """One spec of the grid. values: key -> value; text: its YAML; digest: of all that its plan depends on."""

    values: Mapping[str, Any]
    text: str
    digest: str


def variation(text: str, points: int, tree: Mapping[str, Any] | None = None) -> Variation:
    """`KEY=A..B` (evenly spaced, both ends) or `KEY=A,B,C`; a unit may stand at the end for all.

    tree: of the spec; where the value there has another unit than the last of a list, the bare numbers of
    the list could have either. Raises InputError for anything else.
    """
    key, equals, said = text.partition("=")
    if not equals or not key.strip() or not said.strip():
        raise InputError(f"--vary {text!r}: write KEY=A..B or KEY=A,B,C, e.g. requirement.0.limit=5..50m")
    found = _RANGE.fullmatch(said)
    if found:
        return Variation(key.strip(), _between(text, (found[1], found[2], found[3], found[4]), points))
    if ".." in said:
        raise InputError(f"--vary {text!r}: A and B must be numbers with a unit, e.g. 5..50m")
    own = _own_unit(tree or {}, key.strip())
    return Variation(key.strip(), _listed([part.strip() for part in said.split(",")], text, own))


def _between(text: str, ends: tuple[str, str, str, str], points: int) -> tuple[Any, ...]:
    low, low_unit, high, high_unit = ends
    unit = high_unit or low_unit
    if low_unit and low_unit != high_unit:
        raise InputError(f"--vary {text!r}: both ends must have one unit, not {low_unit!r} and {high_unit!r}")
    whole = all(re.fullmatch(r"[+-]?\d+", x) for x in (low, high)) and not unit
    with np.errstate(over="ignore", invalid="ignore"):
        values = np.linspace(float(low), float(high), points) if points > 1 else np.array([float(low)])
    if not np.isfinite(values).all():
        raise InputError(f"--vary {text!r}: A and B must be numbers that can be counted with, e.g. 5..50m")
    if whole:
        values = np.rint(values)
    return tuple(dict.fromkeys(_value(f"{x:.10g}", unit) for x in values))


def _listed(parts: Sequence[str], text: str, own: str) -> tuple[Any, ...]:
    """own: the unit of the value in the spec; empty: none."""
    if any(not part for part in parts):
        raise InputError(f"--vary {text!r}: a value is missing between commas")
    matches = [_VALUE.fullmatch(part) for part in parts]
    units = list(dict.fromkeys(match[2] for match in matches if match and match[2]))
    bare = [match[1] for match in matches if match and not match[2]]
    every = [unit for unit in dict.fromkeys([*units, own]) if unit]
    possible = [unit for unit in every if units and _dimension(unit) == _dimension(units[0])]
    if bare and len(possible) > 1:
        raise InputError(_either(text, bare, possible))
    unit = matches[-1][2] if matches[-1] else ""
    found = [
        _value(match[1], match[2] or unit) if match else part
        for part, match in zip(parts, matches, strict=True)
    ]
    return tuple(dict.fromkeys(found))


def _either(text: str, bare: Sequence[str], units: Sequence[str]) -> str:
    readings = " or ".join(", ".join(f"{number} {unit}" for number in bare) for unit in units)
    return (
        f"--vary {text!r}: the unit of {', '.join(bare)} is not clear; it could be {readings}: "
        "write a unit behind every number"
    )


def _dimension(unit: str) -> str:
    try:
        return dimension_of(unit)
    except UnitError:  # the spec's reader says it, of every value
        return unit


def _own_unit(tree: Any, key: str) -> str:
    """The unit of the value that the spec has there; empty where there is none."""
    path: Sequence[str] = key.split(".")
    try:
        while path:
            here, path = _child(tree, path, key)
            tree = tree[here]
    except (InputError, LookupError):  # nothing there, or no such place, which the grid refuses
        return ""
    match = _VALUE.fullmatch(tree) if isinstance(tree, str) else None
    return match[2] if match else ""


def _value(number: str, unit: str) -> Any:
    """As YAML would read it."""
    if unit:
        return f"{number} {unit}"
    return int(number) if re.fullmatch(r"[+-]?\d{1,18}", number) else float(number)


# ---------------------------------------------------------------- the grid


@dataclass(frozen=True)
class Grid(Sequence[GridPoint]):
    """Every combination of values put into a spec's tree, the last key fastest; made when asked for.

    salt: of the digests, whatever else a plan depends on: the program's version, the flight's file.
    """

    tree: Mapping[str, Any]
    variations: tuple[Variation, ...]
    salt: str

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys that vary."""
        return tuple(v.key for v in self.variations)

    def __len__(self) -> int:
        return math.prod(len(v.values) for v in self.variations)

    @overload
    def __getitem__(self, number: int) -> GridPoint: ...
    @overload
    def __getitem__(self, number: slice) -> list[GridPoint]: ...
    def __getitem__(self, number: int | slice) -> GridPoint | list[GridPoint]:
        if isinstance(number, slice):
            return [self[i] for i in range(*number.indices(len(self)))]
        values = self.values_at(number)
        changed = copy.deepcopy(dict(self.tree))
        for key, value in values.items():
            _put(changed, key.split("."), value, key)
        return GridPoint(values, yaml_text(changed), self.digest_at(number))

    def values_at(self, number: int) -> dict[str, Any]:
        """Key -> value of a point. Raises IndexError behind the last."""
        if not 0 <= number < len(self):
            raise IndexError(number)
        found = {}
        for v in reversed(self.variations):
            number, k = divmod(number, len(v.values))
            found[v.key] = v.values[k]
        return dict(reversed(found.items()))

    def having(self, number: int, k: int) -> Iterator[int]:
        """Numbers of the points in which the key of variation `number` has its k-th value."""
        behind = math.prod(len(v.values) for v in self.variations[number + 1 :])
        all_values = behind * len(self.variations[number].values)
        for first in range(k * behind, len(self), all_values):
            yield from range(first, first + behind)

    def digest_at(self, number: int) -> str:
        """Of a point, without making its spec."""
        values = json.dumps(list(self.values_at(number).items()), ensure_ascii=False)
        return hashlib.sha256(f"{self._base}\n{values}".encode()).hexdigest()

    @cached_property
    def _base(self) -> str:
        return hashlib.sha256(f"{self.salt}\n{yaml_text(self.tree)}".encode()).hexdigest()


def grid(tree: Mapping[str, Any], variations: Sequence[Variation], salt: str) -> Grid:
    """The grid of the variations over a spec's tree.

    Raises InputError for a key that leads nowhere, one that is given twice, and for too many points.
    """
    found = Grid(tree, tuple(variations), salt)
    if len(found) > MOST_POINTS:
        raise InputError(
            f"{len(found)} points are too many, the most is {MOST_POINTS}; give fewer values or --points"
        )
    keys = found.keys
    if len(set(keys)) < len(keys):
        raise InputError(f"--vary: {next(k for k in keys if keys.count(k) > 1)} is given twice")
    found[0]  # every key leads somewhere
    return found


class _Dumper(yaml.SafeDumper):
    """Texts in quotes: YAML 1.1, which writes, leaves `1e5` bare, which YAML 1.2, which reads, counts."""


_Dumper.add_representer(
    str, lambda self, text: self.represent_scalar("tag:yaml.org,2002:str", text, style="'")
)


def yaml_text(tree: Mapping[str, Any]) -> str:
    """A spec's tree as YAML that reads back the same."""
    return yaml.dump(dict(tree), Dumper=_Dumper, sort_keys=False, allow_unicode=True)


def _put(at: Any, path: Sequence[str], value: Any, key: str) -> None:
    """Set a value in place; all before the last part must be there, so that no typing error plans nothing."""
    here, rest = _child(at, path, key)
    if rest:
        _put(at[here], rest, value, key)
    else:
        at[here] = value


def _child(at: Any, path: Sequence[str], key: str) -> tuple[Any, Sequence[str]]:
    """Which item or key the path goes to from here, and what is left of the path.

    A key may itself have points, as `gyro.bias` under `sensitivities.given`: the longest one counts.
    """
    place = ".".join(key.split(".")[: -len(path)])
    if isinstance(at, list):
        if path[0] not in map(str, range(len(at))):
            last = f" to {place}.{len(at) - 1}" if len(at) > 1 else ""
            raise InputError(f"--vary {key}: {place} is a list in the spec; its items are {place}.0{last}")
        return int(path[0]), path[1:]
    if not isinstance(at, dict):
        raise InputError(f"--vary {key}: {place} is a single value in the spec, not a mapping or a list")
    names = {str(name): name for name in at}
    for n in range(len(path), 0, -1):
        if ".".join(path[:n]) in names:
            return names[".".join(path[:n])], path[n:]
    if len(path) == 1 and path[0]:
        return path[0], ()
    where = f"{place}.{path[0]}" if place else path[0]
    raise InputError(f"--vary {key}: the spec has no {where!r}{did_you_mean(path[0], names)}")
