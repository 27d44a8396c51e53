"""kill -9 at random moments of an export, again and again, and what must hold after each."""

from __future__ import annotations

import os
import random
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from planner.export.files import write_all_whole

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
        for path in folder.iterdir():
            if path.name.startswith("."):
                path.unlink()
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
    """Every file that a user sees is one version's, byte for byte, and none is missing."""
    seen = {path.name: path.read_bytes() for path in folder.iterdir() if not path.name.startswith(".")}
    assert set(seen) == set(versions[0])
    for name, content in seen.items():
        assert any(content == version[name] for version in versions), f"{name} is torn"
    return len(seen)


def _write(folder: Path, version: Files) -> None:
    write_all_whole({folder / name: content for name, content in version.items()})


def _seconds(work: Callable[[], None]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start
