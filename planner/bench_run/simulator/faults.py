"""Faults on purpose, so that what the runner does about them can be tried.

`NAME@N` happens at the N-th message (from 1) that the device gets, `NAME@N+` from then on, `NAME@N..M` until
the M-th; some take seconds or a size, `late_reply:2.4@9`. `refused_command` and `ignored_command` are of the
first order from there. Names are of the table; with `chamber.` in front, of that.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

BOTH: Mapping[str, float | None] = {  # name -> the amount when none is given; None: it takes none
    "lost_reply": None,
    "late_reply": 2.4,  # s
    "doubled_reply": None,
    "garbled_reply": None,
    "nan_reading": None,
    "frozen_reading": None,
    "jumped_reading": 40.0,  # deg, deg/s or K
    "refused_command": None,
    "ignored_command": None,
    "dropped_connection": 0.0,  # s for which nobody answers
    "power_cut": 60.0,  # s for which nobody answers
    "suspended_client": 1560.0,  # s
    "full_disk": None,
}
TABLE: Mapping[str, float | None] = {**BOTH, "stuck_axis": None}
CHAMBER: Mapping[str, float | None] = {**BOTH, "never_settles": None}
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?")
_FORM = re.compile(r"(?:(table|chamber)\.)?([a-z_]+)(?::([\d.]+))?@(\d{1,9})(\+|\.\.(\d{1,9}))?")
Now = Callable[[], float]
Reply = tuple[float, str]  # seconds that it is late, and what it says


class Device(Protocol):
    """What answers messages: a table or a chamber."""

    def receive(self, message: str) -> str | None:
        """The reply to a message, None when there is none."""
        ...

    def refuse(self, message: str) -> str | None:
        """The reply of a device that does not obey."""
        ...

    def cut(self) -> None:
        """The mains go."""
        ...


class Client(Protocol):
    """Whoever talks to the devices; things can happen to it too."""

    def suspend(self, seconds: float) -> None:
        """It is stopped, and goes on later."""
        ...

    def fill_disk(self) -> None:
        """It can write nothing any more."""
        ...


class NoClient:
    """A client to which nothing can happen."""

    def suspend(self, seconds: float) -> None:
        """Nothing."""

    def fill_disk(self) -> None:
        """Nothing."""


@dataclass(frozen=True)
class InjectedFault:
    """One fault. device: `table` or `chamber`; first, last: the messages at which it happens."""

    device: str
    name: str
    first: int
    last: float
    amount: float = 0.0

    def happens(self, message: int) -> bool:
        """Whether it happens at this message."""
        return self.first <= message <= self.last


def fault_from_text(text: str) -> InjectedFault:
    """`lost_reply@120`, `chamber.late_reply:2.4@3`. Raises ValueError that says what is possible."""
    match = _FORM.fullmatch(text)
    device = (match[1] or "table") if match else "table"
    known = TABLE if device == "table" else CHAMBER
    amount = _amount(match[3], known.get(match[2])) if match else None
    if match is None or match[2] not in known or int(match[4]) < 1 or amount is None:
        names = ", ".join([*TABLE, "chamber.never_settles"])
        raise ValueError(
            f"no fault {text!r}; write NAME@MESSAGE such as lost_reply@120 or late_reply:2.4@9, "
            f"chamber. in front for the chamber, NAME one of {names}"
        )
    first = int(match[4])
    last = float("inf") if match[5] == "+" else float(match[6] or first)
    return InjectedFault(device, match[2], first, last, amount)


def _amount(text: str | None, usual: float | None) -> float | None:
    """The amount that was given, or the usual one; None for what is no number, or not wanted."""
    if text is None:
        return usual or 0.0
    return float(text) if usual is not None and text.replace(".", "", 1).isdigit() else None


class Faulty:
    """A device with faults in it. Raises ConnectionResetError when the connection drops.

    now: () -> the bench's time in s
    """

    def __init__(
        self,
        device: Device,
        faults: Sequence[InjectedFault],
        client: Client | None = None,
        now: Now | None = None,
    ) -> None:
        self.device, self._faults, self._count = device, tuple(faults), 0
        self._client, self._now = client or NoClient(), now or (lambda: 0.0)
        self._orders: set[str] = set()  # what the next order meets
        self._shown: dict[str, str] = {}
        self._away_until = -1.0

    @property
    def unreachable(self) -> bool:
        """Whether nobody answers at present."""
        return self._now() < self._away_until

    def receive(self, message: str) -> str | None:
        """The reply, whenever it comes; None when there is none."""
        replies = self.replies(message)
        return replies[0][1] if replies else None

    def replies(self, message: str) -> list[Reply]:
        """The device's reply, or what the faults make of it."""
        self._count += 1
        now = {fault.name: fault.amount for fault in self._faults if fault.happens(self._count)}
        self._happen(now)
        is_question = message.partition(" ")[0].endswith("?")
        self._orders |= now.keys() & {"refused_command", "ignored_command"}
        if self._orders and not is_question:
            return self._unheard(message)
        reply = self.device.receive(message)
        if reply is None or "lost_reply" in now:
            return []
        if is_question and _is_reading(message):
            reply = self._misread(message, reply, now)
        if "garbled_reply" in now:
            reply = garbled(reply)
        made = (now.get("late_reply", 0.0), reply)
        return [made, made] if "doubled_reply" in now else [made]

    def _happen(self, now: Mapping[str, float]) -> None:
        """What becomes of client, connection and device."""
        if "suspended_client" in now:
            self._client.suspend(now["suspended_client"])
        if "full_disk" in now:
            self._client.fill_disk()
        for name, action in (("stuck_axis", "seize"), ("never_settles", "stall"), ("power_cut", "cut")):
            if name in now:
                getattr(self.device, action)()
        away = max(now.get("dropped_connection", -1.0), now.get("power_cut", -1.0))
        if away >= 0:
            self._away_until = self._now() + away
            raise ConnectionResetError("connection dropped by fault injection")

    def _unheard(self, message: str) -> list[Reply]:
        """An order that is refused, or ignored without a word of it."""
        kind = self._orders.pop()
        if kind == "refused_command":
            reply = self.device.refuse(message)
            return [] if reply is None else [(0.0, reply)]
        return [(0.0, f"OK:{message}")] if _acknowledges(self.device) else []

    def _misread(self, message: str, reply: str, now: Mapping[str, float]) -> str:
        if "frozen_reading" in now:
            return self._shown.setdefault(message, reply)
        self._shown[message] = reply
        if "nan_reading" in now:
            return _NUMBER.sub("nan", reply, count=1)
        if "jumped_reading" in now:
            return _NUMBER.sub(lambda n: f"{float(n[0]) + now['jumped_reading']:.4f}", reply, count=1)
        return reply


def garbled(reply: str) -> str:
    """What noise makes of a reply: half of it, with a sign that no number has."""
    return f"{reply[: len(reply) // 2]}#"


def _is_reading(message: str) -> bool:
    return message == "TEMP?" or ":read:" in message.lower()


def _acknowledges(device: Device) -> bool:
    return hasattr(device, "setpoint_degc")  # the chamber answers every message
