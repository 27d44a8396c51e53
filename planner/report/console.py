"""A report on the console: the answer first, then why; plain lines when nobody watches in colour."""

from __future__ import annotations

from functools import singledispatch
from typing import TYPE_CHECKING, Literal

from planner.report.blocks import Block, Difference, Fact, Items, Report, Table, Text, Verdict
from planner.report.numbers import plain

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table as Grid

_COLOURS = {"+": "green", "-": "red"}


def show(report: Report, console: Console) -> None:
    """Print title, answer, verdicts, the brief facts and every block that is not of the page alone.

    Notes are not printed: they are messages, which go to stderr. A file or a pipe has no width to fit: there
    nothing is folded or left out.
    """
    if report.title:
        _line(console, report.title, "bold")
    _answer(report, console)
    for verdict in report.verdicts:
        _verdict(verdict, console)
    _facts([fact for fact in report.facts if fact.brief], console)
    apart = bool(report.title or report.answer)
    for block in (b for part in report.sections for b in part.blocks if "page" not in (part.only, b.only)):
        if apart and (isinstance(block, Table) or (isinstance(block, Items) and block.title)):
            console.print()
        apart = True
        _show(block, console)


def _answer(report: Report, console: Console) -> None:
    first, *others = report.sentences or ("",)
    if report.answer:
        _line(console, f"{report.answer.removesuffix('.')}. {first}".strip(), bold=len(report.answer))
    for sentence in others:
        _line(console, sentence)


def _verdict(verdict: Verdict, console: Console) -> None:
    word = f": {verdict.word}" if verdict.word else ""
    text = f"{verdict.text} ({verdict.detail})".replace("≤", "<=")
    _line(console, text + word, tail=(len(word) - 2, "green" if verdict.met else "bold red"))
    for why in verdict.why:
        _line(console, f"  {why}")


def _facts(facts: list[Fact], console: Console) -> None:
    if facts:
        _line(console, "; ".join(f"{fact.name} {fact.value}" for fact in facts))


def _line(
    console: Console, text: str, style: str = "", *, bold: int = 0, tail: tuple[int, str] | None = None
) -> None:
    """One line or paragraph; bold: how many letters at its start; tail: how many at its end, and how."""
    from rich.text import Text as Styled

    words = Styled(plain(text), style)
    words.stylize("bold", 0, bold)
    if tail is not None and tail[0] > 0:
        words.stylize(tail[1], len(words) - tail[0])
    console.print(words, highlight=False, soft_wrap=not console.is_terminal)


@singledispatch
def _show(block: Block, console: Console) -> None:
    raise TypeError(f"{type(block).__name__} is shown on no console")


@_show.register(Text)
def _(block: Text, console: Console) -> None:
    _line(console, block.text)


@_show.register(Items)
def _(block: Items, console: Console) -> None:
    if block.title:
        _line(console, block.title)
    for item in block.items:
        _line(console, f"  {item}" if block.title else item)


@_show.register(Difference)
def _(block: Difference, console: Console) -> None:
    for line in block.text.splitlines():
        _line(console, line, _COLOURS.get(line[:1], "dim"))


@_show.register(Table)
def _(block: Table, console: Console) -> None:
    before, whole = console.width, _grid(block, ())
    needed = console.measure(whole, options=console.options.update(max_width=10_000)).maximum
    try:
        if not console.is_terminal:
            console.width = max(before, needed)
        fits = needed <= console.width
        _line(console, _caption(block), "italic")
        console.print(whole if fits else _grid(block, block.wide))
    finally:
        console.width = before


def _caption(block: Table) -> str:
    cut = block.most is not None and len(block.rows) > block.most
    return block.caption + (f" (the first {block.most} of {len(block.rows)})" if cut else "")


def _grid(block: Table, without: tuple[str, ...]) -> Grid:
    """The table without a frame, its bars, and the columns that are left out."""
    from rich.table import Table as Grid
    from rich.text import Text as Styled

    grid = Grid(box=None, pad_edge=False, header_style="dim")
    kept = [i for i, t in enumerate(block.columns) if t not in without and block.kinds[i] != "bar"]
    rows = [[Styled(plain(str(row[i]))) for i in kept] for row in block.aligned[: block.most]]
    for place, i in enumerate(kept):
        widest = max((row[place].cell_len for row in rows), default=0) if place == 0 else None
        side: Literal["right", "left"] = "right" if block.kinds[i] == "number" else "left"
        title = Styled(plain(block.columns[i].replace(".\u200b", ".\n")))  # lines break at blanks only
        grid.add_column(title, justify=side, overflow="fold", min_width=widest)
    for row in rows:
        grid.add_row(*row)
    return grid
