"""kill -9 at random moments of an export, again and again, and what must hold after each."""

from __future__ import annotations

import os
import random
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from planner.whole_files import write_all_whole

Files = Mapping[str, bytes]


def exports_with_kills(folder: Path, versions: Sequence[Files], kills: int, seed: int) -> tuple[int, int]:
    """Kill processes that export one version after the other into a folder; look at every file each time.

    Returns how many died while a temporary file of theirs was there, and how many files were looked at.
    """
    rng, within, looked = random.Random(seed), 0, 0
    write_all_whole({folder / name: content for name, content in versions[0].items()})
    longest = _seconds(lambda: _write(folder, versions[0]))
    for _ in range(kills):
        one_life(folder, versions, rng, longest)
        within += any(path.name.startswith(".") for path in folder.iterdir())
        looked += check(folder, versions)
    _write(folder, versions[0])  # the next write sweeps what the dead have left
    assert not [path.name for path in folder.iterdir() if path.name.startswith(".")]
    return within, looked


def one_life(folder: Path, versions: Sequence[Files], rng: random.Random, longest_s: float) -> None:
    """A process that exports until it is killed, within its first few exports."""
    begins, tells = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.write(tells, b"!")
            while True:
                for version in versions:
                    _write(folder, version)
        finally:
            os._exit(1)
    os.close(tells)
    assert os.read(begins, 1) == b"!"
    os.close(begins)
    time.sleep(rng.random() * 3 * longest_s)
    os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    assert os.WIFSIGNALED(status), "the export failed instead of being killed"


def check(folder: Path, versions: Sequence[Files]) -> int:
    """What a user sees is one version, whole: every file of it, byte for byte, and of no other version."""
    for _ in range(2):  # the set may be on its way just now
        seen = {path.name: path.read_bytes() for path in folder.iterdir() if not path.name.startswith(".")}
        if any(seen == version for version in versions):
            return len(seen)
        time.sleep(0.05)
    raise AssertionError("a file is torn, or the set is of two versions")


def _write(folder: Path, version: Files) -> None:
    write_all_whole({folder / name: content for name, content in version.items()})


def _seconds(work: Callable[[], None]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start
