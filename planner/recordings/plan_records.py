"""The plan's records laid over a recording, by time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.nouns.plan_file import steps_of
from planner.recordings.samples import Samples


@dataclass(frozen=True)
class PlannedRecord:
    """One record of a plan: its step, and its times on the plan's clock in s."""

    step: str
    start: float
    end: float


def records_of(document: object) -> tuple[PlannedRecord, ...]:
    """The records among the steps of a plan's tree, in order of time. Raises InputError for no plan."""
    records = (step for step in steps_of(document) if step.action == "record")
    return tuple(PlannedRecord(step.id, step.start_s, step.end_s) for step in records)


def labelled(
    blocks: Iterable[Samples], records: Sequence[PlannedRecord], plan_time: float
) -> Iterator[Samples]:
    """Samples named by the record that they fall into; `plan_time`: the plan's clock at the first sample."""
    start = np.array([record.start for record in records])
    end = np.array([record.end for record in records])
    names = np.array([*(record.step for record in records), ""])
    for block in blocks:
        now = block.time + plan_time
        place = np.searchsorted(start, now, side="right") - 1
        inside = (place >= 0) & (now <= end[place])
        yield replace(block, label=names[np.where(inside, place, -1)])
