"""A file of planner's against its published schema, strictly: every key that stands in it is declared."""

from __future__ import annotations

from typing import Any

import jsonschema

import planner


def keeps(document: Any, of: str) -> None:
    """Raises ValidationError unless the document has the keys of `planner schema --of`, and no others."""
    jsonschema.validate(document, _closed(planner.schema(of)))


def _closed(schema: Any) -> Any:
    """The schema with every record closed."""
    if isinstance(schema, list):
        return [_closed(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    inside = {key: _closed(value) for key, value in schema.items()}
    return {"additionalProperties": False, **inside} if schema.get("type") == "object" else inside
