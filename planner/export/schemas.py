"""JSON Schemas (draft 2020-12) of the files that planner reads and writes, by the file's name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from planner.errors import InputError

Schema = dict[str, Any]


def schema_of(of: str) -> Schema:
    """The schema of a file. Raises InputError for one that has none."""
    known = schemas()
    if of not in known:
        raise InputError(f"--of {of}: there is no schema of that; there are {', '.join(known)}")
    return known[of]()


def schemas() -> dict[str, Callable[[], Schema]]:
    """File -> what makes its schema."""
    from planner.nouns.plan_file import plan_schema
    from planner.recordings.map_schema import column_map_schema
    from planner.spec.schema import json_schema

    return {"spec": json_schema, "column-map": column_map_schema, "plan": plan_schema}
