"""The thermal chamber, of the ESPEC P300 kind: `TEMP,S-40.0`, `TEMP?`, `MODE,CONSTANT`, `MODE?`, `POWER,ON`.

The air follows the setpoint at the chamber's rate and settles exponentially over the last bit, the slope
without a kink: T' = −rate while further than rate·τ away, then T' = −(T − T_set)/τ.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from dataclasses import dataclass

from planner.bench_run.simulator.table import Clock, Refusal

_SET = re.compile(r"TEMP,S([+-]?\d{1,3}(\.\d{1,2})?)")
LEAK_K_PER_S = 0.5 / 60.0  # towards the room when the mains have gone
STALLS_SHORT_K = 5.0  # how far before the setpoint a chamber that never settles gives up


@dataclass(frozen=True)
class _Course:
    """From `start_s` at `start_degc` towards `target_degc`."""

    start_s: float
    start_degc: float
    target_degc: float
    rate: float
    settling_s: float

    def at(self, time_s: float) -> float:
        way = self.target_degc - self.start_degc
        near = self.rate * self.settling_s
        linear_s = max(abs(way) - near, 0.0) / self.rate
        t = time_s - self.start_s
        if t <= linear_s:
            return self.start_degc + math.copysign(self.rate * t, way)
        left = math.copysign(min(near, abs(way)), way)
        return self.target_degc - left * math.exp(-(t - linear_s) / self.settling_s)


class Chamber:
    """A chamber in a room of 20 °C; rates in K/min.

    refusals: every message that was answered with NA.
    """

    def __init__(
        self,
        clock: Clock,
        *,
        coldest_degc: float = -70.0,
        hottest_degc: float = 180.0,
        heating: float = 4.0,
        cooling: float = 2.0,
        settling_s: float = 20.0,
        room_degc: float = 20.0,
    ) -> None:
        self._clock = clock
        self._range = (coldest_degc, hottest_degc)
        self._rates = (heating / 60.0, cooling / 60.0)
        self._settling_s, self._room = settling_s, room_degc
        self._courses = [_Course(0.0, room_degc, room_degc, heating / 60.0, settling_s)]
        self.setpoint_degc = room_degc
        self.power, self.constant, self.stalls = False, False, False
        self.refusals: list[Refusal] = []
        self.messages = 0

    def at(self, time_s: float | None = None) -> float:
        """The true temperature of the air, now or at any time."""
        now = self._clock.now() if time_s is None else time_s
        return self._courses[max(bisect_right(self._courses, now, key=lambda c: c.start_s) - 1, 0)].at(now)

    def receive(self, message: str) -> str:
        """The reply to one message: data, `OK:…` or `NA:…`."""
        self.messages += 1
        if message == "TEMP?":
            low, high = self._range
            return f"{self.at():.1f},{self.setpoint_degc:.1f},{high:.1f},{low:.1f}"
        if message == "MODE?":
            return "CONSTANT" if self.power and self.constant else "STANDBY" if self.power else "OFF"
        if match := _SET.fullmatch(message):
            return self._set(message, float(match[1]))
        if message in ("POWER,ON", "POWER,OFF"):
            self.power = message == "POWER,ON"
        elif message == "MODE,CONSTANT":
            if not self.power:
                return self.refuse(message, "CHB NOT READY-1")
            self.constant = True
        else:
            return self.refuse(message, "CMD ERR")
        self._steer()
        return f"OK:{message}"

    def refuse(self, message: str, why: str = "CHB NOT READY-2") -> str:
        """Note a refusal; its reply."""
        self.refusals.append(Refusal(self._clock.now(), message, why))
        return f"NA:{why}"

    def stall(self) -> None:
        """From the next setpoint on the chamber never quite gets there."""
        self.stalls = True

    def cut(self) -> None:
        """The mains go: off, and the air leaks towards the room until somebody starts it again."""
        self.power = self.constant = False
        now, here = self._clock.now(), self.at()
        self._courses.append(_Course(now, here, self._room, LEAK_K_PER_S, self._settling_s))

    def _set(self, message: str, value: float) -> str:
        if not self._range[0] <= value <= self._range[1]:
            return self.refuse(message, "DATA OUT OF RANGE")
        self.setpoint_degc = value
        self._steer()
        return f"OK:{message}"

    def _steer(self) -> None:
        """Go towards the setpoint from where the air is; without power it stays as it is."""
        now, here = self._clock.now(), self.at()
        target = self.setpoint_degc if self.power and self.constant else here
        if self.stalls and target != here:
            target = here + math.copysign(max(abs(target - here) - STALLS_SHORT_K, 0.0), target - here)
        rate = self._rates[0] if target > here else self._rates[1]
        self._courses.append(_Course(now, here, target, rate, self._settling_s))
