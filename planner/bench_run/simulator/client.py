"""The process that talks to the simulator, on this machine: what can happen to it, on purpose (Linux).

A suspended client is stopped by SIGSTOP and goes on later; with the simulator's own clock the bench's time
passes meanwhile at once. A full disk is a limit of the size of its files: nothing more can be written.
"""

from __future__ import annotations

import os
import signal
import threading
from pathlib import Path

from planner.bench_run.simulator.clock import ServedClock


class ConnectedProcess:
    """Whoever is connected from a port of this machine."""

    def __init__(self, clock: ServedClock) -> None:
        self._clock, self.port = clock, 0

    def suspend(self, seconds: float) -> None:
        """Stop it for so many seconds of the bench's time."""
        pid = process_at(self.port)
        if self._clock.stepped or pid in (None, os.getpid()):
            self._clock.sleep(seconds)
            return
        assert pid is not None
        os.kill(pid, signal.SIGSTOP)
        threading.Timer(seconds / self._clock.speed, os.kill, (pid, signal.SIGCONT)).start()

    def fill_disk(self) -> None:
        """From now on its files cannot grow."""
        import resource

        pid = process_at(self.port)
        if pid is not None and pid != os.getpid():
            hard = resource.prlimit(pid, resource.RLIMIT_FSIZE)[1]
            resource.prlimit(pid, resource.RLIMIT_FSIZE, (0, hard))


def process_at(port: int) -> int | None:
    """The process that has this TCP port of ours open; None when nobody can tell."""
    inode = _inode(port)
    for folder in Path("/proc").glob("[0-9]*/fd") if inode else ():
        try:
            if any(os.readlink(link) == f"socket:[{inode}]" for link in folder.iterdir()):
                return int(folder.parent.name)
        except OSError:
            continue  # of somebody else, or gone meanwhile
    return None


def _inode(port: int) -> str | None:
    """/proc/net/tcp: local address and port in hex, state 01 (established), inode in the tenth column."""
    try:
        rows = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    except OSError:
        return None
    return next((row[9] for row in rows if row[1].endswith(f":{port:04X}") and row[3] == "01"), None)
