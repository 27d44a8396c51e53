"""A line to an instrument, and asking over it: replies may be lost, so questions are put again."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol, TypeVar

from planner.bench_run.errors import BenchFault

TRIES = 3  # a lost reply happens; three in a row are a fault
Answer = TypeVar("Answer")


class Line(Protocol):
    """Messages out, replies in.

    `read` raises TimeoutError when no reply comes; all raise ConnectionError when the line is down.
    """

    def write(self, message: str) -> None:
        """Send one message."""
        ...

    def read(self) -> str:
        """The next reply, without its line end."""
        ...

    def clear(self) -> None:
        """Throw away replies that nobody waits for, late ones too."""
        ...

    def reopen(self) -> None:
        """Connect again after the line went down."""
        ...

    def close(self) -> None:
        """Hang up."""
        ...


def send(line: Line, who: str, message: str) -> None:
    """Send a message. Raises BenchFault when the line is down."""
    try:
        line.write(message)
    except OSError as error:
        raise BenchFault(f"the connection to the {who} dropped at {message!r}: {error}") from error


def ask(line: Line, who: str, question: str, understand: Callable[[str], Answer]) -> Answer:
    """The reply to a question, understood; asked again when it is lost or garbled (asking changes nothing).

    Raises BenchFault when the line is down or nothing sensible comes back.
    """
    heard = "no reply"
    for _ in range(TRIES):
        send(line, who, question)
        try:
            text = line.read()
            return understand(text)
        except TimeoutError:
            heard = "no reply"
        except ValueError:
            heard = f"the reply {text!r}"
        except OSError as error:
            raise BenchFault(f"the connection to the {who} dropped at {question!r}: {error}") from error
        _clear(line, who)
    raise BenchFault(f"the {who} gave {heard} to {question!r}, {TRIES} times")


def _clear(line: Line, who: str) -> None:
    try:
        line.clear()
    except OSError as error:
        raise BenchFault(f"the connection to the {who} dropped: {error}") from error


def last_number(text: str) -> float:
    """The last number of a reply: some controllers repeat the axis first. Raises ValueError without one."""
    value = float(text.replace(",", " ").rpartition(" ")[2])
    if not math.isfinite(value):
        raise ValueError(text)
    return value
