"""The program in a process of its own: what it takes; and the map of the unit's packet stream for it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

PACKET_MAP = """\
unit: imu7
rate: 1000 Hz
gyro: {x: W1, y: W2, z: W3, unit: deg/s}
acc: {x: A1, y: A2, z: A3, unit: g}
temperature: {column: T1, unit: degC, scale: 0.01}
"""
_MEASURED = """\
import sys, time
sys.argv = ["planner", *sys.argv[1:]]
from planner.cli import main
start = time.perf_counter()
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
seconds = time.perf_counter() - start
print(seconds, next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""


def measured(folder: Path, *arguments: str) -> tuple[float, int]:
    """Seconds of `planner` in `folder`, and the peak of its memory in kB.

    Of the process after exec, from /proc; getrusage would count what it was forked from.
    """
    done = subprocess.run(
        [sys.executable, "-c", _MEASURED, *arguments], cwd=folder, capture_output=True, text=True, check=True
    )
    seconds, kilobytes = done.stdout.splitlines()[-1].split()
    return float(seconds), int(kilobytes)
