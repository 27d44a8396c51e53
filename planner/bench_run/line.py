"""A line to an instrument, and a conversation over it that knows whether an answer belongs to its question.

Most controllers do not say what they answer. A reply that comes after its time-out would be taken for the
answer to the next question, and every later one would be off by one. So nothing may wait unread when a
question goes out, an answer must have the shape of the question's, and after a reply that was lost, late,
doubled or garbled the connection is made anew. Every such moment counts as a doubt: a record in which there
was one is void.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from planner.bench_run.errors import BenchFault, LineLost, Silent
from planner.control.dialect import Dialect, fits, verb_of

TRIES = 3  # a lost reply happens; three in a row are a fault
QUIET_S = 0.2  # after connecting anew: what comes so soon is of the time before
SURE_S = 0.005  # after what decides: whether a second reply follows the first
Answer = TypeVar("Answer")


class Line(Protocol):
    """Messages out, replies in.

    `read` raises TimeoutError when no reply comes; all raise OSError when the line is down.
    """

    def write(self, message: str) -> None:
        """Send one message."""
        ...

    def read(self, within_s: float) -> str:
        """The next reply, without its line end; ValueError when it is no text."""
        ...

    def drain(self, listen_s: float, at_most: int = 0) -> int:
        """Throw away what has come and what comes in the next seconds; how many replies that were.

        at_most: come back as soon as so many have come; 0: listen to the end
        """
        ...

    def reopen(self) -> None:
        """Connect again, or for the first time."""
        ...

    def close(self) -> None:
        """Hang up."""
        ...


class Conversation:
    """One device, asked and told in its dialect. doubts: how often it was not sure what it heard.

    LineLost is raised when the line is down, BenchFault when nothing sensible comes back or an order is
    refused.
    """

    def __init__(self, line: Line, who: str, dialect: Dialect) -> None:
        self.line, self.who = line, who
        self.doubts = 0
        self._dialect, self._timing = dialect, dialect.connection

    def ask(self, question: str, understand: Callable[[str], Answer], tries: int = TRIES) -> Answer:
        """The answer; asked again when it is lost, garbled or impossible (asking changes nothing)."""
        heard = "no reply"
        for _ in range(tries):
            text = self._exchange(question)
            if text is None:
                heard = "no reply"
                continue
            try:
                return understand(text)
            except ValueError as error:
                heard = f"the reply {_brief(text)}, {error}," if str(error) else f"the reply {_brief(text)}"
                self.doubt()
        kind = Silent if heard == "no reply" else BenchFault
        raise kind(f"the {self.who} gave {heard} to {question!r}, {tries} times")

    def order(self, commands: Sequence[str]) -> None:
        """Send commands, and hear each message acknowledged where the device does that.

        Orders are absolute, so one whose acknowledgement is lost is sent again; when that is lost too it may
        or may not have been taken, and whoever gave it must look at what it has done.
        """
        for message in self._dialect.messages(commands):
            if self._dialect.acknowledgement is None:
                self._quiet()
                self._send(message)
            elif not self._told(message):
                self._told(message)

    def connect(self) -> None:
        """Connect anew; what belongs to the time before is thrown away."""
        self._down_at("connecting", self.line.reopen)
        self._down_at("connecting", lambda: self.line.drain(QUIET_S))

    def doubt(self, late: bool = False) -> None:
        """Something was heard that does not fit: listen for what is late, then connect anew."""
        self.doubts += 1
        if late:
            self._down_at("waiting", lambda: self.line.drain(self._timing.late_within, at_most=1))
        self.connect()

    def is_sure(self, listen_s: float = SURE_S) -> bool:
        """Whether nothing follows what was heard last; asked at moments that decide something."""
        if self._down_at("listening", lambda: self.line.drain(listen_s)):
            self.doubt()
            return False
        return True

    def _told(self, message: str) -> bool:
        """Whether a message was acknowledged. Raises BenchFault when it was refused."""
        text, words = self._exchange(message), self._dialect.acknowledgement
        if text is None or words is None:
            return False
        known = (("message", message), ("verb", verb_of(message)))
        if fits(words.refused, text, known):
            raise BenchFault(f"the {self.who} refused {message!r}: {text}")
        if not fits(words.accepted, text, known):
            self.doubt()
            return False
        return True

    def _exchange(self, message: str) -> str | None:
        """The reply to a message on a line that was quiet before; None when there is none in time."""
        self._quiet()
        self._send(message)
        try:
            return self._down_at(message, lambda: self.line.read(self._timing.reply_within))
        except TimeoutError:
            self.doubt(late=True)
        except ValueError:
            self.doubt()
        return None

    def _send(self, message: str) -> None:
        self._down_at(message, lambda: self.line.write(message))

    def _quiet(self) -> None:
        if self._down_at("listening", lambda: self.line.drain(0.0)):
            self.doubt()

    def _down_at(self, message: str, do: Callable[[], Answer]) -> Answer:
        try:
            return do()
        except TimeoutError:
            raise
        except OSError as error:
            raise LineLost(f"the connection to the {self.who} dropped at {message!r}: {error}") from error


def _brief(text: str) -> str:
    return repr(text if len(text) <= 60 else text[:60] + "…")
