"""A line to a simulated device in the same process: the tests' transport, in virtual time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol


class VirtualClock:
    """Time that passes only when somebody sleeps; a whole campaign takes as long as its arithmetic."""

    speed = 1.0

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        """Seconds since the clock was made."""
        return self._now

    def sleep(self, seconds: float) -> None:
        """Let time pass. Raises ValueError for a negative time."""
        if seconds < 0:
            raise ValueError(f"time does not go back: {seconds} s")
        self._now += seconds


class _Receiver(Protocol):
    def replies(self, message: str) -> Sequence[tuple[float, str]]: ...


class MemoryLine:
    """Sends to a device and hands out its replies when they are due; waiting for one takes virtual time.

    Replies of an earlier connection never arrive, as with TCP; keeps: they do, as from a terminal server.
    """

    def __init__(self, device: _Receiver, clock: VirtualClock, *, keeps: bool = False) -> None:
        self._device, self._clock, self._keeps = device, clock, keeps
        self._replies: list[tuple[float, str]] = []
        self._open = True
        self.sent: list[tuple[float, str]] = []

    def write(self, message: str) -> None:
        """Send one message. Raises ConnectionError when the line is down."""
        if not self._open:
            raise ConnectionResetError("the line is down")
        self.sent.append((self._clock.now(), message))
        try:
            replies = self._device.replies(message)
        except ConnectionError:
            self._open = False
            raise
        now = self._clock.now()
        for delay, text in replies:  # one after the other: what is late makes what follows late
            before = self._replies[-1][0] if self._replies else now
            self._replies.append((max(now + delay, before), text))

    def read(self, within_s: float) -> str:
        """The next reply. Raises TimeoutError when none comes."""
        if not self._open:
            raise ConnectionResetError("the line is down")
        if not self._replies or self._replies[0][0] > self._clock.now() + within_s:
            self._clock.sleep(within_s)
            raise TimeoutError("no reply")
        when, text = self._replies.pop(0)
        self._clock.sleep(max(when - self._clock.now(), 0.0))
        return text

    def drain(self, listen_s: float, at_most: int = 0) -> int:
        """Throw away what has come, and what comes in the next seconds."""
        end, found = self._clock.now() + listen_s, 0
        while self._replies and self._replies[0][0] <= end and (not at_most or found < at_most):
            when, _ = self._replies.pop(0)
            self._clock.sleep(max(when - self._clock.now(), 0.0))
            found += 1
        if found < at_most or not at_most:
            self._clock.sleep(max(end - self._clock.now(), 0.0))
        return found

    def reopen(self) -> None:
        """Connect again. Raises ConnectionError while the device cannot be reached."""
        if not self._keeps:
            self._replies.clear()
        if getattr(self._device, "unreachable", False):
            self._open = False
            raise ConnectionRefusedError("nobody listens")
        self._open = True

    def close(self) -> None:
        """Hang up."""
        self._open = False
