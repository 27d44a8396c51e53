"""The packet stream: MB a second of the reader, whole and damaged, against the copy speed of memory.

Run as `python benchmarks/bench_packets.py`. Asserted before the time: the reader finds the packets that a
loop in plain Python finds with a checksum of its own, and every byte is counted.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # the other checksum is the tests' own

from planner.readers.packets import LENGTH, NAMES, PACKET, READER, crc8, find_packets
from tests.readers.streams import checksum

LEAST_MB_S = 50.0
PACKETS = 3_000_000  # 102 MB, 50 minutes at 1 kHz


def stream(count: int) -> np.ndarray:
    """(count · 34,) bytes."""
    rng = np.random.default_rng(1)
    rows = np.zeros(count, PACKET)
    rows["P"], rows["C"] = 0x1B, 1
    rows["W"], rows["A"] = rng.normal(size=(count, 3)), rng.normal(size=(count, 3))
    rows["T"] = rng.integers(-3000, 8000, (count, 3))
    data = rows.view("u1").reshape(count, LENGTH)
    data[:, 33] = crc8(data[:, :33])
    return data.reshape(-1)


def damaged(data: np.ndarray) -> np.ndarray:
    """One packet in 200 with a wrong byte, and one in 2000 with a byte missing."""
    rng = np.random.default_rng(2)
    hit = rng.choice(len(data) // LENGTH, len(data) // LENGTH // 200, replace=False)
    found = data.copy()
    found[hit * LENGTH + rng.integers(1, LENGTH, len(hit))] ^= 0x5A
    return np.delete(found, hit[::10] * LENGTH + 3)


def plain_packets(data: bytes) -> list[int]:
    """Bytes at which packets begin, one byte after the other."""
    found, at = [], 0
    while at + LENGTH <= len(data):
        if data[at] == 0x1B and data[at + 32] in (1, 3) and checksum(data[at : at + 33]) == data[at + 33]:
            found.append(at)
            at += LENGTH
        else:
            at += 1
    return found


def best(work: Callable[[], object], times: int = 3) -> float:
    found = []
    for _ in range(times):
        start = time.perf_counter()
        work()
        found.append(time.perf_counter() - start)
    return min(found)


def read(path: Path) -> tuple[int, int]:
    """(packets, bytes between them)."""
    blocks = [(len(b.sample), b.losses.get("damaged_bytes", 0)) for b in READER.blocks(path, NAMES)]
    return sum(count for count, _ in blocks), sum(lost for _, lost in blocks)


def main() -> int:
    small = damaged(stream(4000))
    assert find_packets(small).offset.tolist() == plain_packets(small.tobytes())
    whole = stream(PACKETS)
    copied = best(lambda: whole.copy())
    print(f"{'':24}{'s':>8}{'MB/s':>9}{'of copying':>12}")
    print(f"{'memory copy':24}{copied:8.3f}{len(whole) / copied / 1e6:9.0f}{1:12.3f}")
    slowest = np.inf
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "stream.bin"
        for name, data in (("whole stream", whole), ("damaged stream", damaged(whole))):
            data.tofile(path)
            count, lost = read(path)
            assert count * LENGTH + lost == len(data)
            assert name != "whole stream" or count == PACKETS
            seconds = best(lambda: read(path))
            speed = len(data) / seconds / 1e6
            print(f"{name:24}{seconds:8.3f}{speed:9.0f}{speed / (len(whole) / copied / 1e6):12.3f}")
            slowest = min(slowest, speed)
    print(f"least {slowest:.0f} MB/s, required {LEAST_MB_S:.0f}")
    return 0 if slowest >= LEAST_MB_S else 1


if __name__ == "__main__":
    sys.exit(main())
