"""Plays exported table scripts on the simulated table: `command|delay_ms` lines and `Delay n` macros."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from planner.bench_run.simulator.table import Table
from tests.bench_run.memory_line import VirtualClock


@dataclass(frozen=True)
class Word:
    """A line that is for the host and not for the table, such as `Pusk`, with its time and delay in s."""

    text: str
    time_s: float
    delay_s: float


def play(text: str, table: Table, clock: VirtualClock) -> Iterator[Word]:
    """Send every line of a script; yields the host's own words before their delay passes.

    Raises ValueError for a delay that is no number.
    """
    for line in text.splitlines():
        if not line.strip() or line.startswith("#"):
            continue
        command, _, delay_ms = line.partition("|")
        delay_s = float(delay_ms) / 1000 if delay_ms else 0.0
        if command.startswith("Delay "):
            delay_s = float(command.removeprefix("Delay "))
        elif command.startswith((":", "*")):
            table.receive(command)
        else:
            yield Word(command, clock.now(), delay_s)
        clock.sleep(delay_s)
