"""The command for raw recordings, no arithmetic: reduce."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planner.commands.options import AsJson
from planner.commands.output import deliver, progress_line

Columns = Annotated[
    Path | None,
    typer.Option(metavar="MAP.yaml", help="Which column is what, in which unit, with which sign."),
]
OfPlan = Annotated[
    Path | None, typer.Option(metavar="PLAN", help="plan.json or its folder: the records are its steps.")
]
Latitude = Annotated[
    float | None,
    typer.Option(min=-90.0, max=90.0, metavar="DEG", help="Of the bench: references from the plan."),
]


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command()(reduce)


def reduce(
    raw: Annotated[
        list[Path],
        typer.Argument(metavar="RAW...", help="Recordings, each of one power-on.", show_default=False),
    ],
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="DATA", help="Dwell table to write: .csv, .parquet or .h5.")
    ],
    columns: Columns = None,
    plan: OfPlan = None,
    latitude: Latitude = None,
    as_json: AsJson = False,
) -> None:
    """Reduce raw recordings to a dwell table; an account of every sample stands beside it.

    A map is lines like `rate: 1000 Hz` and `gyro: {x: gx, y: gy, z: -gz, unit: deg/s}`.
    Text, Parquet, HDF5, MATLAB, .npy and the unit's packet stream are known by what the file holds.

    Example: planner reduce recording.csv --columns map.yaml -o data.csv
    """
    from planner.dwells.dwell_files import dwell_form, dwells_bytes
    from planner.export.reduction import account_text, reduction_document, refuse_overwriting
    from planner.pipelines import recordings as recordings_pipeline
    from planner.report.subjects.reduction import reduction_report

    form, beside = dwell_form(out), out.with_name(out.stem + ".account.json")
    refuse_overwriting((out, beside), (*raw, *(path for path in (columns, plan) if path is not None)))
    with progress_line() as say:
        found = recordings_pipeline.reduce(raw, columns, plan, latitude, say)
    deliver(
        {out: dwells_bytes(found.table, form), beside: account_text(found)},
        found.table.notes,
        {"written": [str(out), str(beside)], **reduction_document(found)},
        reduction_report(found),
        as_json,
    )
