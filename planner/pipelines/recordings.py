"""The flow of raw recordings: files → rests and motions → dwell table with an account of every sample."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from planner.errors import InputError
from planner.export.documents import read_plan
from planner.nouns.progress import Progress
from planner.recordings.column_map import read_map
from planner.recordings.plan_records import records_of
from planner.recordings.plan_references import references_of
from planner.recordings.raw_to_dwells import reduce_recordings
from planner.recordings.reduction import Reduction


def reduce(
    paths: Sequence[Path],
    columns: Path | None,
    plan: Path | None,
    latitude_deg: float | None,
    progress: Progress,
) -> Reduction:
    """Recordings' files, and what is known of them → the dwell table and the account."""
    if latitude_deg is not None and plan is None:
        raise InputError("--latitude is for the references of a plan's motions; give the plan with --plan")
    found = None if columns is None else read_map(columns)
    document = None if plan is None else read_plan(plan)
    references = None
    if document is not None and latitude_deg is not None:
        references = references_of(document, float(np.radians(latitude_deg)))
    records = None if document is None else records_of(document)
    return reduce_recordings(paths, found, records, references, progress)
