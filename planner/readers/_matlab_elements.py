"""Whether the elements of a MATLAB file of version 5 to 7 are what they must be, asked before scipy reads it.

    type, size | data | padding to 8 bytes        of up to 4 bytes: size and type in 4 bytes | data in 4

scipy 1.17 looks the type of numbers up in a C array, beyond its end for a type that there is not, and the
process dies of signal 11. So the elements are passed over here, in the order in which scipy takes them
(`scipy/io/matlab/_mio5_utils.pyx`); data are not kept. Format: MathWorks, MAT-File Format, level 5.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Literal

from planner.errors import InputError

HEAD_BYTES = 128
BLOCK_BYTES = 1 << 17
MOST_SIDES = 32
MOST_NESTED = 100  # cells in cells: scipy goes down without a limit, and its stack is 8 MB
MOST_EMPTY = 1 << 16  # members of an array that needs no bytes for them
# types of elements
_INT8, _INT32, _UINT32, _MATRIX, _COMPRESSED, _UTF8 = 1, 5, 6, 14, 15, 16
_VALUES = {1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18}  # whole numbers, fractions, letters
# classes of arrays
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
_NUMERIC = range(6, 16)

_CUT = "it ends within an element"

Order = Literal["little", "big"]


class _Damaged(ValueError):
    """A sentence on what an element is, and is not."""


def check_elements(path: Path) -> None:
    """Raises InputError when an element is of no type that its place allows, or is cut."""
    try:
        with path.open("rb") as file:
            order: Order = "little" if file.read(HEAD_BYTES)[126:] == b"IM" else "big"
            place, end = HEAD_BYTES, path.stat().st_size
            while place < end:
                file.seek(place)
                place += _check_variable(file, order)
    except (_Damaged, zlib.error) as error:
        raise InputError(f"{path} is not a whole MATLAB file: {error}") from error


def _check_variable(file: BinaryIO, order: Order) -> int:
    """The bytes of the variable that begins here, which was looked through."""
    kind, size = _Elements(iter([file.read(8)]), order).head()
    packed = kind == _COMPRESSED
    elements = _Elements(_unpacked(file, size) if packed else _blocks(file), order)
    if packed:
        kind, _ = elements.head()
    if kind != _MATRIX or not size:
        raise _Damaged(f"an element of type {kind} and {size} bytes is no variable")
    elements.pass_array()
    return 8 + size


def _blocks(file: BinaryIO) -> Iterator[bytes]:
    while block := file.read(BLOCK_BYTES):
        yield block


def _unpacked(file: BinaryIO, size: int) -> Iterator[bytes]:
    unpacker = zlib.decompressobj()
    while block := file.read(min(BLOCK_BYTES, size)):
        size -= len(block)
        yield unpacker.decompress(block)
    yield unpacker.flush()


class _Elements:
    """Elements one behind the other, out of blocks of bytes."""

    def __init__(self, blocks: Iterator[bytes], order: Order) -> None:
        self.blocks, self.order = blocks, order
        self.block, self.place = b"", 0

    def pass_array(self, depth: int = 0) -> None:
        """An array behind its head: flags, sides, name, and what its class holds."""
        if depth > MOST_NESTED:
            raise _Damaged(f"arrays stand in arrays more than {MOST_NESTED} deep")
        self._passed(8)
        flags, _ = self.head()
        kind = flags & 0xFF
        if kind == _OPAQUE:
            for _ in range(3):
                self._text()
            self._nested(depth)
            return
        sides = self._integers(MOST_SIDES)
        if not sides or min(sides) < 0:  # scipy asks letters for the last of their sides
            raise _Damaged(f"an array with the sides {sides}")
        self._text()
        members = math.prod(sides)
        parts = 2 if flags >> 11 & 1 else 1  # real and imaginary
        if kind in _NUMERIC or kind == _SPARSE:
            for _ in range(parts if kind in _NUMERIC else 2 + parts):
                self._values()
        elif kind == _CHAR:
            self._letters(members)
        elif kind == _CELL:
            self._all_nested(members, depth)
        elif kind in (_STRUCT, _OBJECT):
            if kind == _OBJECT:
                self._text()
            self._all_nested(members * self._fields(members), depth)
        elif kind == _FUNCTION:
            self._nested(depth)
        else:
            raise _Damaged(f"an array of class {kind}, which there is not")

    def head(self) -> tuple[int, int]:
        """Type and size of an element that is not a small one."""
        return self._word(), self._word()

    def _nested(self, depth: int) -> None:
        kind, size = self.head()
        if kind != _MATRIX:
            raise _Damaged(f"an element of type {kind} stands where an array should")
        if size:
            self.pass_array(depth + 1)

    def _all_nested(self, count: int, depth: int) -> None:
        for _ in range(count):
            self._nested(depth)

    def _values(self) -> None:
        kind, _, _ = self._element(0)
        if kind not in _VALUES:
            raise _Damaged(f"an element of type {kind} stands where numbers should")

    def _letters(self, members: int) -> None:
        kind, size, _ = self._element(0)
        if not size:  # blanks, of whatever type
            _check_empty(members)
        elif kind not in _VALUES:
            raise _Damaged(f"an element of type {kind} stands where letters should")

    def _text(self) -> int:
        kind, size, _ = self._element(0)
        if kind not in (_INT8, _UTF8):
            raise _Damaged(f"an element of type {kind} stands where a name should")
        return size

    def _integers(self, most: int) -> tuple[int, ...]:
        kind, _, data = self._element(4 * most)
        if kind not in (_INT32, _UINT32):
            raise _Damaged(f"an element of type {kind} stands where sides or lengths should")
        words = (data[i : i + 4] for i in range(0, len(data) - len(data) % 4, 4))
        return tuple(int.from_bytes(word, self.order, signed=True) for word in words)

    def _fields(self, members: int) -> int:
        """How many fields every member of a struct has."""
        lengths = self._integers(1)
        if len(lengths) != 1 or lengths[0] < 1:
            raise _Damaged(f"names of fields have the lengths {lengths}")
        fields = self._text() // lengths[0]
        if not fields:
            _check_empty(members)
        return fields

    def _element(self, most: int) -> tuple[int, int, bytes]:
        """Type, size, and the data of an element that is kept; most: bytes, 0 for one that is passed over."""
        kind = self._word()
        small = kind >> 16
        if small > 4:
            raise _Damaged(f"a small element of {small} bytes")
        if small:
            return kind & 0xFFFF, small, self._taken(4)[:small]
        size, data = self._word(), b""
        if not most:
            self._passed(size)
        elif size > most:
            raise _Damaged(f"{size} bytes stand where at most {most} should")
        else:
            data = self._taken(size)
        for _ in self._pieces(-size % 8):  # padding, which may lack at the end
            pass
        return kind, size, data

    def _word(self) -> int:
        return int.from_bytes(self._taken(4), self.order)

    def _taken(self, count: int) -> bytes:
        data = b"".join(self._pieces(count))
        if len(data) < count:
            raise _Damaged(_CUT)
        return data

    def _passed(self, count: int) -> None:
        if sum(map(len, self._pieces(count))) < count:
            raise _Damaged(_CUT)

    def _pieces(self, count: int) -> Iterator[bytes]:
        """The next bytes, piece by piece; fewer at the end."""
        while count:
            if self.place == len(self.block):
                block = next(self.blocks, None)
                if block is None:
                    return
                self.block, self.place = block, 0
            piece = self.block[self.place : self.place + count]
            self.place += len(piece)
            count -= len(piece)
            yield piece


def _check_empty(members: int) -> None:
    if members > MOST_EMPTY:
        raise _Damaged(f"an array of {members} members without a byte for them")
