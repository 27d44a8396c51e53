"""pydantic's findings as sentences for the person who wrote the file."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from functools import cache
from typing import Any

from pydantic import BaseModel, ValidationError

from planner.errors import Fault
from planner.spec.places import data_path, did_you_mean, fault_at, nearest, schemas_at
from planner.spec.yaml12 import Document, Path

_KINDS = {
    "list_type": "must be a list, not {given}; write [a, b]",
    "tuple_type": "must be a list, not {given}; write [a, b]",
    "dict_type": "must be a mapping, not {given}; write lines of 'key: value', or {{key: value}}",
    "model_type": "must be a mapping, not {given}; write lines of 'key: value', or {{key: value}}",
    "model_attributes_type": "must be a mapping, not {given}; write lines of 'key: value', or {{key: value}}",
    "int_type": "must be a whole number, not {given}",
    "float_type": "must be a number, not {given}",
    "finite_number": "must be a finite number",
    "bool_type": "must be true or false, not {given}",
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
_CODES = {
    "extra_forbidden": "P101",
    "missing": "P102",
    "form": "P103",
    "string_type": "P104",
    "string_too_short": "P108",
    "string_too_long": "P108",
    "list_type": "P105",
    "tuple_type": "P105",
    "dict_type": "P106",
    "model_type": "P106",
    "model_attributes_type": "P106",
    "int_type": "P107",
    "float_type": "P107",
    "finite_number": "P107",
    "bool_type": "P107",
    "greater_than": "P108",
    "greater_than_equal": "P108",
    "less_than": "P108",
    "less_than_equal": "P108",
    "too_short": "P109",
    "too_long": "P109",
    "literal_error": "P110",
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
        place = (*root, *path)
        yield path, fault_at(document, _code(detail), place, message, key=key or kind == "extra_forbidden")


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


def _code(detail: Mapping[str, Any]) -> str:
    """The rule that a finding of pydantic's breaks; ours carry their own."""
    own = getattr(detail.get("ctx", {}).get("error"), "code", None)
    return own or _CODES.get(detail["type"], "P100")


def _sentence(detail: Mapping[str, Any], path: Path, schema: Mapping[str, Any]) -> str:
    kind, context = detail["type"], detail.get("ctx", {})
    special: dict[str, Callable[[], str]] = {
        "missing": lambda: f"is missing{_wanted(schema, path)}",
        "extra_forbidden": lambda: f"unknown key{did_you_mean(path[-1], _keys(schema, path[:-1]))}",
        "literal_error": lambda: _literal(detail["input"], context["expected"]),
        "value_error": lambda: str(context.get("error", detail["msg"])),
        "form": lambda: _no_form(detail["input"], context["words"].split(), detail["msg"]),
        "string_type": lambda: _not_text(detail["input"]),
    }
    if kind in special:
        return special[kind]()
    if kind in _KINDS:
        return _KINDS[kind].format(given=_given(detail["input"]), **context)
    return str(detail["msg"])


def _given(value: object) -> str:
    if isinstance(value, list | tuple):
        return "a list"
    return "a mapping" if isinstance(value, dict) else f"'{str(value)[:40]}'"


def _no_form(value: object, words: Sequence[str], forms: str) -> str:
    near = get_close_matches(str(value)[:60].lower(), words, n=1) if isinstance(value, str) else []
    hint = f"did you mean '{near[0]}'? It " if near else ""
    return f"{_given(value)} is not understood here; {hint}{forms}"


def _not_text(value: object) -> str:
    if isinstance(value, list | tuple | dict):
        return f"must be text, not {_given(value)}; write one text"
    return f"must be text; if {_given(value)} is meant as text, put it in quotes"


def _literal(given: object, expected: str) -> str:
    options = re.findall(r"'([^']*)'", expected)
    if not isinstance(given, str):
        return f"must be one of {', '.join(options)}"
    return f"'{given[:40]}' is not known here{did_you_mean(given, options)}"


def _keys(schema: Mapping[str, Any], path: Path) -> set[str]:
    return {key for one in schemas_at(schema, path) for key in one.get("properties", {})}


def meant_key(path: Path, model: type[BaseModel]) -> Path | None:
    """Where the value of an unknown key was meant to stand, if a known key is near."""
    near = nearest(path[-1], _keys(_schema(model), path[:-1]))
    return None if near is None else (*path[:-1], near)


def _wanted(schema: Mapping[str, Any], path: Path) -> str:
    """What the schema says of a missing key."""
    text = next((one["description"] for one in schemas_at(schema, path[:-1]) for one in _of(one, path)), "")
    return f"; {text}" if text else ""


def _of(schema: Mapping[str, Any], path: Path) -> Iterator[Mapping[str, Any]]:
    field = schema.get("properties", {}).get(path[-1], {})
    if "description" in field:
        yield field
