"""Faults on purpose, so that what the runner does about them can be tried.

`NAME@N` happens at the N-th message (from 1) that the device gets, `NAME@N+` from then on; refused is the
first command from there that is no question. Names are of the table; with `chamber.` in front, of that.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

TABLE = ("lost_reply", "refused_command", "stuck_axis", "dropped_connection")
CHAMBER = ("lost_reply", "refused_command", "never_settles", "dropped_connection")


class Device(Protocol):
    """What answers messages: a table or a chamber."""

    def receive(self, message: str) -> str | None:
        """The reply to a message, None when there is none."""
        ...

    def refuse(self, message: str) -> str | None:
        """The reply of a device that does not obey."""
        ...


@dataclass(frozen=True)
class InjectedFault:
    """One fault. device: `table` or `chamber`; onwards: at every message from the N-th on."""

    device: str
    name: str
    message: int
    onwards: bool = False

    def happens(self, message: int) -> bool:
        """Whether it happens at this message."""
        return message == self.message or (self.onwards and message > self.message)


def fault_from_text(text: str) -> InjectedFault:
    """`lost_reply@120`, `chamber.never_settles@3`. Raises ValueError that says what is possible."""
    match = re.fullmatch(r"(?:(table|chamber)\.)?([a-z_]+)@(\d{1,9})(\+?)", text)
    device = (match[1] or "table") if match else "table"
    known = TABLE if device == "table" else CHAMBER
    if match is None or match[2] not in known or int(match[3]) < 1:
        names = ", ".join([*TABLE, *(f"chamber.{name}" for name in CHAMBER)])
        raise ValueError(f"no fault {text!r}; write NAME@MESSAGE such as lost_reply@120, NAME one of {names}")
    return InjectedFault(device, match[2], int(match[3]), bool(match[4]))


class Faulty:
    """A device with faults in it. Raises ConnectionResetError when the connection drops."""

    def __init__(self, device: Device, faults: Sequence[InjectedFault]) -> None:
        self.device, self._faults, self._count = device, tuple(faults), 0
        self._refusing = False

    def receive(self, message: str) -> str | None:
        """The device's reply, or what the faults make of it."""
        self._count += 1
        names = {fault.name for fault in self._faults if fault.happens(self._count)}
        if "dropped_connection" in names:
            raise ConnectionResetError("connection dropped by fault injection")
        for name, action in (("stuck_axis", "seize"), ("never_settles", "stall")):
            if name in names:
                getattr(self.device, action)()
        self._refusing = self._refusing or "refused_command" in names
        if self._refusing and not message.partition(" ")[0].endswith("?"):
            self._refusing = False
            return self.device.refuse(message)
        reply = self.device.receive(message)
        return None if "lost_reply" in names else reply
