"""pydantic's findings as sentences for the person who wrote the file."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any

from pydantic import BaseModel, ValidationError

from planner.errors import Fault
from planner.spec.places import data_path, did_you_mean, fault_at, schemas_at
from planner.spec.yaml12 import Document, Path

_KINDS = {
    "string_type": "must be text; if it is meant as text, put it in quotes",
    "list_type": "must be a list, like [a, b]",
    "tuple_type": "must be a list, like [a, b]",
    "dict_type": "must be a mapping, lines of 'key: value'",
    "model_type": "must be a mapping, lines of 'key: value'",
    "model_attributes_type": "must be a mapping, lines of 'key: value'",
    "int_type": "must be a whole number",
    "float_type": "must be a number",
    "finite_number": "must be a finite number",
    "bool_type": "must be true or false",
    "string_too_short": "must not be empty",
    "string_too_long": "is longer than {max_length} characters",
    "greater_than": "must be greater than {gt:g}",
    "greater_than_equal": "must not be less than {ge:g}",
    "less_than": "must be less than {lt:g}",
    "less_than_equal": "must not be more than {le:g}",
    "too_short": "has {actual_length} entries; at least {min_length} must be there",
    "too_long": "has {actual_length} entries; at most {max_length} can be there",
    "frozen_instance": "cannot be changed",
}


def faults_of(
    error: ValidationError, document: Document, value: Any, model: type[BaseModel], root: Path = ()
) -> Iterator[tuple[Path, Fault]]:
    """Every finding of a validation of `value`, which stands at `root` of the document, with its path.

    `model` is asked which keys exist and what a missing one should look like.
    """
    schema = _schema(model)
    found = error.errors(include_url=False)
    for detail in found:
        if _counts_good_items_only(detail, found):
            continue
        path, missing, key = data_path(value, detail["loc"])
        if detail["type"] == "missing" and missing:
            path = (*path, missing)
        kind = detail["type"]
        message = _sentence(detail, path, schema)
        yield path, fault_at(document, (*root, *path), message, key=key or kind == "extra_forbidden")


def _counts_good_items_only(detail: Mapping[str, Any], found: Sequence[Mapping[str, Any]]) -> bool:
    """pydantic calls a list too short when enough items stand there but one has a fault of its own.

    Keys that are the same in two words are too few indeed.
    """
    given, here = detail["input"], len(detail["loc"])
    return (
        detail["type"] == "too_short"
        and isinstance(given, list | tuple | dict)
        and len(given) >= detail["ctx"]["min_length"]
        and any(len(one["loc"]) > here and one["loc"][:here] == detail["loc"] for one in found)
    )


@cache
def _schema(model: type[BaseModel]) -> Mapping[str, Any]:
    return model.model_json_schema()  # 10 ms for a whole spec


def _sentence(detail: Mapping[str, Any], path: Path, schema: Mapping[str, Any]) -> str:
    kind, context = detail["type"], detail.get("ctx", {})
    special: dict[str, Callable[[], str]] = {
        "missing": lambda: f"is missing{_wanted(schema, path)}",
        "extra_forbidden": lambda: f"unknown key{did_you_mean(path[-1], _keys(schema, path[:-1]))}",
        "literal_error": lambda: _literal(detail["input"], context["expected"]),
        "value_error": lambda: str(context.get("error", detail["msg"])),
    }
    if kind in special:
        return special[kind]()
    if kind in _KINDS:
        return _KINDS[kind].format(**context)
    return str(detail["msg"])


def _literal(given: object, expected: str) -> str:
    options = re.findall(r"'([^']*)'", expected)
    if not isinstance(given, str):
        return f"must be one of {', '.join(options)}"
    return f"'{given[:40]}' is not known here{did_you_mean(given, options)}"


def _keys(schema: Mapping[str, Any], path: Path) -> set[str]:
    return {key for one in schemas_at(schema, path) for key in one.get("properties", {})}


def _wanted(schema: Mapping[str, Any], path: Path) -> str:
    """What the schema says of a missing key."""
    text = next((one["description"] for one in schemas_at(schema, path[:-1]) for one in _of(one, path)), "")
    return f"; {text}" if text else ""


def _of(schema: Mapping[str, Any], path: Path) -> Iterator[Mapping[str, Any]]:
    field = schema.get("properties", {}).get(path[-1], {})
    if "description" in field:
        yield field
