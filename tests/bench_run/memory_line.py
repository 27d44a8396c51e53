"""A line to a simulated device in the same process: the tests' transport."""

from __future__ import annotations

from collections import deque
from typing import Protocol


class VirtualClock:
    """Time that passes only when somebody sleeps; a whole campaign takes as long as its arithmetic."""

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
    def receive(self, message: str) -> str | None: ...


class MemoryLine:
    """Sends to a device and hands out its replies; waiting for one that does not come takes virtual time."""

    def __init__(self, device: _Receiver, clock: VirtualClock, timeout_s: float = 2.0) -> None:
        self._device, self._clock, self._timeout_s = device, clock, timeout_s
        self._replies: deque[str] = deque()
        self._open = True
        self.sent: list[tuple[float, str]] = []

    def write(self, message: str) -> None:
        """Send one message. Raises ConnectionError when the line is down."""
        if not self._open:
            raise ConnectionResetError("the line is down")
        self.sent.append((self._clock.now(), message))
        try:
            reply = self._device.receive(message)
        except ConnectionError:
            self._open = False
            raise
        if reply is not None:
            self._replies.append(reply)

    def read(self) -> str:
        """The next reply. Raises TimeoutError when none comes."""
        if not self._replies:
            self._clock.sleep(self._timeout_s)
            raise TimeoutError("no reply")
        return self._replies.popleft()

    def clear(self) -> None:
        """Forget replies that nobody waits for."""
        self._replies.clear()

    def reopen(self) -> None:
        """Connect again."""
        self._replies.clear()
        self._open = True

    def close(self) -> None:
        """Hang up."""
        self._open = False
