"""How the cells of a text table stand: delimiter, decimal sign, names, units, and where the rows begin.

All of it is told from the first lines, by what most of them are. A line that is unlike the others is no
reason to read the others differently: it is left to the rows, where it is a fault with a line.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from planner.errors import InputError, unusable_file
from planner.nouns.given_files import TABLE

HEAD_BYTES = 1 << 16
SAMPLE_LINES = 200
NUMBER = re.compile(
    r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|[+-]?(?:nan|inf|infinity)", re.IGNORECASE
)
_COMMENT = ("#", "%", "//")
_DELIMITERS = ("\t", ";", "|", ",", " ")
_KNOWN_UNIT = re.compile(
    r"(?:m?s|[num]?sec\w*|[nuµ]s|[mu]?g|m/s.*|.*/s(?:ec)?|.*deg.*|.*°.*|dps|rad.*|counts?|lsb|k|c|hz|-|)",
    re.IGNORECASE,
)
_NUMBERED = re.compile(r"(?:col(?:umn)?\s*)?(\d{1,3})\s*[:=.)]\s*(\S.*)", re.IGNORECASE)
_LIST_OF_NAMES = re.compile(
    r"^[\w ]*\b(?:columns?|fields?|format|names?|header)\b[^:=]*[:=]\s*", re.IGNORECASE
)


@dataclass(frozen=True)
class Layout:
    """How the cells of a text table stand.

    names: of the columns, `column_1` … when there is no header; named: whether there is a header
    delimiter: one byte, or a space for any number of blanks; decimal: `.` or `,`
    first_line: line of the first row, from 1; offset: its byte; comments: lines on top, without their sign
    units: of the columns, from a row of them beneath the header, or none; newline: what ends a line
    skipped: lines above the table that are neither comments nor header
    """

    names: tuple[str, ...]
    named: bool
    delimiter: str
    decimal: str
    first_line: int
    offset: int
    comments: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    newline: str = "\n"
    skipped: int = 0


@dataclass(frozen=True)
class _Line:
    """A line of the head: its text, its number from 1, the byte behind its end."""

    text: str
    number: int
    start: int
    end: int
    closed: bool


def layout_of(path: Path, skip_lines: int = 0, strict: bool = False) -> Layout:
    """How the cells stand in a text file, from its first lines.

    strict: the first line that is no comment is the header, or the first row; else lines of another kind may
    stand above. Raises InputError for an empty file, one that is not text, and one with comments only.
    """
    head = _head(path)
    newline = "\r" if b"\r" in head and b"\n" not in head else "\n"
    lines = _lines(head, newline, skip_lines)
    comments = [line.text for line in lines if line.text.startswith(_COMMENT)]
    said = tuple(text.lstrip("#%/ ") for text in comments)
    body = [line for line in lines if line.text and not line.text.startswith(_COMMENT)]
    forced = ""
    if body and (told := re.fullmatch(r'"?sep=(.)"?', body[0].text)):
        forced, body = told[1], body[1:]
    if not body:
        raise InputError(f"{path} has no rows")
    delimiter, decimal = _signs([line.text for line in body], forced)
    found = _Table(path, body, delimiter, decimal, newline, said)
    return found.strict() if strict else found.free()


class _Table:
    """The head of a table, its delimiter known."""

    def __init__(
        self,
        path: Path,
        body: Sequence[_Line],
        delimiter: str,
        decimal: str,
        newline: str,
        said: tuple[str, ...],
    ) -> None:
        self.path, self.body, self.said = path, body, said
        self.delimiter, self.decimal, self.newline = delimiter, decimal, newline
        self.cells = [cells_of(line.text, delimiter) for line in body]
        self.numbers = [sum(is_number(cell, decimal) for cell in row) for row in self.cells]

    def strict(self) -> Layout:
        """The first line is the header unless every cell of it is a number."""
        if self.numbers[0] == len(self.cells[0]):
            return self._layout(0)
        return self._headed(0, 1)

    def free(self) -> Layout:
        """The header is the last line of the rows' width above the first row."""
        first = self._first_row()
        if first is None:  # nothing looks like a row of numbers
            return self.strict()
        width = len(self.cells[first])
        header = next((i for i in reversed(range(first)) if self._heads(i, width)), None)
        if header is None:
            return self._layout(first, skipped=first)
        units = first if header + 1 == first else header + 1
        if header >= 1 and self._is_units(header) and self._heads(header - 1, width):
            return self._headed(header - 1, header + 1, tuple(_bare(c) for c in self.cells[header]), width)
        if units < first and len(self.cells[units]) == width and self._is_units(units):
            return self._headed(header, units + 1, tuple(_bare(c) for c in self.cells[units]), width)
        return self._headed(header, header + 1, (), width)

    def _first_row(self) -> int | None:
        """The first line like most others: as many cells, and about as many numbers among them."""
        tail = range(len(self.body) // 3, len(self.body))
        usual = Counter((len(self.cells[i]), self.numbers[i] > 0) for i in tail if self.numbers[i])
        if not usual:
            return None
        width = usual.most_common(1)[0][0][0]
        rows = [i for i, row in enumerate(self.cells) if len(row) == width and self.numbers[i]]
        most = sorted(self.numbers[i] for i in rows)[len(rows) // 2]
        return next((i for i in rows if 2 * self.numbers[i] > most), None)

    def _heads(self, i: int, width: int) -> bool:
        names = self._names(i, width)
        return len(names) == width and self.numbers[i] == 0 and any(names)

    def _names(self, i: int, width: int) -> list[str]:
        """The cells of a header; one more where rows end in a delimiter; by another delimiter if need be."""
        names = self.cells[i]
        if len(names) == width:
            return names
        if len(names) == width - 1 and all(len(row) != width or not row[-1] for row in self.cells[i + 1 :]):
            return [*names, ""]
        return _split_to(self.body[i].text, width) or names

    def _is_units(self, i: int) -> bool:
        known = [_KNOWN_UNIT.fullmatch(_bare(cell)) is not None for cell in self.cells[i]]
        return self.numbers[i] == 0 and sum(known) > 0.7 * len(known) and any(map(_bare, self.cells[i]))

    def _headed(self, header: int, row: int, units: tuple[str, ...] = (), width: int | None = None) -> Layout:
        line = self.body[row - 1]
        if not line.closed:
            raise InputError(f"{self.path} has a header and no rows")
        names = self._names(header, width or len(self.cells[header]))
        return self._made(names, True, line.number + 1, line.end, units, header)

    def _layout(self, first: int, skipped: int = 0) -> Layout:
        width = len(self.cells[first])
        told = names_of_comments(self.said, width, self.delimiter)
        line = self.body[first]
        return self._made(told or [], told is not None, line.number, line.start, (), skipped, width)

    def _made(
        self,
        names: Sequence[str],
        named: bool,
        first_line: int,
        offset: int,
        units: tuple[str, ...],
        skipped: int,
        width: int = 0,
    ) -> Layout:
        shown = names or [""] * width
        return Layout(
            tuple(name or f"column_{i + 1}" for i, name in enumerate(shown)),
            named,
            self.delimiter,
            self.decimal,
            first_line,
            offset,
            self.said,
            units,
            self.newline,
            skipped,
        )


# ---------------------------------------------------------------- lines and cells


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
    except OSError as error:
        raise unusable_file(path, error, TABLE) from error
    if not head.strip():
        raise unusable_file(path, "is empty", TABLE)
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise unusable_file(path, "is UTF-16 text", "the same saved as UTF-8")
    if b"\0" in head:
        raise unusable_file(path, "is not a text table: it holds zero bytes", TABLE)
    return head


def _lines(head: bytes, newline: str, skip_lines: int) -> list[_Line]:
    """The lines of the head after those to be skipped; one that the head cuts is not among them."""
    sign = newline.encode()
    start, number = (3 if head.startswith(b"\xef\xbb\xbf") else 0), 0
    found: list[_Line] = []
    while start < len(head) and len(found) < SAMPLE_LINES + skip_lines:
        end = head.find(sign, start)
        closed = end >= 0
        if not closed and len(head) == HEAD_BYTES and found:
            break
        stop = end if closed else len(head)
        number += 1
        line = _Line(decoded(head[start:stop]).strip(), number, start, stop + 1, closed)
        if number > skip_lines:
            found.append(line)
        start = stop + 1
    return found


def decoded(raw: bytes) -> str:
    """Text of UTF-8, else of Windows' Latin letters, in which a lone byte B0 is a degree sign."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace")


def cells_of(line: str, delimiter: str) -> list[str]:
    """The cells of a line without blanks and quotes around them."""
    if delimiter == " ":
        return [part.strip('"') for part in line.split()]
    if '"' not in line:
        return [part.strip() for part in line.split(delimiter)]
    try:
        return [part.strip() for part in next(csv.reader([line], delimiter=delimiter), [])]
    except csv.Error:  # a field of more than 128 KiB
        return [part.strip() for part in line.split(delimiter)]


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number with that decimal sign; a comma needs digits on both sides."""
    if decimal == ",":
        return NUMBER.fullmatch(re.sub(r"(?<=[0-9]),(?=[0-9])", ".", cell, count=1)) is not None
    return NUMBER.fullmatch(cell) is not None


def _signs(lines: Sequence[str], forced: str) -> tuple[str, str]:
    """Delimiter and decimal sign that make most cells of the later lines numbers, of one count."""
    later = lines[len(lines) // 3 :][:60]
    best, choice = (-1.0, -1.0, -1.0), (",", ".")
    for delimiter in [forced] if forced else _DELIMITERS:
        rows = [cells_of(line, delimiter) for line in later]
        width, common = Counter(map(len, rows)).most_common(1)[0]
        for decimal in (".", ",") if delimiter != "," else (".",):
            cells = [cell for row in rows for cell in row if cell]
            share = sum(is_number(cell, decimal) for cell in cells) / max(len(cells), 1)
            several = float(width > 1)
            score = (several * round(share * common / len(rows), 2), several, float(decimal == "."))
            if score > best:
                best, choice = score, (delimiter, decimal)
    return choice if best[1] > 0 or forced else (_by_first(lines[0]), ".")


def _by_first(line: str) -> str:
    return next((sign for sign in (",", "\t", ";") if sign in line), " ")


# ---------------------------------------------------------------- names


def names_of_comments(said: Sequence[str], width: int, delimiter: str) -> list[str] | None:
    """The names of `width` columns that the comments above a table tell, or None.

    A comment with as many words as columns, the last such one; or a numbered line for every column.
    """
    numbered = {int(m[1]): m[2].strip() for text in said if (m := _NUMBERED.fullmatch(text.strip()))}
    if width > 1 and set(range(1, width + 1)) <= set(numbered):
        return [numbered[i + 1] for i in range(width)]
    for text in reversed(said):
        for one in (text, _LIST_OF_NAMES.sub("", text)):
            cells = cells_of(one, delimiter)
            names = cells if len(cells) == width else _split_to(one, width)
            if names and not any(is_number(name, ".") for name in names) and width > 1:
                return names
    return None


def _split_to(text: str, width: int) -> list[str] | None:
    """The text in `width` cells by whichever delimiter gives that many, or None."""
    for delimiter in _DELIMITERS:
        cells = cells_of(text, delimiter)
        if len(cells) == width and width > 1:
            return cells
    return None


def _bare(cell: str) -> str:
    return cell.strip().strip("[](){}<>").strip()
