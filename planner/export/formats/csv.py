"""steps.csv: the plan's steps, one row a step, units in the column names."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from planner.export.csv_text import csv_text
from planner.export.header import HEADER_COLUMNS, header_cells
from planner.protocols import Exported, ExportOptions

RATE = "temperature_rate_degc_min"  # of a chamber that moves during the step, else empty
COLUMNS = (
    "id",
    "bench",
    "action",
    "start_s",
    "end_s",
    "test",
    "temperature_degc",
    "repeat",
    "motion",
    "units",
    "attended",
    RATE,
)


def document_steps_text(document: Mapping[str, Any]) -> str:
    """steps.csv of a plan's tree, as `steps_text` writes it. Raises InputError for what is no plan."""
    from planner.nouns.plan_file import typed_plan

    typed_plan(document)
    return steps_text(document)


def steps_text(document: Mapping[str, Any]) -> str:
    """The steps of `plan_document` as CSV; the motion is JSON, its units in the names (`rate_1_dps`)."""
    plan = header_cells(document)
    return csv_text(COLUMNS + HEADER_COLUMNS, (_cells(row) + plan for row in document["steps"]))


def _cells(row: Mapping[str, Any]) -> list[Any]:
    motion = "" if row["motion"] is None else json.dumps(row["motion"])
    attended = "true" if row.get("attended") else "false"
    cells = {RATE: None, **row, "motion": motion, "attended": attended}
    return [cells[name] for name in COLUMNS]


class Csv:
    """One row a step."""

    name = "csv"
    suffix = ".csv"
    dialects: tuple[str, ...] = ()

    def files(self, document: Mapping[str, Any], options: ExportOptions) -> Exported:
        """steps.csv."""
        return Exported({"steps.csv": document_steps_text(document)})


FORMAT = Csv()
