"""The plan in the terminal: the answer first, then why; plain lines when nobody watches in colour."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from planner.records import Achieved, AllowedErrors, Constraint, Plan, PlannedTest
from planner.report import tables
from planner.report.blocks import Table as Block
from planner.report.budget import PARTS, contributions
from planner.report.numbers import (
    days,
    degrees_celsius,
    digits,
    display_unit,
    hours,
    in_unit,
    percent,
    plain,
    quantity,
    when,
)
from planner.report.proof import proof
from planner.report.readable import allowed_in, plan_in, units_of
from planner.report.sections import what_binds
from planner.report.tables import degrees, runs
from planner.report.terminal import room

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.table import Table

    from planner.plan.spec_to_sensitivity import SensitivityRow

_SHORT = {
    "run_to_run": "run-run",
    "in_run": "in-run",
    "storage": "store",
    "temperature": "temp",
    "estimate": "est",
}
_FEW = 7  # temperatures that a line has room for
_NARROW = 96  # columns that the allowances need with all their parts, names of common length
_WIDE = 130  # the same with the longest names


def print_summary(plan: Plan, console: Console, constraints: Sequence[Constraint] = ()) -> None:
    """Print hours, proof, requirements, what binds, tests and allowances on `console`.

    Notes are not printed: they are messages, which go to stderr.

    On a narrow terminal the parts of the allowances are left out; a file or a pipe gets all columns.
    """
    plan = plan_in(plan, units_of(plan))
    with room(console, _WIDE):
        for what in _parts(plan, console.width < _NARROW, constraints):
            console.print(what, highlight=False, soft_wrap=isinstance(what, str) and not console.is_terminal)


def print_sensitivities(rows: Sequence[SensitivityRow], console: Console) -> None:
    """Print the position error at the end of the flight per display unit of every column."""
    with room(console, _WIDE):
        console.print(rich_table(tables.rows_table(rows)))


def print_allowed(allowed: AllowedErrors, console: Console) -> None:
    """Print the corners of the allowed errors, genetic beside exact, and what the bench's best would use."""
    history = allowed.history
    allowed = allowed_in(allowed, {})
    with room(console, _WIDE):
        for index, share in allowed.tightness.items():
            text = (
                f"requirement {index + 1}: the smallest errors that the bench can reach use {percent(share)}"
            )
            console.print(plain(text), highlight=False)
        console.print(rich_table(tables.bounds_table(allowed)))
        if corners := tables.corners_table(allowed, compact=True):
            console.print(rich_table(corners))
    console.print(
        f"genetic algorithm: {len(allowed.front)} Pareto points, {history.generations} generations, "
        f"{history.evaluations} evaluations ({history.stopped})",
        highlight=False,
    )


def rich_table(block: Block) -> Table:
    """A table of the report for the terminal; bars are left to pages."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="dim", title=block.caption, title_justify="left")
    for i, column in enumerate(block.columns):
        title = plain(column.title.replace(".\u200b", ".\n"))  # rich breaks lines at blanks only
        widest = max((len(plain(str(row[i]))) for row in block.rows), default=0) if i == 0 else None
        right = column.kind == "number"
        table.add_column(title, justify="right" if right else "left", overflow="fold", min_width=widest)
    for row in block.aligned:
        table.add_row(*(_escape(plain(cell)) for cell in row if isinstance(cell, str)))
    return table


def _parts(plan: Plan, narrow: bool, constraints: Sequence[Constraint]) -> Iterator[RenderableType]:
    long = f" ({days(plan.time_s)})" if days(plan.time_s) else ""
    yield f"[bold]{_escape(plan.name)}[/bold]"
    yield f"[bold]{plain(hours(plan.time_s))} h[/bold]{long}. {_escape(plain(proof(plan)))}"
    yield from map(_requirement_line, plan.requirements)
    for sentence in what_binds(plan, constraints):
        yield f"  {_escape(plain(sentence))}"
    yield f"powered {plain(hours(plan.power_on_s))} h, {len(plan.steps)} steps"
    if plan.tests:
        yield _tests(plan.tests)
    if plan.allowances:
        yield _allowances(plan, narrow)


def _requirement_line(achieved: Achieved) -> str:
    sign, word = ("<=", "[green]met[/green]") if achieved.met else (">", "[bold red]NOT met[/bold red]")
    reached, limit = (plain(quantity(v, achieved.unit)) for v in (achieved.achieved, achieved.limit))
    rule = achieved.rule.replace("_", " ")
    line = f"{achieved.error}: {reached} {sign} {limit} ({_escape(f'{when(achieved.at)}, {rule}')}): {word}"
    if achieved.flown is None:
        return line
    flown = plain(quantity(achieved.flown, achieved.unit))
    return f"{line}\n  that is the budget; by the campaign's own model {flown} will be flown"


def _tests(tests: Sequence[PlannedTest]) -> Table:
    table = _table("test", "bench", "temperatures, °C", "repeats", "h")
    for test in tests:
        cells = (test.test, test.bench, _span(test.temperatures_degc), _repeats(test.repeats))
        table.add_row(*(_escape(plain(cell)) for cell in cells), plain(hours(test.time_s)))
    return table


def _span(temperatures: Sequence[float]) -> str:
    """All of a few temperatures, the ends of many."""
    if len(temperatures) <= _FEW:
        return degrees(temperatures)
    ends = " to ".join(degrees_celsius(t) for t in (temperatures[0], temperatures[-1]))
    return f"{len(temperatures)}: {ends}"


def _repeats(repeats: Sequence[int]) -> str:
    if len(repeats) <= _FEW or len(set(repeats)) == 1:
        return runs([str(n) for n in repeats])
    return f"{min(repeats)} to {max(repeats)}, {sum(repeats)} in all"


def _allowances(plan: Plan, narrow: bool) -> Table:
    parts = () if narrow else PARTS
    table = _table("error", "allowed", *(_SHORT[part] for part in parts), "unit", "share", numbers=1)
    budgets = [contributions(plan, i, ()) for i in range(len(plan.requirements))]
    order = [c.error for c in budgets[0]] if budgets else [a.error for a in plan.allowances]
    for allowance in sorted(plan.allowances, key=lambda a: order.index(a.error)):
        values = [allowance.allowed, *(allowance.parts[part] for part in parts)]
        shares = [next(c.share for c in b if c.error == allowance.error) for b in budgets]
        table.add_row(
            allowance.error,
            *(digits(in_unit(v, allowance.unit)) for v in values),
            display_unit(allowance.unit),
            plain(", ".join(percent(share) for share in shares)),
        )
    return table


def _table(*titles: str, numbers: int | None = None) -> Table:
    """A table without a frame; numbers from column `numbers` on (or only in the last) stand to the right."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="dim")
    for i, title in enumerate(titles):
        right = i == len(titles) - 1 or (numbers is not None and i >= numbers and title != "unit")
        table.add_column(title, justify="right" if right else "left", overflow="fold")
    return table


def _escape(text: str) -> str:
    from rich.markup import escape

    return escape(text)
