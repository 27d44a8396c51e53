"""What a page is made of: sections of figures, tables and text, plain data until the template writes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal


@dataclass(frozen=True)
class Bar:
    """A bar in a table's cell: `share` of the cell's width, 0 … 1, in a colour of the theme."""

    share: float
    colour: str = "blue"

    @property
    def percent(self) -> str:
        """Width for the style sheet."""
        return f"{100 * min(max(self.share, 0.0), 1.0):.2f}%"


Cell = str | Bar
Kind = Literal["text", "number", "bar"]


@dataclass(frozen=True)
class Column:
    """A table's column; numbers are aligned at the decimal point."""

    title: str
    kind: Kind = "number"


@dataclass(frozen=True)
class Table:
    """A table, its cells already written as text; `total` marks the last row as the sum of the others."""

    kind: ClassVar[str] = "table"
    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    total: bool = False

    @property
    def aligned(self) -> tuple[tuple[Cell, ...], ...]:
        """The rows, each number filled up with blanks as wide as digits so that decimal points align."""
        columns = [
            align_points([row[i] for row in self.rows])
            if c.kind == "number"
            else [row[i] for row in self.rows]
            for i, c in enumerate(self.columns)
        ]
        return tuple(zip(*columns, strict=True))


@dataclass(frozen=True)
class Picture:
    """An inline SVG (trusted: we drew it) with its caption."""

    kind: ClassVar[str] = "picture"
    svg: str
    caption: str


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    kind: ClassVar[str] = "text"
    text: str


@dataclass(frozen=True)
class Items:
    """A list of sentences."""

    kind: ClassVar[str] = "items"
    items: tuple[str, ...]


@dataclass(frozen=True)
class Folded:
    """Long text that opens on demand."""

    kind: ClassVar[str] = "folded"
    summary: str
    text: str


Block = Table | Picture | Text | Items | Folded


@dataclass(frozen=True)
class Section:
    """A numbered part of the page; `id` is its anchor."""

    id: str
    title: str
    blocks: tuple[Block, ...]


def section(id_: str, title: str, *blocks: Block | None) -> Section | None:
    """The section with the blocks that exist, or None if no block does."""
    present = tuple(block for block in blocks if block is not None)
    return Section(id_, title, present) if present else None


def align_points(cells: Sequence[Cell]) -> list[Cell]:
    """Numbers of one column with trailing blanks as wide as digits, up to the longest fraction."""
    fractions = [_fraction(cell) for cell in cells]
    longest = max((len(f) for f in fractions if f is not None), default=0)
    return [_filled(cell, fraction, longest) for cell, fraction in zip(cells, fractions, strict=True)]


def _fraction(cell: Cell) -> str | None:
    """What stands from the decimal point on, "" for a whole number, None if the cell is no plain number."""
    if not isinstance(cell, str) or not cell or not set(cell) <= set("0123456789.−+\u202f"):
        return None
    return cell[cell.index(".") :] if "." in cell else ""


def _filled(cell: Cell, fraction: str | None, longest: int) -> Cell:
    if fraction is None or not isinstance(cell, str) or longest == len(fraction):
        return cell
    point = "" if fraction else "\u2008"
    return cell + point + "\u2007" * (longest - max(len(fraction), 1))
