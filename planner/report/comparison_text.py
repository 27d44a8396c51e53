"""A comparison of plans in the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from planner.report.comparison import MICROSECONDS, Comparison, Difference
from planner.report.numbers import digits, hours, percent, plain, when
from planner.report.readable import readable_unit
from planner.report.terminal import room
from planner.units import from_si, unit_factor

if TYPE_CHECKING:
    from rich.console import Console

_CENTIHOUR = 36 * MICROSECONDS  # hours are printed with two decimals


def print_comparison(comparison: Comparison, console: Console) -> None:
    """Print hours by bench, test and action, error against hours, and what differs and why."""
    with room(console, 50 + 22 * len(comparison.plans)):
        _print(comparison, console)


def _print(c: Comparison, console: Console) -> None:
    from rich.markup import escape

    if len(set(c.spec_sha256)) > 1:
        console.print(
            "the specs differ: " + ", ".join(h[:12] or "unknown" for h in c.spec_sha256), highlight=False
        )
    _print_table(console, "hours", c.plans, _hour_rows(c))
    _print_table(console, "navigation error against hours", c.plans, _error_rows(c))
    if c.allowances:
        _print_table(console, "allowed sensor errors", c.plans, _allowed_rows(c))
    for difference in c.differences:
        console.print(
            f"\n[bold]{escape(difference.plan)}[/bold] against {escape(c.plans[0])}:", highlight=False
        )
        for reason, added in zip(difference.reasons, _rounded(difference), strict=True):
            line = f"  {reason.what}: {reason.why}: {_signed_hours(added)} h"
            console.print(escape(line), highlight=False, soft_wrap=not console.is_terminal)
        console.print(f"  together {_signed_hours(difference.added_us)} h", highlight=False)
    if not c.differ:
        console.print("The plans do not differ.", highlight=False)


def _hour_rows(c: Comparison) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for title, group in (("bench", c.benches), ("test", c.tests), ("action", c.actions)):
        rows += [
            (f"{title} {s.name.replace('_', ' ') if title == 'action' else s.name}", *map(_hours, s.time_us))
            for s in group
        ]
    rows.append(("powered", *map(_hours, c.power_on_us)))
    rows.append(("all", *map(_hours, c.time_us)))
    rows.append(("gap", *("–" if g is None else plain(percent(g, 2)) for g in c.gap)))
    return rows


def _error_rows(c: Comparison) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = [("hours", *map(_hours, c.time_us))]
    for r in c.requirements:
        pairs = zip(r.achieved, r.limit, strict=True)
        rows.append(
            (
                f"{r.error} {when(r.at)}, {r.rule.replace('_', ' ')}, {r.unit}",
                *(_of_limit(a, limit) for a, limit in pairs),
            )
        )
    return rows


def _allowed_rows(c: Comparison) -> list[tuple[str, ...]]:
    rows = []
    for a in c.allowances:
        sizes = [None if value is None else value * unit_factor(a.unit)[0] for value in a.allowed]
        unit = readable_unit(a.unit, max(size for size in sizes if size is not None))
        cells = ("–" if size is None else plain(digits(from_si(size, unit))) for size in sizes)
        rows.append((f"{a.error}, {unit}", *cells))
    return rows


def _of_limit(achieved: float | None, limit: float | None) -> str:
    if achieved is None or limit is None:
        return "–"
    sign = "<=" if achieved <= limit * (1 + 1e-9) else ">"  # what a sum of ten terms may be off by
    return plain(f"{digits(achieved)} {sign} {digits(limit)}")


def _hours(time_us: int) -> str:
    return plain(hours(time_us / MICROSECONDS))


def _rounded(difference: Difference) -> list[int]:
    """The reasons in whole hundredths of an hour with the sum kept: sums are rounded, not terms."""
    total, before, found = 0, 0, []
    for reason in difference.reasons:
        total += reason.added_us
        after = round(total / _CENTIHOUR) * _CENTIHOUR
        found.append(after - before)
        before = after
    return found


def _signed_hours(time_us: int) -> str:
    return ("+" if time_us > 0 else "") + _hours(time_us)


def _print_table(console: Console, title: str, plans: Sequence[str], rows: Sequence[tuple[str, ...]]) -> None:
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="dim")
    longest = max(len(row[0]) for row in rows)
    table.add_column(title, overflow="fold", min_width=min(longest, console.width // 2))
    for name in plans:
        table.add_column(escape(name), justify="right", overflow="fold")
    for row in rows:
        table.add_row(*map(escape, row))
    console.print(table)
    console.print()
