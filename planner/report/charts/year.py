"""A year on one calendar: months in rows, days in columns, how many units come on which day."""

from __future__ import annotations

from calendar import monthrange
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, timedelta
from typing import TYPE_CHECKING

from planner.report.blocks import Picture
from planner.report.charts import theme
from planner.report.numbers import counted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MONTHS = ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"]
_MOST_ROWS = 25


@dataclass(frozen=True)
class YearMark:
    """So many units on a day of the count; overdue: some of them should have come before."""

    day: float
    units: int
    overdue: bool = False


def year_picture(name: str, what: str, marks: Sequence[YearMark], start: date, today: float) -> Picture:
    """The calendar from today on. start: the date of day 0; what: what is done, in the plural."""
    days = _by_day(marks, start)
    total = sum(units for units, _ in days.values())
    late = counted(sum(overdue for _, overdue in days.values()), "of them overdue", "of them overdue")
    alt = f"Calendar with {total} {what} on {counted(len(days), 'day')}, {late}"
    caption = (
        f"How many units come on which day; red: overdue. Today is {start + timedelta(days=int(today))}."
    )
    return Picture(f"year-{name}", alt, caption, lambda: _year(days, start + timedelta(days=int(today))))


def _by_day(marks: Sequence[YearMark], start: date) -> dict[date, tuple[int, int]]:
    """Date -> units, of them overdue."""
    found: dict[date, tuple[int, int]] = {}
    for mark in marks:
        day = start + timedelta(days=int(mark.day))
        units, overdue = found.get(day, (0, 0))
        found[day] = (units + mark.units, overdue + (mark.units if mark.overdue else 0))
    return found


def _year(days: dict[date, tuple[int, int]], today: date) -> Figure:
    first = min([today, *days])
    last = max([today, *days])
    rows = min((last.year - first.year) * 12 + last.month - first.month + 1, _MOST_ROWS)
    figure, [[axes]] = theme.fixed_panels([0.27 * max(rows, 3)], room=theme.Room(below=0.3))
    months = [divmod(first.year * 12 + first.month - 1 + row, 12) for row in range(rows)]
    every = [
        (date(y, m + 1, 1) + timedelta(days=i), r)
        for r, (y, m) in enumerate(months)
        for i in range(monthrange(y, m + 1)[1])
    ]
    for alpha, weekend in ((0.35, False), (0.9, True)):
        places = [(day.day, row) for day, row in every if (day.weekday() >= 5) == weekend]
        axes.plot(*zip(*places, strict=True), "s", color=theme.GRID, markersize=9, alpha=alpha)
    for day_, (units, overdue) in days.items():
        row = (day_.year - first.year) * 12 + day_.month - first.month
        if row >= rows:
            continue
        axes.plot(day_.day, row, "s", color=theme.RED if overdue else theme.BLUE, markersize=12)
        axes.text(day_.day, row, str(units), color="white", fontsize=8.5, ha="center", va="center")
    row = (today.year - first.year) * 12 + today.month - first.month
    axes.plot(today.day, row, "s", markerfacecolor="none", markeredgecolor=theme.INK, markersize=14)
    axes.set_yticks(range(rows), [f"{_MONTHS[m]} {y}" for y, m in months])
    axes.set_xticks(range(1, 32, 2))
    axes.set_ylim(rows - 0.4, -0.6)
    axes.set_xlim(0.3, 31.7)
    axes.grid(visible=False)
    return figure
