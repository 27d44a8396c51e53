"""The plan itself, plan.json, with the JSON Schema that describes it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from planner.export.json import document_text
from planner.nouns.plan_file import SCHEMA_FILE, plan_schema_text, typed_plan
from planner.protocols import Exported, ExportOptions


class Json:
    """The plan itself with the JSON Schema that describes it."""

    name = "json"
    suffix = ".json"
    dialects: tuple[str, ...] = ()

    def files(self, document: Mapping[str, Any], options: ExportOptions) -> Exported:
        """plan.json, which names its schema by `$schema`, and the schema beside it.

        Raises InputError for what is no plan.
        """
        typed_plan(document)
        body = {key: value for key, value in document.items() if key != "$schema"}
        plan = document_text({"$schema": SCHEMA_FILE, **body})
        return Exported({"plan.json": plan, SCHEMA_FILE: plan_schema_text()})


FORMAT = Json()
