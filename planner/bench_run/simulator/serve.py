"""The simulated bench in a terminal: says where it listens, writes down what it hears, ends in good order."""

from __future__ import annotations

import json
import signal
import threading
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from planner.bench_run.simulator.server import SimulatedBench
from planner.errors import InputError

Note = Callable[[float, str, str, str | None], None]


def serve(
    make: Callable[[Note | None], SimulatedBench],
    log: Path | None,
    say: Callable[[dict[str, Any], str], None],
) -> None:
    """Serve until SIGINT or SIGTERM. Raises InputError when the log cannot be written."""
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *unused: stop.set())
    with ExitStack() as stack:
        note = None if log is None else _notes(log, stack)
        bench = stack.enter_context(make(note))
        ports = bench.ports
        where = {name: f"TCPIP::127.0.0.1::{getattr(ports, name)}::SOCKET" for name in ("table", "chamber")}
        text = "\n".join(f"{name:8} {resource}" for name, resource in where.items())
        say({**where, "clock_port": ports.clock}, f"{text}\nclock    port {ports.clock}")
        stop.wait()


def _notes(log: Path, stack: ExitStack) -> Note:
    try:
        file = stack.enter_context(log.open("w", encoding="utf-8", buffering=1))
    except OSError as error:
        raise InputError(f"cannot write {log}: {error.strerror}") from error

    def note(time_s: float, device: str, message: str, reply: str | None) -> None:
        line = {"time_s": round(time_s, 6), "device": device, "message": message, "reply": reply}
        file.write(json.dumps(line) + "\n")

    return note
