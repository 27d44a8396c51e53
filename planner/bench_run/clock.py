"""The time that waits are counted in: the wall's, the wall's faster, or a simulator's."""

from __future__ import annotations

import socket
import time
from typing import Protocol

from planner.bench_run.errors import ClockGone
from planner.errors import InputError


class Clock(Protocol):
    """Seconds that never go back, and waiting in them. speed: of them in a second of the wall."""

    speed: float

    def now(self) -> float:
        """Seconds since some moment."""
        ...

    def sleep(self, seconds: float) -> None:
        """Come back when the time has passed."""
        ...


def _wall_s() -> float:
    """Seconds that count on while the computer is suspended; CLOCK_MONOTONIC of Linux does not."""
    boot = getattr(time, "CLOCK_BOOTTIME", None)
    return time.monotonic() if boot is None else time.clock_gettime(boot)


class WallClock:
    """The wall's time; speed: seconds of the campaign per second of the wall, for simulators only."""

    def __init__(self, speed: float = 1.0) -> None:
        self.speed, self._start = speed, _wall_s()

    def now(self) -> float:
        """Seconds since the clock was made."""
        return self.speed * (_wall_s() - self._start)

    def sleep(self, seconds: float) -> None:
        """Wait."""
        time.sleep(max(seconds, 0.0) / self.speed)


class SimulatorClock:
    """The clock of `planner bench-simulator`, or of several: a wait moves their virtual time at once.

    The time is the first one's. Raises InputError when nobody listens there, ClockGone when one goes away.
    """

    speed = 1.0

    def __init__(self, *ports: int, host: str = "127.0.0.1") -> None:
        self._sockets = [_connected(port, host) for port in ports]
        self._files = [one.makefile("rb") for one in self._sockets]
        self._now = self._ask("NOW?")

    def now(self) -> float:
        """The simulator's time at the last wait: nobody else moves it."""
        return self._now

    def sleep(self, seconds: float) -> None:
        """Move the time on."""
        self._now = self._ask(f"SLEEP {max(seconds, 0.0)!r}")

    def close(self) -> None:
        """Give the clocks back to the wall."""
        for one in self._sockets:
            one.close()

    def _ask(self, message: str) -> float:
        try:
            for one in self._sockets:
                one.sendall(message.encode() + b"\n")
            times = [float(file.readline()) for file in self._files]  # every one must answer
            return times[0]
        except (OSError, ValueError) as error:
            raise ClockGone("the simulator's clock has gone") from error


def _connected(port: int, host: str) -> socket.socket:
    try:
        found = socket.create_connection((host, port), timeout=30.0)
    except (OSError, OverflowError) as error:
        raise InputError(f"no simulator's clock on port {port} of {host}: {error}") from error
    found.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return found
