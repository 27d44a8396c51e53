"""Drives a thermal chamber of the ESPEC P300 kind: setpoint, then looking until the air has settled."""

from __future__ import annotations

from planner.bench_run.clock import Clock
from planner.bench_run.errors import BenchFault
from planner.bench_run.line import Line, ask, send
from planner.bench_run.tolerances import Tolerances
from planner.control import words
from planner.nouns.bench import ChamberFacts

POLL_S = (1.0, 30.0)  # at first, and at most: a twentieth of what has been waited already


class ChamberDriver:
    """One chamber."""

    def __init__(self, line: Line, clock: Clock, facts: ChamberFacts, tolerances: Tolerances) -> None:
        self._line, self._clock, self._facts, self._within = line, clock, facts, tolerances
        self._target: float | None = None

    def open(self, room_degc: float) -> None:
        """Setpoint at room before power, so that it starts from a harmless one."""
        self._order(words.setpoint(room_degc))
        self._order(words.POWER_ON)
        self._order(words.CONSTANT)
        self._target = None

    def bring_to(self, temperature_degc: float) -> None:
        """Set a temperature and wait until the air has it; at once when it has it already."""
        if self._target == temperature_degc:
            self.check()
            return
        self._target = None
        self._order(words.setpoint(temperature_degc))
        self._settle(temperature_degc)
        self._target = temperature_degc

    def temperature_degc(self) -> float:
        """The air, as the chamber reads it."""
        return ask(self._line, "chamber", words.READ_TEMPERATURE, _measured)

    def check(self) -> None:
        """Raises BenchFault when the air has strayed from the temperature that it had."""
        if self._target is None:
            return
        now = self.temperature_degc()
        if abs(now - self._target) > self._within.drift_k:
            raise BenchFault(f"the chamber has left {self._target:g} degC: it reads {now:g} degC")

    def make_safe(self, room_degc: float) -> None:
        """Whatever happened before: to room temperature. Connects again when the line is down."""
        self._target = None
        try:
            self._order(words.setpoint(room_degc))
        except BenchFault:
            self._line.reopen()
            self._order(words.setpoint(room_degc))

    def _order(self, message: str) -> None:
        """Send and hear `OK`; when no word comes, the chamber must be alive and show the setpoint."""
        send(self._line, "chamber", message)
        try:
            reply = self._line.read()
        except TimeoutError:
            self._line.clear()
            self._confirm(message)
            return
        except OSError as error:
            raise BenchFault(f"the connection to the chamber dropped at {message!r}: {error}") from error
        if not reply.upper().startswith("OK"):
            raise BenchFault(f"the chamber refused {message!r}: {reply}")

    def _confirm(self, message: str) -> None:
        shown = ask(self._line, "chamber", words.READ_TEMPERATURE, _setpoint)
        if message.startswith("TEMP,S") and shown is not None and shown != float(message[6:]):
            raise BenchFault(f"the chamber did not take {message!r}: its setpoint is {shown:g} degC")

    def _settle(self, target: float) -> None:
        start = inside_since = self._clock.now()
        first = self.temperature_degc()
        deadline = self._within.settling_s + 3 * self._ramp_s(first, target)
        while True:
            now, reading = self._clock.now(), self.temperature_degc()
            if abs(reading - target) > self._within.temperature_k:
                inside_since = now
            elif now - inside_since >= self._within.settled_s or now == start:
                return
            if now - start > deadline and inside_since == now:
                raise BenchFault(
                    f"the chamber has not settled at {target:g} degC after {(now - start) / 60:.0f} min: "
                    f"it reads {reading:g} degC"
                )
            self._clock.sleep(min(max(POLL_S[0], (now - start) / 20), POLL_S[1]))

    def _ramp_s(self, start: float, end: float) -> float:
        rates = self._facts.heating_k_per_min, self._facts.cooling_k_per_min
        speed = rates[0] if end > start else rates[1]
        return 60 * abs(end - start) / speed if speed else 0.0


def _fields(reply: str) -> list[float]:
    return [float(part) for part in reply.split(",")]


def _measured(reply: str) -> float:
    """First of `measured,setpoint,upper alarm,lower alarm`."""
    return _fields(reply)[0]


def _setpoint(reply: str) -> float | None:
    """Second of them; None when the chamber tells only the first."""
    return [*_fields(reply), None][1]
