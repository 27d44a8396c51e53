"""Ctrl-C, `kill` and a closed terminal end a run in good order."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Stop:
    """What somebody has told the run: to stop, then to give up trying to make the bench safe.

    leaving: whether the run is already making everything safe; told: whether a signal came since then
    """

    def __init__(self) -> None:
        self.leaving, self.told = False, False
        self._holding, self._held = False, ""

    def leave(self) -> None:
        """From now on a signal does not interrupt; it only says to give up."""
        self.leaving = True

    def heard(self, number: int, frame: FrameType | None) -> None:
        """A signal: the first raises KeyboardInterrupt.

        Not an Exception: the libraries underneath catch those and go on.
        """
        if self.leaving:
            self.told = True
        elif self._holding:
            self._held = signal.Signals(number).name
        else:
            self._interrupt(signal.Signals(number).name)

    @contextmanager
    def held(self) -> Iterator[None]:
        """What is done in the block is done whole: a signal interrupts at its end."""
        self._holding = True
        try:
            yield
        finally:
            self._holding = False
            if self._held:
                self._interrupt(self._held)

    def _interrupt(self, name: str) -> None:
        self.leaving = True
        raise KeyboardInterrupt(f"stopped by {name}")


@contextmanager
def stoppable() -> Iterator[Stop]:
    """Signals go to a `Stop` until the end of the block. Main thread only."""
    stop = Stop()
    before = {number: signal.signal(number, stop.heard) for number in SIGNALS}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
