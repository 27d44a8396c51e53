"""What the scripts for a bench share: the plan's steps as blocks of commands with exact durations.

A block is some commands and the time until the next block. Times are those of the plan, rounded to whole
milliseconds of the campaign's clock (not of each step, whose rounding would add up).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from planner.control.words import figure

PACE_MS = 200  # between two commands of a host script, as in the published one (K 3.1)


@dataclass(frozen=True)
class Command:
    """One line for the controller; `settle_ms`: what it needs before the next one may be sent."""

    text: str
    settle_ms: int = 0


@dataclass(frozen=True)
class Block:
    """Commands for the controller, then at most one word for the host, together `ms` long."""

    commands: tuple[Command, ...]
    ms: int
    host: str | None = None


def milliseconds(seconds: float) -> int:
    """Whole milliseconds of the campaign's clock."""
    return round(seconds * 1000)


def file_name(bench: str) -> str:
    """A bench's name as a file can bear it."""
    return re.sub(r"[^\w.-]", "_", bench).lstrip(".") or "bench"


def shares_ms(wanted: Sequence[int], ms: int) -> list[int]:
    """`ms` divided over lines: each what it wants as far as that lasts, the last one the rest."""
    left, found = ms, []
    for want in wanted[:-1]:
        given = min(want, left)
        found.append(given)
        left -= given
    return [*found, left]


def host_lines(blocks: Iterable[Block]) -> Iterator[str]:
    """The dialect of a host's script: every line with `|delay_ms`; the delays of a block add up to it."""
    for block in blocks:
        lines = [c.text for c in block.commands] + ([block.host] if block.host else [])
        wanted = [max(PACE_MS, c.settle_ms) for c in block.commands] + [PACE_MS] * bool(block.host)
        for line, delay in zip(lines, shares_ms(wanted, block.ms), strict=True):
            yield f"{line}|{delay}"


def macro_lines(blocks: Iterable[Block]) -> Iterator[str]:
    """The dialect of the controller's own macros: commands, and `Delay n` in seconds between them."""
    for block in blocks:
        left = block.ms
        for command in block.commands:
            yield command.text
            settle = min(command.settle_ms, left)
            left -= settle
            if settle:
                yield f"Delay {figure(settle / 1000)}"
        if left:
            yield f"Delay {figure(left / 1000)}"
