"""The unit's own stream of 34-byte packets (K 3.1, figure 3.4), through lost and damaged bytes.

byte 0 prefix 0x1b; 1-12 W1 W2 W3 float32; 13-24 A1 A2 A3 float32; 25-30 T1 T2 T3 int16; 31 L mark, uint8;
32 C ready, 1 or 3; 33 CRC-8 of the bytes before it: polynomial 0xCD, initial value 0x55, final xor 0x96;
least significant byte first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from planner.errors import InputError
from planner.protocols import RawBlock

Bytes = NDArray[np.uint8]
LENGTH = 34
PREFIX = 0x1B
READY = (1, 3)
POLYNOMIAL, INITIAL, FINAL = 0xCD, 0x55, 0x96
PACKET = np.dtype(
    [("P", "u1"), ("W", "<f4", 3), ("A", "<f4", 3), ("T", "<i2", 3), ("L", "u1"), ("C", "u1"), ("CS", "u1")]
)
NAMES = ("W1", "W2", "W3", "A1", "A2", "A3", "T1", "T2", "T3", "L", "C")
CHUNK_BYTES = 120_000 * LENGTH  # 4 MB: stays in the cache, two minutes at 1 kHz


@dataclass(frozen=True)
class Packets:
    """Whole packets of a piece of a stream, and what lay between them.

    packets: (n,) of dtype PACKET; offset: (n,) byte of each in the piece
    skipped: bytes that belong to no whole packet; used: bytes of the piece that are done with
    """

    packets: NDArray[np.void]
    offset: NDArray[np.int64]
    skipped: int
    used: int


@lru_cache(maxsize=1)
def _pair_table() -> NDArray[np.uint8]:
    """CRC register after two bytes: index (register xor first byte) + 256 · second byte."""
    one: NDArray[np.uint16] = np.arange(256, dtype=np.uint16)
    for _ in range(8):
        one = (np.where(one & 0x80, (one << 1) ^ POLYNOMIAL, one << 1) & 0xFF).astype(np.uint16)
    first, second = np.meshgrid(np.arange(256), np.arange(256))
    table = one[one[first] ^ second].astype(np.uint8).reshape(-1)
    table.setflags(write=False)
    return np.asarray(table)


def crc8(rows: Bytes) -> Bytes:
    """(n,) CRC-8 of (n, k) bytes, k odd: polynomial 0xCD, initial value 0x55, final xor 0x96 (K 3.1).

    Two bytes at a time: the register after bytes a, b is one[one[r ^ a] ^ b].
    """
    table = _pair_table()
    # an odd byte comes first: with register 0 the pair (0, INITIAL ^ byte) is that single byte
    index = (rows[:, 0] ^ np.uint8(INITIAL)).astype(np.uint16) << 8
    register = table[index]
    for column in range(1, rows.shape[1], 2):
        pair = (rows[:, column + 1].astype(np.uint16) << 8) | (rows[:, column] ^ register)
        register = table[pair]
    return np.asarray(register ^ np.uint8(FINAL))


def _whole(rows: Bytes) -> NDArray[np.bool_]:
    """(n,) which of the (n, 34) byte rows are packets: prefix, ready sign, checksum."""
    looks = (rows[:, 0] == PREFIX) & ((rows[:, 32] == READY[0]) | (rows[:, 32] == READY[1]))
    if looks.all():
        return np.asarray(crc8(rows[:, :33]) == rows[:, 33])
    looks[looks] = crc8(rows[looks, :33]) == rows[looks, 33]
    return np.asarray(looks)


def find_packets(data: Bytes, last: bool = True) -> Packets:
    """All whole packets in a piece of the stream; `last`: no more bytes will follow.

    A piece that is packets from end to end is viewed, not copied. After damage every byte is a candidate; the
    earliest wins, and the next must begin behind it.
    """
    count = len(data) // LENGTH
    rows = data[: count * LENGTH].reshape(count, LENGTH)
    if count and _whole(rows).all():
        rest = len(data) - count * LENGTH if last else 0
        offset = np.arange(count, dtype=np.int64) * LENGTH
        return Packets(rows.reshape(-1).view(PACKET), offset, rest, len(data) if last else count * LENGTH)
    offset = _apart(_candidates(data))
    end = int(offset[-1]) + LENGTH if len(offset) else 0
    # without more bytes to come everything is done with; else a packet may begin in the last 33 bytes
    used = len(data) if last else max(end, len(data) - LENGTH + 1, 0)
    rows = data[offset[:, None] + np.arange(LENGTH)] if len(offset) else np.zeros((0, LENGTH), np.uint8)
    packets = np.ascontiguousarray(rows).reshape(-1).view(PACKET)
    return Packets(packets, offset, used - len(offset) * LENGTH, used)


def _candidates(data: Bytes) -> NDArray[np.int64]:
    """Bytes at which a whole packet begins, also those that overlap."""
    if len(data) < LENGTH:
        return np.zeros(0, dtype=np.int64)
    ready = data[32 : len(data) - 1]
    looks = (data[: len(ready)] == PREFIX) & ((ready == READY[0]) | (ready == READY[1]))
    place = np.flatnonzero(looks)
    rows = data[place[:, None] + np.arange(LENGTH)]
    return np.asarray(place[crc8(rows[:, :33]) == rows[:, 33]])


def _apart(place: NDArray[np.int64]) -> NDArray[np.int64]:
    """The earliest of those that overlap, from the left."""
    if not (np.diff(place) < LENGTH).any():
        return place
    kept, free = [], 0
    for start in place.tolist():
        if start >= free:
            kept.append(start)
            free = start + LENGTH
    return np.array(kept, dtype=np.int64)


class PacketReader:
    """Columns W1 … C. Bytes between packets are counted; whole lengths of 34 among them move the clock."""

    name = "packets"
    suffixes = (".bin", ".pkt", ".raw")

    def recognises(self, path: Path, head: bytes) -> bool:
        """Whether the first kilobytes hold at least two whole packets."""
        return len(find_packets(np.frombuffer(head, dtype=np.uint8)).offset) >= 2

    def names(self, path: Path, skip_lines: int = 0) -> tuple[str, ...]:
        """W1 W2 W3 A1 A2 A3 T1 T2 T3 L C."""
        return NAMES

    def blocks(
        self, path: Path, wanted: Sequence[str], texts: Sequence[str] = (), skip_lines: int = 0
    ) -> Iterator[RawBlock]:
        """The wanted columns. Raises InputError when not one whole packet is found."""
        found, sample, end = 0, 0, 0
        for start, piece in _pieces(path):
            place = piece.offset + start
            # n whole lengths between two packets were n packets, damaged; fewer bytes say nothing about time
            gap = np.diff(place, prepend=end - LENGTH if found else place[:1] - LENGTH) - LENGTH
            steps = 1 + np.maximum(gap, 0) // LENGTH
            number = sample + np.cumsum(steps) - 1
            lost = int((steps - 1).sum())
            losses = {"damaged_bytes": piece.skipped, "lost_packets": lost}
            remark = (f"{piece.skipped} bytes from byte {start} on belong to no whole packet",)
            yield RawBlock(
                {name: column(piece.packets, name) for name in wanted},
                number,
                {reason: count for reason, count in losses.items() if count},
                remark if piece.skipped else (),
            )
            if len(place):
                found, sample, end = found + len(place), int(number[-1]) + 1, int(place[-1]) + LENGTH
        if not found:
            raise InputError(f"{path} holds not one whole packet of {LENGTH} bytes with a right checksum")


def column(packets: NDArray[np.void], name: str) -> NDArray[np.float64]:
    """One column of packets as doubles, (n,)."""
    field = packets[name[0]] if name[1:] == "" else packets[name[0]][:, int(name[1:]) - 1]
    return np.asarray(field, dtype=np.float64)


def _pieces(path: Path) -> Iterator[tuple[int, Packets]]:
    """(byte of the piece in the file, its packets); bytes of an unfinished packet go into the next one."""
    with path.open("rb") as file:
        rest, start = b"", 0
        while True:
            data = file.read(CHUNK_BYTES)
            last = len(data) < CHUNK_BYTES
            buffer = np.frombuffer(rest + data, dtype=np.uint8)
            piece = find_packets(buffer, last)
            yield start, piece
            if last:
                return
            rest = buffer[piece.used :].tobytes()
            start += piece.used


READER = PacketReader()
