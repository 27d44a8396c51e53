"""Text tables read strictly and fast: comma, tab, semicolon or spaces between cells, `#` lines on top.

A file is read in chunks of whole lines, so its size does not matter. Rows that do not have a number in every
cell that is wanted are found with their line; nothing is repaired and no cell is guessed.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import Fault, InputError

CHUNK_BYTES = 1 << 24  # 16 MB of text are about 100 000 rows
LONGEST_LINE = 1 << 20
HEAD_BYTES = 1 << 16
_COMMENT = (b"#", b"%", b"//")
_SPACES = re.compile(rb"[ \t]+")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf|infinity)", re.IGNORECASE)


@dataclass(frozen=True)
class Layout:
    """How the cells of a text table stand.

    names: of the columns, `column_1` … when there is no header; named: whether there is a header
    delimiter: one byte, or a space for any number of blanks; decimal: `.` or `,`
    first_line: line of the first row, from 1; offset: its byte; comments: lines on top, without their sign
    """

    names: tuple[str, ...]
    named: bool
    delimiter: str
    decimal: str
    first_line: int
    offset: int
    comments: tuple[str, ...] = ()


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


# ---------------------------------------------------------------- layout


def layout_of(path: Path, skip_lines: int = 0) -> Layout:
    """How the cells stand in a text file, from its first lines.

    Raises InputError for an empty file, one that is not text, and one with comments only.
    """
    head = _head(path)
    offset = 3 if head.startswith(b"\xef\xbb\xbf") else 0
    comments: list[str] = []
    line = 0
    while True:
        end = head.find(b"\n", offset)
        text = head[offset : end if end >= 0 else len(head)].strip()
        line += 1
        if text and not text.startswith(_COMMENT) and line > skip_lines:
            break
        if text.startswith(_COMMENT):
            comments.append(text.decode("utf-8", "replace").lstrip("#%/ "))
        if end < 0:
            raise InputError(f"{path} has no rows")
        offset = end + 1
    delimiter = next((sign for sign in (",", "\t", ";") if sign.encode() in text), " ")
    cells = _cells(text.decode("utf-8", "replace"), delimiter)
    if all(_NUMBER.fullmatch(cell) for cell in cells):
        names = tuple(f"column_{i + 1}" for i in range(len(cells)))
        decimal = _decimal(text, delimiter)
        return Layout(names, False, delimiter, decimal, line, offset, tuple(comments))
    if end < 0:
        raise InputError(f"{path} has a header and no rows")
    after = head[end + 1 :].split(b"\n", 1)[0]
    decimal = _decimal(after, delimiter)
    return Layout(tuple(cells), True, delimiter, decimal, line + 1, end + 1, tuple(comments))


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    if not head.strip():
        raise InputError(f"{path} is empty")
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError(f"{path} is UTF-16 text; save it as UTF-8")
    if b"\0" in head:
        raise InputError(f"{path} is not a text table: it holds zero bytes")
    return head


def _decimal(row: bytes, delimiter: str) -> str:
    return "," if delimiter == ";" and b"," in row and b"." not in row else "."


def _cells(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    parts = next(csv.reader([line], delimiter=delimiter), []) if '"' in line else line.split(delimiter)
    return [part.strip() for part in parts]


# ---------------------------------------------------------------- rows


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
    line = layout.first_line
    for data, torn in _chunks(path, layout.offset, chunk_bytes):
        rows = data.count(b"\n") + (0 if data.endswith(b"\n") else 1)
        block = _block(path, data, line, layout, tuple(wanted), tuple(texts))
        line += rows
        yield TextBlock(block.columns, block.lines, block.bad, line - 1 if torn else 0)


def _chunks(path: Path, offset: int, size: int) -> Iterator[tuple[bytes, bool]]:
    """Chunks of whole lines and whether the last line of the chunk has no end."""
    with path.open("rb") as file:
        file.seek(offset)
        rest = b""
        while True:
            data = file.read(size)
            if not data:
                break
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


def _block(
    path: Path, data: bytes, first: int, layout: Layout, wanted: tuple[str, ...], texts: tuple[str, ...]
) -> TextBlock:
    from pyarrow import ArrowInvalid

    try:
        columns = _fast(data, layout, wanted, texts)
        return TextBlock(columns, _lines(data, first, len(next(iter(columns.values()), ()))))
    except (ArrowInvalid, UnicodeDecodeError):
        rows = _one_by_one(path, data, first, layout, wanted, texts)
    text = "\n".join("\t".join(row) for row in rows.kept) + "\n"
    plain = Layout(wanted, True, "\t", ".", 1, 0)
    kept = (
        _fast(text.encode(), plain, wanted, texts)
        if rows.kept
        else {name: np.zeros(0, dtype=str if name in texts else float) for name in wanted}
    )
    return TextBlock(kept, np.array(rows.lines, dtype=np.int64), tuple(rows.bad))


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
    return {name: table.column(name).to_numpy() for name in wanted}


def _lines(data: bytes, first: int, rows: int) -> NDArray[np.int64]:
    """The line of every row; blank lines between them are counted, as an editor does."""
    if data.count(b"\n") + (not data.endswith(b"\n")) == rows:
        return np.arange(first, first + rows, dtype=np.int64)
    filled = [i for i, line in enumerate(data.splitlines()) if line.strip()]
    return np.array(filled[:rows], dtype=np.int64) + first


def _one_by_one(
    path: Path, data: bytes, first: int, layout: Layout, wanted: tuple[str, ...], texts: tuple[str, ...]
) -> _Rows:
    """The rows that are whole and the faults of the others."""
    rows = _Rows()
    places = [(layout.names.index(name), name, name in texts) for name in wanted]
    for number, raw in enumerate(data.split(b"\n"), first):
        line = raw.decode("utf-8", "replace").strip("\r")
        if not line.strip():
            continue
        cells = _cells(line, layout.delimiter)
        reason = _reason(cells, places, layout)
        if reason:
            rows.bad.append(Fault(str(path), number, 1, "", reason))
            continue
        plain = [cells[i] if text else cells[i].replace(layout.decimal, ".") for i, _, text in places]
        rows.kept.append(plain)
        rows.lines.append(number)
    return rows


def _reason(cells: list[str], places: list[tuple[int, str, bool]], layout: Layout) -> str:
    if len(cells) != len(layout.names):
        return f"{len(cells)} cells where the table has {len(layout.names)} columns"
    for i, name, text in places:
        cell = cells[i].replace(layout.decimal, ".")
        if not text and cell and not _NUMBER.fullmatch(cell):
            return f"{name}: {cells[i][:30]!r} is not a number"
    return ""
