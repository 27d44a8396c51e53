"""What a result says: one report of verdicts, facts, notes and sections of blocks.

Plain data: `console.show` prints it, `page.html` writes it, `tree` is the same for scripts. A picture is
drawn only where a page is made.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from planner.report.numbers import NOTHING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Where = Literal["page", "console"]
_OFF_SCALE = 20.0  # limits: what is further off ends at the edge of its gauge
_NUMBER = re.compile(  # a sign, digits, a power of ten, a unit, a mark
    "[<>≥≤≈+−-]*[\u202f ]?\\d[\\d\u202f]*(\\.\\d+)?(e[+-]\\d+|·10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?"
    "([\u202f ][^\u202f ,:→…()\\d]+)?( !)?|∞"
)


@dataclass(frozen=True)
class Bar:
    """A bar in a table's cell: `share` of the cell's width, 0 … 1."""

    share: float

    @property
    def percent(self) -> str:
        """Width for the style sheet."""
        return _percent(self.share)


Cell = str | Bar


@dataclass(frozen=True)
class Table:
    """A table, its cells already written as text.

    total: the last row is the sum of the others; wide: titles of the columns that a narrow terminal leaves
    out; most: rows that a terminal shows; only: where it stands, if not everywhere
    """

    kind: ClassVar[str] = "table"
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    total: bool = False
    wide: tuple[str, ...] = ()
    most: int | None = None
    only: Where | None = None

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """`text`, `number` or `bar` of each column, as its cells are; the first names its row."""
        return tuple(_kind(i, [row[i] for row in self.rows]) for i in range(len(self.columns)))

    @cached_property
    def aligned(self) -> tuple[tuple[Cell, ...], ...]:
        """The rows, each number filled up with blanks as wide as digits so that decimal points align."""
        columns = [
            align_points(column) if kind == "number" else column
            for kind, column in zip(self.kinds, zip(*self.rows, strict=True), strict=False)
        ]
        return tuple(zip(*columns, strict=True))


@dataclass(frozen=True)
class Picture:
    """A figure with its caption; name: of its ids on the page; alt: what it shows, for who cannot see it.

    folded: the line behind which it opens on demand; empty: it is open
    """

    kind: ClassVar[str] = "picture"
    only: ClassVar[Where] = "page"
    name: str
    alt: str
    caption: str
    draw: Callable[[], Figure]
    folded: str = ""

    @property
    def svg(self) -> str:
        """The figure as inline SVG."""
        from planner.report.charts.theme import drawn

        return drawn(self.name, self.alt, self.draw)


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    kind: ClassVar[str] = "text"
    text: str
    only: Where | None = None


@dataclass(frozen=True)
class Items:
    """A list of sentences, under a heading if it has one."""

    kind: ClassVar[str] = "items"
    items: tuple[str, ...]
    title: str = ""
    only: Where | None = None


@dataclass(frozen=True)
class Folded:
    """Long text that opens on demand."""

    kind: ClassVar[str] = "folded"
    only: ClassVar[Where] = "page"
    summary: str
    text: str


@dataclass(frozen=True)
class Difference:
    """Lines of a text before (-) and after (+)."""

    kind: ClassVar[str] = "difference"
    text: str
    only: Where | None = None


Block = Table | Picture | Text | Items | Folded | Difference


@dataclass(frozen=True)
class Section:
    """A numbered part; `id` is its anchor on the page."""

    id: str
    title: str
    blocks: tuple[Block, ...]
    only: Where | None = None


@dataclass(frozen=True)
class Verdict:
    """One requirement: a sentence, its size and its limit in one unit, and whether it is met.

    word: the verdict in a word; why: what lies behind it; after: the size once something is done about it
    """

    text: str
    detail: str
    reached: float
    limit: float
    met: bool
    word: str = ""
    why: tuple[str, ...] = ()
    after: float | None = None

    def width(self, size: float | None) -> str:
        """How far along the gauge a size lies, for the style sheet; it ends at the limit or the sizes."""
        largest = min(max(self.reached, self.after or 0.0), _OFF_SCALE * self.limit)
        return _percent((size or 0.0) / (1.05 * max(self.limit, largest) or 1.0))


@dataclass(frozen=True)
class Fact:
    """A name and its value; brief: the terminal has it too."""

    name: str
    value: str
    brief: bool = False


@dataclass(frozen=True)
class Report:
    """A result in words: kind of report, whose, the answer and its reasons; command: what made it."""

    kind: str
    title: str
    answer: str
    sentences: tuple[str, ...] = ()
    verdicts: tuple[Verdict, ...] = ()
    notes: tuple[str, ...] = ()
    facts: tuple[Fact, ...] = ()
    sections: tuple[Section, ...] = ()
    command: str = ""


def section(id_: str, title: str, *blocks: Block | None, only: Where | None = None) -> Section | None:
    """The section with the blocks that exist, or None if no block does."""
    present = tuple(block for block in blocks if block is not None)
    return Section(id_, title, present, only) if present else None


def facts(*found: tuple[str, str], brief: Sequence[str] = ()) -> tuple[Fact, ...]:
    """The names and values that are known; brief: names of those that the terminal has too."""
    return tuple(Fact(name, value, name in brief) for name, value in found if value)


def existing(*sections: Section | None) -> tuple[Section, ...]:
    """Those that have something to say."""
    return tuple(part for part in sections if part is not None)


def table(caption: str, columns: str, rows: Iterable[Sequence[Cell]], **more: Any) -> Table | None:
    """A table of the columns `a | b | c`, or None without rows."""
    found = tuple(map(tuple, rows))
    titles = tuple(title.strip() for title in columns.split("|"))
    return Table(caption, titles, found, **more) if found else None


def tree(value: Any) -> Any:
    """A report, or a part of it, as plain data for JSON; pictures by their words."""
    if is_dataclass(value):
        kind = {"kind": value.kind} if isinstance(value, Block) else {}
        return kind | {f.name: tree(getattr(value, f.name)) for f in fields(value) if f.name != "draw"}
    return [tree(part) for part in value] if isinstance(value, tuple) else value


def align_points(cells: Sequence[Cell]) -> list[Cell]:
    """Numbers of one column with trailing blanks as wide as digits, up to the longest fraction."""
    fractions = [_fraction(cell) for cell in cells]
    longest = max((len(f) for f in fractions if f is not None), default=0)
    return [_filled(cell, fraction, longest) for cell, fraction in zip(cells, fractions, strict=True)]


def _percent(share: float) -> str:
    return f"{100 * min(max(share, 0.0), 1.0):.2f}%"


def _kind(place: int, cells: Sequence[Cell]) -> str:
    if any(isinstance(cell, Bar) for cell in cells):
        return "bar"
    said = [cell for cell in cells if cell and cell != NOTHING]
    numbers = sum(bool(_NUMBER.fullmatch(str(cell))) for cell in said)
    return "number" if place > 0 and 2 * numbers > len(said) else "text"


def _fraction(cell: Cell) -> str | None:
    """What stands from the decimal point on, "" for a whole number, None if the cell is no plain number."""
    if not isinstance(cell, str) or not cell or not set(cell) <= set("0123456789.−-+\u202f"):
        return None
    return cell[cell.index(".") :] if "." in cell else ""


def _filled(cell: Cell, fraction: str | None, longest: int) -> Cell:
    if fraction is None or not isinstance(cell, str) or longest == len(fraction):
        return cell
    point = "" if fraction else "\u2008"
    return cell + point + "\u2007" * (longest - max(len(fraction), 1))
