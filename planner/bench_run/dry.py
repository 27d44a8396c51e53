"""A campaign on paper: the runner itself, with instruments that obey at once and print what they are told."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from planner.bench_run.equipment import BenchLines, Dialects, Equipment, Say
from planner.bench_run.job import Job
from planner.bench_run.journal import Journal, Past
from planner.bench_run.paper import PaperChamber, PaperClock, PaperLine, PaperTable
from planner.bench_run.runner import execute
from planner.nouns.step import Step


def dry_run(job: Job, past: Past, say: Say, dialects: Dialects) -> None:
    """Say every command that a run would send from here on, under the step that it is for.

    dialects: bench -> those of its table and its chamber
    """
    clock = PaperClock()
    benches = {
        name: BenchLines(
            PaperLine(PaperTable(dialects[name][0], clock), say),
            PaperLine(PaperChamber(dialects[name][1], clock), say),
            *dialects[name],
        )
        for name in job.used_benches
    }
    execute(
        job, Equipment(benches, clock), PaperJournal(past), say, lambda step: say(_heading(step, clock.now()))
    )


class PaperJournal(Journal):
    """Remembers nothing on any disk."""

    def __init__(self, past: Past) -> None:
        super().__init__(Path("dry run"), -1, past)

    def append(self, line: Mapping[str, Any]) -> None:
        """Nothing."""

    def close(self) -> None:
        """Nothing."""


def _heading(step: Step, now: float) -> str:
    hours, rest = divmod(int(now), 3600)
    seconds = step.end_s - step.start_s
    return f"{hours:5d}:{rest // 60:02d}:{rest % 60:02d}   {step.id}, {step.action} {seconds:g} s"
