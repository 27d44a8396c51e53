"""A line on the terminal that says what is being done and for how long, before anything heavy is imported.

It stands on stderr, is drawn again every TICK_S by a thread, and gives way to whatever else is written: the
first line, of a program that starts, for good; the line of a stage until the next tick.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

AFTER_S = 0.3  # what is over sooner shows nothing
TICK_S = 0.2
_SPINNER = "⠋⠙⠹⠸⠼⠴⠦⠧⠇⠏"
_PLAIN = "|/-\\"  # where stderr has no braille
_shown: Sign | None = None  # at most one stands on the terminal


class Sign:
    """One line: `says` is asked for it at every tick.

    stays: it comes back after something else was written; otherwise that ends it.
    """

    def __init__(self, says: Callable[[], str], stays: bool, after_s: float) -> None:
        self.says, self.stays, self.after_s = says, stays, after_s
        self.process, self.width, self.ticks = os.getpid(), 0, 0
        self.at_line_start, self.over = True, threading.Event()
        self.terminal, self.lock = sys.stderr, threading.RLock()
        self.saved = (sys.stdout, sys.stderr)
        sys.stdout, sys.stderr = (
            _GivesWay(each, self) if each is not None and each.isatty() else each for each in self.saved
        )
        threading.Thread(target=self._draw_on, daemon=True).start()

    def _draw_on(self) -> None:
        wait = self.after_s
        while not self.over.wait(wait):
            with self.lock:
                if self.at_line_start and not self.over.is_set():
                    self._draw()
            wait = TICK_S

    def _draw(self) -> None:
        spinner = _SPINNER if "utf" in (self.terminal.encoding or "").lower() else _PLAIN
        self.ticks += 1
        text = f"{spinner[self.ticks % len(spinner)]} {self.says()}"[: _columns(self.terminal) - 1]
        self._put(f"\r{text}{' ' * (self.width - len(text))}")
        self.width = len(text)

    def _put(self, text: str) -> None:
        try:
            self.terminal.write(text)
            self.terminal.flush()
        except (OSError, ValueError):  # the terminal has gone: nobody is left to be told
            self.over.set()

    def give_way(self, ends_line: bool) -> None:
        """Take the line away: something else is written now; ends_line: a new line follows it."""
        if os.getpid() != self.process:  # a forked worker: it has no thread, and maybe our locked lock
            return
        with self.lock:
            self._erase()
            self.at_line_start = ends_line
            if not self.stays:
                self.over.set()

    def _erase(self) -> None:
        if self.width:
            self._put(f"\r{' ' * self.width}\r")
        self.width = 0

    def end(self) -> None:
        """Take the line away for good, and give back the streams.

        Never while one of them is written to: print holds no reference to what it writes to.
        """
        global _shown
        with self.lock:
            self._erase()
            self.over.set()
            for name, own in zip(("stdout", "stderr"), self.saved, strict=True):
                if getattr(getattr(sys, name), "sign", None) is self:
                    setattr(sys, name, own)
            _shown = None if _shown is self else _shown


class _GivesWay:
    """A stream to a terminal on which a sign stands: whoever writes finds the line empty."""

    _ASKS = frozenset({"isatty", "fileno", "encoding", "errors", "closed", "name", "mode"})

    def __init__(self, stream: Any, sign: Sign) -> None:
        self.stream, self.sign = stream, sign

    def write(self, text: str) -> int:
        """Write after the sign has given way."""
        if text:
            self.sign.give_way(text.endswith(("\n", "\r")))
        return int(self.stream.write(text))

    def flush(self) -> None:
        """Write out what is waiting; the line of a stage may stand meanwhile, that of a start may not."""
        if not self.sign.stays:
            self.sign.give_way(True)  # maybe a question follows, which python writes past us
        self.stream.flush()

    def __getattr__(self, name: str) -> Any:
        if name not in self._ASKS:
            self.sign.give_way(True)
        return getattr(self.stream, name)


def _columns(stream: Any) -> int:
    try:
        return os.get_terminal_size(stream.fileno()).columns or 80
    except (OSError, ValueError):
        return 80


def wanted(arguments: list[str]) -> bool:
    """Whether lines that come and go are for anybody: on a terminal, without --quiet, --verbose, NO_COLOR."""
    if "--quiet" in arguments or "--verbose" in arguments or "NO_COLOR" in os.environ:
        return False
    return sys.stderr is not None and sys.stderr.isatty() and os.environ.get("TERM") != "dumb"


def starting(arguments: list[str]) -> None:
    """Say that the program works, until it says something itself."""
    global _shown
    if wanted(arguments) and _shown is None:
        began = time.monotonic()
        _shown = Sign(lambda: f"working ({time.monotonic() - began:.0f} s)", stays=False, after_s=AFTER_S)


@contextmanager
def showing(says: Callable[[], str]) -> Iterator[None]:
    """A line for a stage, in place of the one that may stand; after it, until something else is written."""
    global _shown
    ended()
    _shown = Sign(says, stays=True, after_s=0.0)
    try:
        yield
    finally:
        ended()
    _shown = Sign(says, stays=False, after_s=AFTER_S)


def ended() -> None:
    """Nothing stands on the terminal any more."""
    if _shown is not None:
        _shown.end()
