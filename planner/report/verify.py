"""Is the promise kept? The answer first, then the recount and the flights; lines on the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from planner.report.numbers import digits, percent, plain, quantity
from planner.report.terminal import room
from planner.report.verify_words import (
    files_sentence,
    flight_sentence,
    headline,
    outcome_lines,
    parts_table,
    recount_sentence,
    second_code,
)
from planner.verify.verification import Verification

if TYPE_CHECKING:
    from rich.console import Console

MOST_FAULTS = 20
_COLUMNS = 120


def print_verification(v: Verification, console: Console) -> None:
    """Print verdict, recount, requirements, parts and what the records cannot tell."""
    from planner.report.summary import rich_table

    with room(console, _COLUMNS):
        for line in _lines(v):
            console.print(plain(line), highlight=False, markup=False, soft_wrap=not console.is_terminal)
        for o in v.outcomes:
            table = parts_table(o)
            if table is not None:
                console.print()
                console.print(rich_table(table))


def _lines(v: Verification) -> Iterator[str]:
    yield headline(v)
    yield ""
    yield f"recount: {recount_sentence(v.recount)}"
    for fault in v.recount.faults[:MOST_FAULTS]:
        yield f"  {fault}"
    if len(v.recount.faults) > MOST_FAULTS:
        yield f"  and {len(v.recount.faults) - MOST_FAULTS} more"
    if v.outcomes:
        yield f"flights: {flight_sentence(v)}"
    if v.files.units:
        yield f"through files: {files_sentence(v.files)}"
    for fault in v.files.faults:
        yield f"  {fault}"
    for o in v.outcomes:
        for line in outcome_lines(o):
            yield f"  {line}"
    low = [c for c in v.claims if c.high < c.claimed]
    for c in low:
        yield (
            f"  estimate of {c.error}: {percent(c.share)} within the half-width that is claimed for "
            f"{percent(c.claimed, 0)}"
        )
    for w in v.weak:
        yield f"  the records cannot tell {w.error} {w.axis}: {w.why}"
    yield second_code()


__all__ = ["digits", "print_verification", "quantity"]
