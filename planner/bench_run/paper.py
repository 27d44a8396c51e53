"""Instruments on paper: they speak any dialect, obey at once, and are where they are told to be."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Protocol

from planner.control.dialect import ChamberDialect, Dialect, Question, TableDialect, filled, matched, verb_of
from planner.control.words import figure

AIR_K_PER_S = 10.0 / 60.0


class PaperClock:
    """Waits take no time."""

    speed = 1.0

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        """Seconds that have been waited."""
        return self._now

    def sleep(self, seconds: float) -> None:
        """Count them."""
        self._now += seconds


class Device(Protocol):
    """What is asked and told, in words of its dialect."""

    who: str

    @property
    def dialect(self) -> Dialect:
        """What it speaks."""
        ...

    def asked(self, message: str) -> str | None:
        """The answer to a question; None for what is none."""
        ...

    def told(self, command: str) -> None:
        """Obey."""
        ...


class PaperLine:
    """A line to a device on paper; `say` hears every order."""

    def __init__(self, device: Device, say: Callable[[str], None]) -> None:
        self._device, self._say, self._reply = device, say, ""

    def write(self, message: str) -> None:
        """Say an order, or keep the answer to a question."""
        answer = self._device.asked(message)
        if answer is not None:
            self._reply = answer
            return
        self._say(f"{'':12}{self._device.who:7} {message}")
        join = self._device.dialect.connection.join
        for command in message.split(join) if join else [message]:
            self._device.told(command)
        words = self._device.dialect.acknowledgement
        if words is not None:
            self._reply = filled(words.accepted[0], message=message, verb=verb_of(message), any="")

    def read(self, within_s: float) -> str:
        """The answer to the last message."""
        return self._reply

    def drain(self, listen_s: float, at_most: int = 0) -> int:
        """Nothing comes late on paper."""
        return 0

    def reopen(self) -> None:
        """Nothing drops on paper."""

    def close(self) -> None:
        """Nothing."""


class PaperTable:
    """Axes that are at once where, or turn as, they are told."""

    who = "table"

    def __init__(self, dialect: TableDialect, clock: PaperClock) -> None:
        self._dialect, self._clock = dialect, clock
        self._axes: dict[str, tuple[float, float, float]] = {}  # since when, from where, at what rate

    @property
    def dialect(self) -> TableDialect:
        """What it speaks."""
        return self._dialect

    def asked(self, message: str) -> str | None:
        """Angles and rates as they are; nothing is ever wrong."""
        questions = self.dialect.questions
        for question in (q for q in vars(questions).values() if q is not None):
            axis = _axis(question.ask, message)
            if axis is None:
                continue
            since, start, rate = self._axes.get(axis, (0.0, 0.0, 0.0))
            units, here = self.dialect.units, start + rate * (self._clock.now() - since)
            value = units.sent("rate", rate) if question is questions.rate else units.sent("position", here)
            code = question.good[0] if question.good else "0"
            return _answer(question, axis=axis, value=figure(value, 6), code=code)
        return None

    def told(self, command: str) -> None:
        """Go, turn or stop."""
        orders, now = self.dialect.orders, self._clock.now()
        here = {axis: at + rate * (now - since) for axis, (since, at, rate) in self._axes.items()}
        if command in orders.stop_all:
            self._axes = {axis: (now, at, 0.0) for axis, at in here.items()}
        elif found := _found(orders.position, command):
            at = here.get(found["axis"], 0.0)
            given = self.dialect.units.read("position", float(found["value"])) if "value" in found else at
            self._axes[found["axis"]] = now, given, 0.0
        elif found := _found(orders.rate, command):
            rate = self.dialect.units.read("rate", float(found.get("value", 0.0)))
            self._axes[found["axis"]] = now, here.get(found["axis"], 0.0), rate
        elif found := _found(orders.stop, command):
            self._axes[found["axis"]] = now, here.get(found["axis"], 0.0), 0.0


class PaperChamber:
    """Air that goes to every setpoint fast, as fast as it can be believed."""

    who = "chamber"

    def __init__(self, dialect: ChamberDialect, clock: PaperClock) -> None:
        self._dialect, self._clock = dialect, clock
        room = 20.0 if dialect.units == "degC" else 293.15
        self._since, self._start, self._setpoint = 0.0, room, room

    @property
    def dialect(self) -> ChamberDialect:
        """What it speaks."""
        return self._dialect

    def asked(self, message: str) -> str | None:
        """The setpoint, and the air on its way there."""
        for question in (q for q in vars(self._dialect.questions).values() if q is not None):
            if message == question.ask:
                code = question.good[0] if question.good else "0"
                here, there = (figure(value, 3) for value in (self._air(), self._setpoint))
                return _answer(question, measured=here, setpoint=there, value=there, code=code)
        return None

    def told(self, command: str) -> None:
        """Take a setpoint."""
        found = _found(self._dialect.orders.setpoint, command)
        if found:
            self._since, self._start, self._setpoint = self._clock.now(), self._air(), float(found["value"])

    def _air(self) -> float:
        way, gone = self._setpoint - self._start, AIR_K_PER_S * (self._clock.now() - self._since)
        return self._start + math.copysign(min(abs(way), gone), way)


def _answer(question: Question, **values: str) -> str:
    return filled(question.answer[0], any="", **values)


def _axis(ask: str, message: str) -> str | None:
    try:
        return matched((ask,), message).get("axis", "1")
    except ValueError:
        return None


def _found(templates: Sequence[str], command: str) -> dict[str, str]:
    """The places of the template that a command is made from; empty when it is from none."""
    try:
        return matched(tuple(templates), command)
    except ValueError:
        return {}
