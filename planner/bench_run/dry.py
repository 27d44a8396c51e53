"""A campaign on paper: the runner itself, with instruments that obey at once and print what they are told."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from planner.bench_run.job import Job
from planner.bench_run.journal import Journal, Past
from planner.bench_run.runner import Equipment, execute
from planner.nouns.plan import Step

_DEMAND = re.compile(r":Demand:(Position|Rate) (\d),([^;\s]+)")
_OFF = re.compile(r":Mode:Off (\S+)")
_READ = re.compile(r":Read:(Position|Rate)\? (\d)")

Say = Callable[[str], None]


def dry_run(job: Job, past: Past, say: Say) -> None:
    """Say every command that a run would send from here on, under the step that it is for."""
    clock = PaperClock()
    line = PaperLine(clock, say)
    equipment = Equipment(tables=dict.fromkeys(job.used_benches, line), chamber=line, clock=clock)
    execute(job, equipment, PaperJournal(past), say, lambda step: say(_heading(step, clock.now())))


class PaperClock:
    """Waits take no time."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        """Seconds that have been waited."""
        return self._now

    def sleep(self, seconds: float) -> None:
        """Count them."""
        self._now += seconds


class PaperLine:
    """A table and a chamber that are where they are told to be."""

    def __init__(self, clock: PaperClock, say: Say) -> None:
        self._clock, self._say = clock, say
        self._at: dict[tuple[str, str], str] = {}
        self._temperature, self._reply = "20.0", ""

    def write(self, message: str) -> None:
        """Say a command, or keep the answer to a question."""
        if message.partition(" ")[0].endswith("?"):
            self._reply = self._answer(message)
            return
        self._say(f"{'':12}{'table  ' if message.startswith(':') else 'chamber'} {message}")
        self._at |= {(mode, axis): value for mode, axis, value in _DEMAND.findall(message)}
        if _OFF.search(message):
            self._at = {key: value for key, value in self._at.items() if key[0] != "Rate"}
        if message.startswith("TEMP,S"):
            self._temperature = message[6:]
        self._reply = f"OK:{message}"

    def read(self) -> str:
        """The answer to the last message."""
        return self._reply

    def clear(self) -> None:
        """Nothing comes late on paper."""

    def reopen(self) -> None:
        """Nothing drops on paper."""

    def close(self) -> None:
        """Nothing."""

    def _answer(self, message: str) -> str:
        if message == "TEMP?":
            return f"{self._temperature},{self._temperature}"
        found = _READ.fullmatch(message)
        return "0" if found is None else self._at.get((found[1], found[2]), "0")


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
