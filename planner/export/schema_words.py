"""The words that schemas of files are made of: records, lists, figures that may not exist."""

from __future__ import annotations

from typing import Any

Schema = dict[str, Any]

TEXT: Schema = {"type": "string"}
NUMBER: Schema = {"type": "number"}
COUNT: Schema = {"type": "integer", "minimum": 0}
YES_OR_NO: Schema = {"type": "boolean"}
ANYTHING: Schema = {}


def record(may: Schema | None = None, **must: Schema) -> Schema:
    """A mapping with keys that it must have, and some that it may."""
    return {"type": "object", "properties": {**must, **(may or {})}, "required": list(must)}


def listed(item: Schema) -> Schema:
    """A list."""
    return {"type": "array", "items": item}


def named(item: Schema) -> Schema:
    """A mapping of any names to one kind of value."""
    return {"type": "object", "additionalProperties": item}


def or_null(schema: Schema) -> Schema:
    """Null where there is none."""
    return {"anyOf": [schema, {"type": "null"}]}


def one_of(*words: str) -> Schema:
    """One of some words."""
    return {"enum": list(words)}


FIGURE = or_null(NUMBER)
INTERVAL: Schema = {"type": "array", "items": FIGURE, "minItems": 2, "maxItems": 2}
SPEC = record(name=TEXT, sha256=TEXT)
WORD = or_null(TEXT)
