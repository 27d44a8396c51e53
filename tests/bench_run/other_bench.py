"""A second bench that shares nothing with the shipped simulator: other physics, other parser, other faults.

Faults come by time and chance, not by message: while a window is open, each message may meet its fault.
Nothing of `planner.bench_run.simulator` or `planner.control` is imported here.
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Sequence
from dataclasses import dataclass


class Time:
    """Virtual seconds; a suspended client oversleeps."""

    speed = 1.0

    def __init__(self) -> None:
        self.t, self.oversleep = 0.0, 0.0

    def now(self) -> float:
        return self.t

    def sleep(self, seconds: float) -> None:
        assert seconds >= 0
        self.t += seconds + self.oversleep
        self.oversleep = 0.0


@dataclass
class Fault:
    """One kind of fault on one device while `begin <= t < end`, each message with the given chance.

    end == begin: once, at the first message from then on.
    """

    device: str
    kind: str
    begin: float
    end: float
    chance: float = 1.0
    size: float = 0.0
    spent: bool = False

    def happens(self, t: float, chance: random.Random) -> bool:
        if self.end > self.begin:
            return self.begin <= t < self.end and chance.random() < self.chance
        self.spent, before = self.spent or t >= self.begin, self.spent
        return self.spent and not before


class Axle:
    """An axis as a list of (time, angle, rate) corners; rates are followed at once, angles at full speed."""

    def __init__(self) -> None:
        self.corners = [(-1e9, 0.0, 0.0)]

    def at(self, t: float) -> tuple[float, float]:
        time, angle, rate = next(c for c in reversed(self.corners) if c[0] <= t)
        return angle + rate * (t - time), rate

    def turn(self, t: float, rate: float) -> None:
        angle, _ = self.at(t)
        self.corners = [c for c in self.corners if c[0] < t] + [(t, angle, rate)]

    def go(self, t: float, target: float, fastest: float) -> None:
        angle, _ = self.at(t)
        way = (target - angle + 180.0) % 360.0 - 180.0
        lasts = abs(way) / fastest
        self.turn(t, way / lasts if lasts else 0.0)
        self.corners.append((t + lasts, angle + way, 0.0))


class Turntable:
    """Understands what the manual of such a controller says, nothing else; answers questions only."""

    def __init__(self, time: Time, axes: int = 2) -> None:
        self.time, self.axles = time, {str(n): Axle() for n in range(1, axes + 1)}
        self.mode, self.locked, self.ecp = (
            dict.fromkeys(self.axles, "off"),
            True,
            dict.fromkeys(self.axles, 0),
        )
        self.fastest, self.deaf = 100.0, False

    def tell(self, frame: str) -> str | None:
        answers = [self._one(c) for c in frame.split(";")]
        return ";".join(a for a in answers if a is not None) or None

    def _one(self, command: str) -> str | None:
        head, _, rest = command.strip().partition(" ")
        words, now = rest.split(","), self.time.now()
        if head.endswith("?"):
            angle, rate = self.axles[rest].at(now)
            if head == ":Status:ECP?":
                code, self.ecp[rest] = self.ecp[rest], 0
                return str(code)
            return f"{angle % 360.0:.4f}" if head == ":Read:Position?" else f"{rate:.4f}"
        chosen = list(self.axles) if words[0] == "ALL" else words[:1]
        for axis in chosen if not head.startswith(":Limit") else ():
            self._obey(head, axis, words, now)
        return None

    def _obey(self, head: str, axis: str, words: list[str], now: float) -> None:
        if head.startswith(":Interlock"):
            self.locked = False
        elif head == ":Mode:Off":
            self.mode[axis] = "off"
            self.axles[axis].turn(now, 0.0)
        elif self.locked:
            self.ecp[axis] = 7
        elif head.startswith(":Mode"):
            if self.mode[axis] != head[6:]:
                self.axles[axis].turn(now, 0.0)
            self.mode[axis] = head[6:]
        elif self.mode[axis] != head[8:]:
            self.ecp[axis] = 9
        elif head == ":Demand:Rate":
            self.axles[axis].turn(now, float(words[1]))
        else:
            self.axles[axis].go(now, float(words[1]), self.fastest)

    def cut(self) -> None:
        self.locked = True
        for axis, axle in self.axles.items():
            self.mode[axis] = "off"
            axle.turn(self.time.now(), 0.0)


class Oven:
    """Air that goes to its setpoint by a constant speed; off, it goes to the room slowly."""

    def __init__(self, time: Time, room: float = 20.0) -> None:
        self.time, self.room, self.setpoint = time, room, room
        self.on, self.constant = False, False
        self.course = [(-1e9, room, room, 1.0)]  # time, from, to, K/s

    def at(self, t: float) -> float:
        begin, start, end, speed = next(c for c in reversed(self.course) if c[0] <= t)
        return start + math.copysign(min(abs(end - start), speed * (t - begin)), end - start)

    def tell(self, message: str) -> str:
        if message == "TEMP?":
            return f"{self.at(self.time.now()):.1f},{self.setpoint:.1f},100.0,-80.0"
        if message == "MODE?":
            return "CONSTANT" if self.on and self.constant else "STANDBY"
        if match := re.fullmatch(r"TEMP,S(-?\d+\.\d)", message):
            self.setpoint = float(match[1])
        elif message == "POWER,ON":
            self.on = True
        elif message == "MODE,CONSTANT":
            self.constant = self.on
        else:
            return "NA:CMD ERR"
        self._go()
        return f"OK:{message}"

    def _go(self) -> None:
        now, running = self.time.now(), self.on and self.constant
        end, speed = (self.setpoint, 3.0 / 60) if running else (self.room, 0.4 / 60)
        self.course.append((now, self.at(now), end, speed))

    def cut(self) -> None:
        self.on = self.constant = False
        self._go()


class Wire:
    """A line to one of them, with its faults. terminal_server: late replies outlive a connection."""

    def __init__(self, world: World, name: str, device: Turntable | Oven) -> None:
        self.world, self.name, self.device = world, name, device
        self.waiting: list[tuple[float, str]] = []
        self.up, self.away_until = True, -1.0
        self.frozen: dict[str, str] = {}

    def write(self, message: str) -> None:
        now, time = self._now(), self.world.time
        if not self.up:
            raise BrokenPipeError("down")
        if "drop" in now or "cut" in now:
            if "cut" in now:
                self.device.cut()
            self.away_until = time.now() + now.get("cut", now.get("drop", 0.0))
            self.up = False
            raise ConnectionResetError("dropped")
        if "suspend" in now:
            time.oversleep = now["suspend"]
        if "disk" in now:
            self.world.disk_full = True
        asked = "?" in message
        if not asked and ("deaf" in now or getattr(self.device, "deaf", False)):
            reply = f"OK:{message}" if self.name == "chamber" else None
        else:
            reply = self.device.tell(message)
        if reply is not None and "lose" not in now:
            self._deliver(self._mangled(message, reply, now), now)

    def _mangled(self, message: str, reply: str, now: dict[str, float]) -> str:
        if "Read" in message or message == "TEMP?":
            if "freeze" in now:
                return self.frozen.setdefault(message, reply)
            self.frozen[message] = reply
            number = reply.split(",")[0]
            if "nan" in now:
                reply = reply.replace(number, self.world.chance.choice(["NaN", "inf", "-nan", "1e999"]), 1)
            elif "jump" in now:
                reply = reply.replace(number, f"{float(number) + now['jump']:.4f}", 1)
        if "garble" in now:
            at = self.world.chance.randrange(len(reply))
            reply = reply[:at] + self.world.chance.choice("#@~\x7f") + reply[at + 1 :]
        return reply

    def _deliver(self, reply: str, now: dict[str, float]) -> None:
        due = max(self.world.time.now() + now.get("late", 0.0), self.waiting[-1][0] if self.waiting else 0.0)
        self.waiting += [(due, reply)] * (2 if "double" in now else 1)

    def read(self, within_s: float) -> str:
        time = self.world.time
        if not self.up:
            raise ConnectionResetError("down")
        if not self.waiting or self.waiting[0][0] > time.now() + within_s:
            time.sleep(within_s)
            raise TimeoutError
        due, reply = self.waiting.pop(0)
        time.sleep(max(due - time.now(), 0.0))
        return reply

    def drain(self, listen_s: float, at_most: int = 0) -> int:
        time, found = self.world.time, 0
        end = time.now() + listen_s
        while self.waiting and self.waiting[0][0] <= end and not (at_most and found == at_most):
            time.sleep(max(self.waiting.pop(0)[0] - time.now(), 0.0))
            found += 1
        if not at_most or found < at_most:
            time.sleep(max(end - time.now(), 0.0))
        return found

    def reopen(self) -> None:
        if not self.world.terminal_server:
            self.waiting.clear()
        self.up = self.world.time.now() >= self.away_until
        if not self.up:
            raise ConnectionRefusedError("refused")

    def close(self) -> None:
        self.up = False

    def _now(self) -> dict[str, float]:
        t, chance = self.world.time.now(), self.world.chance
        return {f.kind: f.size for f in self.world.faults if f.device == self.name and f.happens(t, chance)}


class World:
    """Turntable, oven, their wires and what goes wrong."""

    def __init__(self, seed: int, faults: Sequence[Fault] = (), *, terminal_server: bool = False) -> None:
        self.time, self.chance, self.faults = Time(), random.Random(seed), list(faults)
        self.terminal_server, self.disk_full = terminal_server, False
        self.table, self.oven = Turntable(self.time), Oven(self.time)
        self.table_wire = Wire(self, "table", self.table)
        self.chamber_wire = Wire(self, "chamber", self.oven)
