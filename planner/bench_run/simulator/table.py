"""The rate table: a state machine that answers the messages of `grammar`.

ECP codes are this simulator's own; the first error stays until it is read: 1 not understood, 2 over a limit,
3 interlock open, 4 demand outside its mode, 5 refused (by fault injection).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from planner.bench_run.simulator.axis import Axis, State
from planner.bench_run.simulator.grammar import Command, GrammarError, parse


class Clock(Protocol):
    """Seconds that never go back."""

    def now(self) -> float:
        """Seconds since some moment."""
        ...


@dataclass(frozen=True)
class Refusal:
    """A message that was not obeyed."""

    time_s: float
    message: str
    why: str


class _RefusedError(Exception):
    def __init__(self, code: int, why: str, axis: int = 0) -> None:
        self.code, self.axis = code, axis
        super().__init__(why)


@dataclass
class _Servo:
    """One axis, its drive and its limits: by mode letter, deg/s and deg/s²."""

    axis: Axis
    fastest: float
    strongest: float
    mode: str = "off"
    closed: bool = False
    tripped: bool = True  # at power-up: Reset before Close
    error: int = 0
    rate: dict[str, float] = field(default_factory=dict)
    acceleration: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.rate = dict.fromkeys("pr", self.fastest)
        self.acceleration = dict.fromkeys("pr", self.strongest)


class Table:
    """A table of one to six axes, all continuous unless `travel` names the stops of an axis.

    fastest_dps, strongest_dps2: what the drives can do; limits sent may only be tighter.
    refusals: every message that was not obeyed, in order.
    """

    def __init__(
        self,
        clock: Clock,
        axes: int = 3,
        *,
        fastest_dps: float = 3000.0,
        strongest_dps2: float = 3000.0,
        travel: Sequence[tuple[float, float] | None] = (),
    ) -> None:
        stops = [*travel, *[None] * (axes - len(travel))]
        self._clock = clock
        self._servos = [_Servo(Axis(stop), fastest_dps, strongest_dps2) for stop in stops]
        self.refusals: list[Refusal] = []
        self.messages = 0

    @property
    def axes(self) -> int:
        """How many axes turn."""
        return len(self._servos)

    def at(self, axis: int, time_s: float | None = None) -> State:
        """The true state of an axis (from 1) now or at any time, angle unwound."""
        return self._servos[axis - 1].axis.at(self._clock.now() if time_s is None else time_s)

    def mode(self, axis: int) -> str:
        """`position`, `rate` or `off`."""
        return self._servos[axis - 1].mode

    def receive(self, message: str) -> str | None:
        """Do what one message says; the replies of its queries joined by `;`, None when it asks nothing."""
        self.messages += 1
        try:
            commands = parse(message, self.axes)
        except GrammarError as error:
            self.refuse(message, str(error), 1)
            return None
        replies = []
        for command in commands:
            try:
                replies.append(self._obey(command))
            except _RefusedError as error:
                self.refuse(message, str(error), error.code, error.axis)
                break  # what stands behind a refused command is not done either
        return ";".join(reply for reply in replies if reply is not None) or None

    def refuse(self, message: str, why: str = "refused", code: int = 5, axis: int = 0) -> None:
        """Note an error in the ECP of an axis (0: of all)."""
        self.refusals.append(Refusal(self._clock.now(), message, why))
        for servo in self._chosen(axis):
            servo.error = servo.error or code

    def seize(self) -> None:
        """All axes stick where they are."""
        for servo in self._servos:
            servo.axis.seize(self._clock.now())

    def cut(self) -> None:
        """The mains go: axes brake, interlocks open and trip."""
        for number, servo in self._numbered(0):
            self._change_mode("off", number, servo)
            servo.closed, servo.tripped = False, True

    def _chosen(self, axis: int) -> list[_Servo]:
        return self._servos if axis == 0 else [self._servos[axis - 1]]

    def _obey(self, command: Command) -> str | None:
        if command.is_query:
            return self._reply(command.name, self._servos[command.axis - 1])
        for number, servo in self._numbered(command.axis):
            self._order(command, number, servo)
        return None

    def _numbered(self, axis: int) -> Iterator[tuple[int, _Servo]]:
        return ((n, s) for n, s in enumerate(self._servos, start=1) if axis in (0, n))

    def _reply(self, name: str, servo: _Servo) -> str:
        position, rate = servo.axis.at(self._clock.now())
        if name == "Read:Position?":
            shown = position if servo.axis.travel else position % 360.0
            return f"{shown:.4f}"
        if name == "Read:Rate?":
            return f"{rate:.4f}"
        error, servo.error = servo.error, 0
        return str(error)

    def _order(self, command: Command, number: int, servo: _Servo) -> None:
        group, verb = command.name.split(":")
        if group == "Interlock":
            self._interlock(verb, number, servo)
        elif group == "Limit":
            self._limit(verb, command, number, servo)
        elif group == "Mode":
            self._change_mode(verb.lower(), number, servo)
        else:
            self._demand(verb.lower(), command.value or 0.0, number, servo)

    def _interlock(self, verb: str, number: int, servo: _Servo) -> None:
        if verb == "Reset":
            servo.tripped = False
        elif servo.tripped:
            raise _RefusedError(3, f"interlock of axis {number} has tripped: reset it first", number)
        else:
            servo.closed = True

    def _limit(self, verb: str, command: Command, number: int, servo: _Servo) -> None:
        most = servo.fastest if verb == "Rate" else servo.strongest
        value, mode = command.value or 0.0, command.mode or ""
        if not 0 < value <= most:
            raise _RefusedError(2, f"limit {value:g} of axis {number} is not within 0 … {most:g}", number)
        (servo.rate if verb == "Rate" else servo.acceleration)[mode] = value

    def _change_mode(self, mode: str, number: int, servo: _Servo) -> None:
        if mode != "off" and not servo.closed:
            raise _RefusedError(3, f"interlock of axis {number} is open", number)
        if servo.mode == mode and mode != "off":
            return
        servo.mode = mode
        servo.axis.to_rate(self._clock.now(), 0.0, servo.acceleration["p" if mode == "position" else "r"])

    def _demand(self, mode: str, value: float, number: int, servo: _Servo) -> None:
        if servo.mode != mode:
            raise _RefusedError(4, f"axis {number} is in mode {servo.mode}, not {mode}", number)
        now = self._clock.now()
        if mode == "rate":
            if abs(value) > servo.rate["r"]:
                raise _RefusedError(2, f"{value:g} deg/s is over the limit of axis {number}", number)
            servo.axis.to_rate(now, value, servo.acceleration["r"])
            return
        stops = servo.axis.travel
        if stops is not None and not stops[0] <= value <= stops[1]:
            raise _RefusedError(2, f"{value:g} deg is outside the stops of axis {number}", number)
        servo.axis.to_position(now, value, servo.rate["p"], servo.acceleration["p"])
