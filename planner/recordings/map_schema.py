"""JSON Schema of a column map (draft 2020-12), for editors."""

from __future__ import annotations

from typing import Any

from planner.recordings.column_map import ColumnMap
from planner.spec.schema import headed, tidy


def column_map_schema() -> dict[str, Any]:
    """The schema of the keys; that a map names at least one sensor, and times or a rate, it says too."""
    head = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "planner column map",
        "description": "Which column of a raw recording is what, in which unit, with which sign.",
        "anyOf": [{"required": ["gyro"]}, {"required": ["acc"]}],
    }
    return headed(tidy(ColumnMap.model_json_schema()), head)
