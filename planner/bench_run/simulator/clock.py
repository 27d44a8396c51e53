"""The bench's time: moved by the wall clock, or by a client over TCP."""

from __future__ import annotations

import time


class ServedClock:
    """Wall time by a factor, until a client takes over and moves it step by step.

    speed: virtual seconds per wall second. While `stepped` is true only `sleep` moves the time, so that a
    campaign over TCP sees the same angles at the same times however slow the network is.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self.speed = speed
        self._passed, self._since, self._stepped = 0.0, time.monotonic(), False

    def now(self) -> float:
        """Virtual seconds since the clock was made."""
        if self._stepped:
            return self._passed
        return self._passed + self.speed * (time.monotonic() - self._since)

    def sleep(self, seconds: float) -> None:
        """Let virtual time pass at once. Raises ValueError for a negative time."""
        if not seconds >= 0:
            raise ValueError(f"time does not go back: {seconds} s")
        self._passed += seconds

    @property
    def stepped(self) -> bool:
        """Whether only `sleep` moves the time."""
        return self._stepped

    @stepped.setter
    def stepped(self, on: bool) -> None:
        self._passed, self._since, self._stepped = self.now(), time.monotonic(), on
