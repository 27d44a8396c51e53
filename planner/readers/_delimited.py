"""Text tables read strictly and fast: comma, tab, semicolon, bar or spaces between cells, `#` lines on top.

A file is read in chunks of whole lines, so its size does not matter. Rows that do not have a number in every
cell that is wanted are found with their line; nothing is repaired and no cell is guessed.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import Fault, InputError
from planner.readers._layout import NUMBER, Layout, cells_of, layout_of

__all__ = ["Layout", "TextBlock", "layout_of", "text_blocks"]

CHUNK_BYTES = 1 << 24  # 16 MB of text are about 100 000 rows
LONGEST_LINE = 1 << 20
FEW_LINES = 256  # among which a fault is looked for line by line
_SPACES = re.compile(rb"[ \t]+")


@dataclass(frozen=True)
class TextBlock:
    """Consecutive rows: column name -> (n,) numbers or texts; lines: (n,) line of every row.

    bad: rows that could not be read and are not among these, each with its line and the reason
    torn: line number of a last line without line end, which may have been cut; 0 when there is none
    """

    columns: dict[str, NDArray[Any]]
    lines: NDArray[np.int64]
    bad: tuple[Fault, ...] = ()
    torn: int = 0


@dataclass
class _Rows:
    """Rows of a chunk that are being collected one by one, because the fast way found a fault."""

    kept: list[list[str]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    bad: list[Fault] = field(default_factory=list)


@dataclass(frozen=True)
class _Asked:
    """What is wanted of a file: path, layout, column names, and those among them that stay text."""

    path: Path
    layout: Layout
    wanted: tuple[str, ...]
    texts: tuple[str, ...]


def text_blocks(
    path: Path,
    layout: Layout,
    wanted: Sequence[str],
    texts: Sequence[str] = (),
    chunk_bytes: int = CHUNK_BYTES,
) -> Iterator[TextBlock]:
    """The wanted columns in blocks of about `chunk_bytes`; those in `texts` stay text.

    Raises InputError when the file cannot be read or a line has no end.
    """
    line, asked = layout.first_line, _Asked(path, layout, tuple(wanted), tuple(texts))
    for data, torn in _chunks(path, layout, chunk_bytes):
        rows = data.count(b"\n") + (0 if data.endswith(b"\n") else 1)
        block = _together(list(_parts(data, line, asked)), asked)
        line += rows
        yield TextBlock(block.columns, block.lines, block.bad, line - 1 if torn else 0)


def _chunks(path: Path, layout: Layout, size: int) -> Iterator[tuple[bytes, bool]]:
    """Chunks of whole lines, which end in a line feed, and whether the last line of the chunk has no end."""
    with path.open("rb") as file:
        file.seek(layout.offset)
        rest = b""
        while True:
            data = file.read(size)
            if not data:
                break
            data = data.replace(b"\r", b"\n") if layout.newline == "\r" else data
            cut = data.rfind(b"\n") + 1
            if not cut:
                rest += data
                if len(rest) > max(size, LONGEST_LINE):
                    raise InputError(f"{path} has a line of more than {len(rest)} bytes; it is no text table")
                continue
            yield rest + data[:cut], False
            rest = data[cut:]
        if rest.strip():
            yield rest, True


def _parts(data: bytes, first: int, asked: _Asked) -> Iterator[TextBlock]:
    """The rows of whole lines, all at once where they are whole; else of halves, down to single lines."""
    from pyarrow import ArrowException

    try:
        if _is_plain(data):
            columns = _fast(data, asked.layout, asked.wanted, asked.texts)
            lines = _lines(data, first, len(next(iter(columns.values()), ())))
            if lines is not None:
                yield TextBlock(columns, lines)
                return
    except (ArrowException, UnicodeDecodeError):
        pass  # some line of these has a fault, which is looked for
    count = data.count(b"\n")
    if count <= FEW_LINES:
        yield _slow(data, first, asked)
        return
    middle = data.find(b"\n", len(data) // 2) + 1
    if middle in (0, len(data)):  # one line is longer than all others together
        yield _slow(data, first, asked)
        return
    yield from _parts(data[:middle], first, asked)
    yield from _parts(data[middle:], first + data[:middle].count(b"\n"), asked)


def _is_plain(data: bytes) -> bool:
    """Whether no quote stays open over a line's end, and no line is cut by a lone carriage return."""
    if b"\r" in data and data.count(b"\r") != data.count(b"\r\n"):
        return False
    return b'"' not in data or all(line.count(b'"') % 2 == 0 for line in data.split(b"\n"))


def _slow(data: bytes, first: int, asked: _Asked) -> TextBlock:
    rows = _one_by_one(data, first, asked)
    columns: dict[str, NDArray[Any]] = {}
    for i, name in enumerate(asked.wanted):
        cells = [row[i] for row in rows.kept]
        if name in asked.texts:
            columns[name] = np.array(cells, dtype=object)
        else:
            columns[name] = np.array([float(cell) if cell else np.nan for cell in cells], dtype=float)
    return TextBlock(columns, np.array(rows.lines, dtype=np.int64), tuple(rows.bad))


def _together(parts: list[TextBlock], asked: _Asked) -> TextBlock:
    if len(parts) == 1:
        return parts[0]
    columns = {name: np.concatenate([part.columns[name] for part in parts]) for name in asked.wanted}
    lines = np.concatenate([part.lines for part in parts])
    return TextBlock(columns, lines, tuple(fault for part in parts for fault in part.bad))


def _fast(
    data: bytes, layout: Layout, wanted: tuple[str, ...], texts: tuple[str, ...]
) -> dict[str, NDArray[Any]]:
    """Every row through pyarrow, which refuses ragged rows and cells that are no numbers."""
    import pyarrow as pa
    from pyarrow import csv as arrow_csv

    if layout.delimiter == " ":
        data = re.sub(rb"(?m)^ | (?=\r?$)", b"", _SPACES.sub(b" ", data))
    table = arrow_csv.read_csv(
        io.BytesIO(data),
        read_options=arrow_csv.ReadOptions(
            column_names=list(layout.names), use_threads=False, block_size=max(len(data), 1)
        ),
        parse_options=arrow_csv.ParseOptions(delimiter=layout.delimiter, double_quote=True),
        convert_options=arrow_csv.ConvertOptions(
            column_types={n: pa.string() if n in texts else pa.float64() for n in wanted},
            include_columns=list(wanted),
            null_values=[""],
            strings_can_be_null=False,
            decimal_point=layout.decimal,
        ),
    )
    return {name: _values(table.column(name), name in texts) for name in wanted}


def _values(column: Any, text: bool) -> NDArray[Any]:
    """(n,) of a column, NaN where a cell is empty; pyarrow's own way there imports pandas, 0.3 s."""
    if text:
        return np.array(column.to_pylist(), dtype=object)
    return np.concatenate([np.empty(0), *(_numbers(chunk) for chunk in column.chunks)])


def _numbers(chunk: Any) -> NDArray[np.float64]:
    """(m,) doubles of an Arrow array: a buffer of bits that tell what is there, and one of values."""
    there, values = chunk.buffers()
    mine = slice(chunk.offset, chunk.offset + len(chunk))
    numbers = np.frombuffer(values, dtype=float)[mine]
    if chunk.null_count == 0:
        return numbers
    bits = np.unpackbits(np.frombuffer(there, dtype=np.uint8), bitorder="little")[mine]
    return np.where(bits > 0, numbers, np.nan)


def _lines(data: bytes, first: int, rows: int) -> NDArray[np.int64] | None:
    """The line of every row; blank lines between them are counted, as an editor does. None: rows are lost."""
    if data.count(b"\n") + (not data.endswith(b"\n")) == rows:
        return np.arange(first, first + rows, dtype=np.int64)
    filled = [i for i, line in enumerate(data.split(b"\n")) if line.strip()]
    return np.array(filled, dtype=np.int64) + first if len(filled) == rows else None


def _one_by_one(data: bytes, first: int, asked: _Asked) -> _Rows:
    """The rows that are whole and the faults of the others."""
    rows, layout = _Rows(), asked.layout
    places = [(layout.names.index(name), name, name in asked.texts) for name in asked.wanted]
    for number, raw in enumerate(data.split(b"\n"), first):
        line = raw.decode("utf-8", "replace").strip("\r")
        if not line.strip():
            continue
        cells = cells_of(line, layout.delimiter)
        reason = _reason(line, cells, places, layout)
        if reason:
            rows.bad.append(Fault(str(asked.path), number, 1, "", reason, "P721"))
            continue
        plain = [cells[i] if text else cells[i].replace(layout.decimal, ".") for i, _, text in places]
        rows.kept.append(plain)
        rows.lines.append(number)
    return rows


def _reason(line: str, cells: list[str], places: list[tuple[int, str, bool]], layout: Layout) -> str:
    if line.count('"') % 2:
        return "a quote is opened and never closed"
    if "\r" in line:
        return "a carriage return stands within the line; end lines by a line feed, or by both"
    if len(cells) != len(layout.names):
        return f"{len(cells)} cells where the table has {len(layout.names)} columns"
    for i, name, text in places:
        cell = cells[i].replace(layout.decimal, ".")
        if not text and cell and not NUMBER.fullmatch(cell):
            return f"{name}: {cells[i][:30]!r} is not a number"
    return ""
