"""The bench that a run is at: its table and chamber, and how it comes back when a connection drops."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import TypeVar

from planner.bench_run.chamber_driver import ChamberDriver
from planner.bench_run.equipment import Equipment, Say
from planner.bench_run.errors import BenchFault, LineLost, Silent
from planner.bench_run.safety import Left, make_safe
from planner.bench_run.table import TableDriver
from planner.control.ramp import stair
from planner.errors import PlannerError
from planner.nouns.bench import BenchFacts

LONGEST_WAIT_S = 60.0  # how long nobody looks at table and chamber
AGAIN_S = (1.0, 30.0)  # between two attempts to connect: at first, and at most
Done = TypeVar("Done")


class OpenBench:
    """Drivers of one bench. What they are told is absolute, so that it can be told again after a drop.

    looked: is called after every look at table and chamber
    """

    def __init__(self, facts: BenchFacts, equipment: Equipment, say: Say, looked: Callable[[], None]) -> None:
        self.facts, self._eq, self._say, self._looked = facts, equipment, say, looked
        self._clock, self._within = equipment.clock, equipment.tolerances
        lines = equipment.benches[facts.name]
        self.table: TableDriver | None = None
        self.chamber: ChamberDriver | None = None
        if facts.driven and lines.table is not None:
            self.table = TableDriver(lines.table, self._clock, facts, self._within, lines.table_dialect)
        if facts.chamber is not None and lines.chamber is not None:
            self.chamber = ChamberDriver(
                lines.chamber,
                self._clock,
                facts.chamber,
                self._within,
                facts.room_degc,
                lines.chamber_dialect,
            )
        self._drops = 0

    @property
    def doubts(self) -> int:
        """How often somebody was not sure what a device had said."""
        return self._drops + sum(d.talk.doubts for d in (self.table, self.chamber) if d is not None)

    @property
    def angles(self) -> Mapping[int, float]:
        """Axis -> angle in deg, as last read."""
        return {} if self.table is None else dict(self.table.angles)

    @property
    def temperature_degc(self) -> float | None:
        """The air, as last read."""
        return None if self.chamber is None else self.chamber.last_degc

    def open(self, fastest_dps: float) -> None:
        """Interlocks and limits first, chamber at room."""
        if self.table is not None:
            table = self.table
            self.steady(lambda: table.open(fastest_dps))
        if self.chamber is not None:
            self.steady(self.chamber.open)

    def at_temperature(self, degc: float | None) -> None:
        """The air at a temperature, and settled."""
        if self.chamber is not None and degc is not None:
            chamber = self.chamber
            self.steady(lambda: chamber.bring_to(degc))

    def move(self, motion: Mapping[str, float] | None, planned_s: float = 0.0) -> None:
        """The table in a motion, and there."""
        if self.table is not None:
            table = self.table
            self.steady(lambda: table.move(motion, planned_s))

    def rest(self) -> None:
        """The table at zero rate, and seen so."""
        if self.table is not None:
            self.steady(self.table.stop_turning)

    def look(self, *, turning: bool = False) -> None:
        """Raises BenchFault when table or chamber are not as they were told. turning: see `TableDriver`."""
        if self.table is not None:
            table = self.table
            self.steady(lambda: table.check(turning=turning))
        if self.chamber is not None:
            self.steady(self.chamber.check)
        self._looked()

    def hold(self, seconds: float, given_up: Callable[[], bool] = lambda: False) -> None:
        """Wait, with a look every minute; given_up: whether waiting on makes no sense."""
        end = self._clock.now() + seconds
        while (left := end - self._clock.now()) > 0 and not given_up():
            self._clock.sleep(min(left, LONGEST_WAIT_S))
            if left > LONGEST_WAIT_S:
                self.look(turning=left > 2 * LONGEST_WAIT_S)

    def sweep(
        self, swept_degc: tuple[float, float], seconds: float, given_up: Callable[[], bool] = lambda: False
    ) -> None:
        """The chamber evenly from one temperature to another, by a stair of setpoints, with looks as `hold`.

        Raises BenchFault when the air does not follow.
        """
        if self.chamber is None:
            self.hold(seconds, given_up)
            return
        chamber, start = self.chamber, self._clock.now()
        degrees, looked = stair(*swept_degc), start
        for k, degc in enumerate(degrees, start=1):
            if given_up():
                return
            self.steady(partial(chamber.sweep_to, degc))
            until = start + seconds * k / len(degrees)
            if self._clock.now() - looked > LONGEST_WAIT_S and until < start + seconds:
                self.look(turning=seconds > 2 * LONGEST_WAIT_S)
                looked = self._clock.now()
            self.hold(until - self._clock.now(), given_up)
        self.steady(partial(chamber.swept, swept_degc[1]))

    def is_sure(self) -> bool:
        """Whether no reply has come that nobody asked for."""
        sure = [d.talk.is_sure(0.0) for d in (self.table, self.chamber) if d is not None]  # ask both
        return all(sure)

    def leave(self) -> Left:
        """Table to zero rate, chamber to room, both seen; says what is not."""
        return make_safe(self.table, self.chamber, self._clock, self._told, self._eq.gives_up)

    def order_off(self) -> None:
        """The first thing when something has gone wrong; whether it was obeyed is seen later."""
        if self.table is not None:
            try:
                self.table.order_off()
            except (PlannerError, OSError) as error:
                self._say(f"the table could not be ordered off at once: {error}")

    def steady(self, action: Callable[[], Done]) -> Done:
        """Do it, again after every drop of a connection. Raises BenchFault when one does not come back."""
        while True:
            try:
                return action()
            except LineLost as error:
                self._recover(error)

    def _told(self, words: str) -> None:
        self._say(words)
        self._eq.notify("attention", words)

    def _recover(self, lost: LineLost) -> None:
        """Connect again; interlock, position and temperature as before; soak for as long as it was lost."""
        self._drops += 1
        self._say(f"{lost}; connecting again")
        begin, wait = self._clock.now(), AGAIN_S[0]
        while True:
            try:
                soak_s = self._reconnected()
                break
            except (LineLost, Silent) as error:
                tried = self._clock.now() - begin
                if tried >= self._within.reconnect_s:
                    raise BenchFault(f"gave up after {tried / 60:.0f} min: {error}") from error
            self._clock.sleep(wait)
            wait = min(2 * wait, AGAIN_S[1])
        self._say("connected again; interlock, position and temperature are as they were")
        if soak_s > 0:
            self._say(f"the temperature was lost for {soak_s / 60:.0f} min: soaking again for as long")
            self.hold(soak_s)

    def _reconnected(self) -> float:
        if self.table is not None:
            self.table.reconnect()
        return 0.0 if self.chamber is None else self.chamber.reconnect()
