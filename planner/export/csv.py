"""steps.csv: the plan's steps, one row a step, units in the column names."""

from __future__ import annotations

import csv
import io
import json

from planner.export.json import step_document
from planner.records import Plan

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
)


def steps_text(plan: Plan) -> str:
    """The steps as CSV; the motion is JSON with its units in the names (`rate_1_dps`)."""
    out = io.StringIO()
    writer = csv.DictWriter(out, COLUMNS, lineterminator="\n")
    writer.writeheader()
    for step in plan.steps:
        row = step_document(step)
        row["motion"] = "" if row["motion"] is None else json.dumps(row["motion"])
        writer.writerow(row)
    return out.getvalue()
