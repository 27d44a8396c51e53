"""The packet stream of the unit written by plain Python, byte by byte: an implementation of its own."""

from __future__ import annotations

import struct

import numpy as np


def checksum(data: bytes) -> int:
    """CRC-8, polynomial 0xCD, initial value 0x55, final xor 0x96, bit by bit."""
    register = 0x55
    for byte in data:
        register ^= byte
        for _ in range(8):
            register = ((register << 1) ^ 0xCD if register & 0x80 else register << 1) & 0xFF
    return register ^ 0x96


def packet(
    w: tuple[float, ...], a: tuple[float, ...], t: tuple[int, ...], mark: int = 0, ready: int = 1
) -> bytes:
    """34 bytes."""
    body = struct.pack("<B3f3f3hBB", 0x1B, *w, *a, *t, mark, ready)
    return body + bytes([checksum(body)])


def packets(count: int, seed: int = 1) -> list[bytes]:
    """A unit at rest; W1 is the number of the packet."""
    rng = np.random.default_rng(seed)
    return [
        packet(
            (k, *rng.normal(size=2)),
            tuple(rng.normal(size=3)),
            (2000 + k % 50, 0, -5),
            k % 256,
            1 + 2 * (k % 2),
        )
        for k in range(count)
    ]
