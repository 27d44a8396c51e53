"""Text recordings: comma, tab, semicolon or spaces between cells, with or without a header."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from planner.protocols import RawBlock
from planner.readers._delimited import TextBlock, text_blocks
from planner.readers._layout import Layout, layout_of

UTF_16 = (b"\xff\xfe", b"\xfe\xff")  # taken here, to be refused in words


class TextReader:
    """A table in text; rows that cannot be read are left out, counted, and keep their place in time."""

    name = "text"
    suffixes = (".csv", ".tsv", ".txt", ".log", ".dat", ".asc")

    def recognises(self, path: Path, head: bytes) -> bool:
        """Text by its suffix, or whatever has no control bytes and is letters of some code, `.mat` too."""
        if path.suffix.lower() in self.suffixes:
            return b"\0" not in head or head.startswith(UTF_16)
        return bool(head) and not any(byte < 9 or 13 < byte < 27 for byte in head) and _is_text(head)

    def names(self, path: Path, skip_lines: int = 0) -> tuple[str, ...]:
        """The header's cells, those of a comment above the rows, or column_1 … without either.

        A name that stands there again is told apart by its number: `x`, `x (column 4)`.
        """
        return read_layout(path, skip_lines).names

    def blocks(
        self, path: Path, wanted: Sequence[str], texts: Sequence[str] = (), skip_lines: int = 0
    ) -> Iterator[RawBlock]:
        """The wanted columns; ragged rows and a cut last line are counted as losses."""
        layout = read_layout(path, skip_lines)
        start = 0
        for block in text_blocks(path, layout, wanted, texts):
            raw = _raw(block, start)
            if not start and layout.skipped:
                said = f"{layout.skipped} lines above the table are no rows of it"
                raw = replace(raw, remarks=(*raw.remarks, said))
            start += len(block.lines) + len(block.bad)
            yield raw


def read_layout(path: Path, skip_lines: int = 0) -> Layout:
    """How the cells stand, every column under a name of its own. Raises InputError as `layout_of`."""
    layout = layout_of(path, skip_lines)
    names = layout.names
    told = tuple(
        name if name not in names[:i] else f"{name} (column {i + 1})" for i, name in enumerate(names)
    )
    return replace(layout, names=told)


def _is_text(head: bytes) -> bool:
    """Whether bytes are UTF-8, but for a letter that their end cuts."""
    try:
        head.decode("utf-8")
    except UnicodeDecodeError as error:
        return error.end >= len(head) - 3 and error.reason == "unexpected end of data"
    return True


def _raw(block: TextBlock, start: int) -> RawBlock:
    """Row numbers count the bad rows too, so that the clock of a recording without times does not slip."""
    bad_lines = np.array([fault.line for fault in block.bad], dtype=np.int64)
    place = np.arange(len(block.lines)) + np.searchsorted(np.sort(bad_lines), block.lines)
    columns, losses = dict(block.columns), {}
    remarks = [str(fault) for fault in block.bad[:3]]
    if len(bad_lines):
        losses["unreadable_row"] = len(bad_lines)
    if block.torn and len(block.lines) and block.lines[-1] == block.torn:
        # the last number may be a part of the number that was meant
        columns, place = {name: values[:-1] for name, values in columns.items()}, place[:-1]
        losses["torn_last_line"] = 1
        remarks.append(f"line {block.torn}, the last, has no line end and may be cut")
    return RawBlock(columns, place + start, losses, tuple(remarks))


READER = TextReader()
