"""Where in the file something stands, and which words would have been right there."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from planner.errors import Fault
from planner.spec.yaml12 import Document, Path, Place, shown


def fault_at(document: Document, code: str, path: Path, message: str, *, key: bool = False) -> Fault:
    """A fault at the value of a path or at its key; for what is not there, at the nearest thing around."""
    line, column = _place(document, path, key)
    return Fault(document.file, line, column, shown(path), message, code, document.line(line))


def _place(document: Document, path: Path, key: bool) -> Place:
    if path in document.values:
        return document.keys.get(path, document.values[path]) if key else document.values[path]
    for end in range(len(path) - 1, 0, -1):  # a missing key: show the key of the mapping that lacks it
        if path[:end] in document.values:
            return document.keys.get(path[:end], document.values[path[:end]])
    return document.values.get((), (1, 1))


def part_at(value: Any, path: Sequence[Any]) -> Any:
    """What stands at a path of a tree, or None."""
    for part in path:
        known = range(len(value)) if isinstance(value, list) else value if isinstance(value, dict) else ()
        if part not in known:
            return None
        value = value[part]
    return value


def did_you_mean(word: object, options: Iterable[str]) -> str:
    """`; did you mean 'confidence'?`, or the options when none is near and they are few."""
    known = sorted(set(options))
    near = nearest(word, known)
    if near:
        return f"; did you mean '{near}'?"
    return f"; expected one of {', '.join(known)}" if 0 < len(known) <= 16 else ""


def nearest(word: object, options: Iterable[str]) -> str | None:
    """The word that was meant, if one is near."""
    near = difflib.get_close_matches(str(word)[:60].lower(), sorted(set(options)), n=1, cutoff=0.6)
    return near[0] if near else None


def data_path(value: Any, location: Sequence[int | str]) -> tuple[Path, str | None, bool]:
    """A pydantic location in terms of the file: (path, name of a missing last key, whether a key is meant).

    Tags of unions, and the 0 of a single item without its list, are no part of the file and fall away.
    """
    path: Path = ()
    for part in location:
        if part == "[key]":
            return path, None, True
        found = _step(value, part)
        if found is not None:
            path, value = (*path, found), value[found]
    last = location[-1] if location else None
    missing = str(last) if isinstance(last, str) and (not path or path[-1] != last) else None
    return path, missing, False


def _step(value: Any, part: int | str) -> int | str | float | None:
    if isinstance(value, list):
        return part if isinstance(part, int) and part < len(value) else None
    if not isinstance(value, dict):
        return None
    # pydantic writes keys that are not words or whole numbers as text
    return next((key for key in value if key == part or str(key) == str(part)), None)


def schemas_at(schema: Mapping[str, Any], path: Path) -> list[Mapping[str, Any]]:
    """Every part of a JSON Schema that may describe what stands at a path."""
    found = list(_alternatives(schema, schema))
    for part in path:
        found = [deeper for one in found for deeper in _children(schema, one, part)]
    return found


def _children(root: Mapping[str, Any], one: Mapping[str, Any], part: Any) -> Iterator[Mapping[str, Any]]:
    if isinstance(part, str) and part in one.get("properties", {}):
        yield from _alternatives(root, one["properties"][part])
    elif isinstance(one.get("additionalProperties"), dict):
        yield from _alternatives(root, one["additionalProperties"])
    elif isinstance(one.get("items"), dict):
        for item in _alternatives(root, one["items"]):
            yield from [item] if isinstance(part, int) else _children(root, item, part)


def _alternatives(root: Mapping[str, Any], one: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    if "$ref" in one:
        yield from _alternatives(root, root["$defs"][one["$ref"].rsplit("/", 1)[1]])
    for choice in (*one.get("anyOf", ()), *one.get("oneOf", ())):
        yield from _alternatives(root, choice)
    yield one
