"""Drives a rate table over a line: says what to do, then looks until it is done."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

from planner.bench_run.clock import Clock
from planner.bench_run.errors import BenchFault, LineLost
from planner.bench_run.line import TRIES, Conversation, Line
from planner.bench_run.readings import comparing_s, contradiction
from planner.bench_run.table_words import TableWords
from planner.bench_run.tolerances import Tolerances
from planner.control.dialect import Question, TableDialect, finite
from planner.control.dialect_files import table_dialect
from planner.control.kinematics import change, turn_s
from planner.control.orders import AxisOrder, orders
from planner.nouns.bench import BenchFacts

POLL_S = (0.05, 1.0)  # at first, and at most: a tenth of what has been waited already
REST_S = (0.3, 0.13)  # between three looks at angles at rest: no rate below 36 000 deg/s passes as none
SLOWEST_DPS2 = 10.0  # to bound the time of a start when the plan knows no limit of acceleration


class TableDriver:
    """One bench's table. What an order did is looked at before anything else happens."""

    def __init__(
        self,
        line: Line,
        clock: Clock,
        bench: BenchFacts,
        tolerances: Tolerances,
        dialect: TableDialect | None = None,
    ) -> None:
        self._dialect = dialect or table_dialect()
        self.talk = Conversation(line, "table", self._dialect)
        self._words = TableWords(self._dialect, bench.axes)
        self._clock, self._bench, self._within = clock, bench, tolerances
        self._axes = range(1, bench.axes + 1)
        self._turning: set[int] = set()
        self._holding: tuple[AxisOrder, ...] = ()
        self._reads_rate = self._dialect.questions.rate is not None
        self._pointed = False
        self.angles: dict[int, float] = {}  # as last read
        self._contradicted = ""
        self._before: dict[int, tuple[float, float]] = {}  # readings when the last order was given

    def open(self, fastest_dps: float) -> None:
        """Interlocks, then limits, then rest; fastest_dps: of the campaign.

        Raises BenchFault when the table does not obey.
        """
        for word in self._words.prepare():
            self.talk.order([word])
        self._learn_codes()
        self.errors()  # of whoever used the table before us; what persists is refused next
        self._check_interlock()
        self._order([*self._words.limits(self._bench, fastest_dps), *self._words.stop_all()])
        self._reads_rate = self._reads_rate and self._can_read_rate()
        self._turning = set(self._axes)
        self.stop_turning()

    def reconnect(self) -> None:
        """After a connection that dropped: interlock, errors, and what was held or turned is ordered again.

        Raises LineLost when it is still down, BenchFault when the interlock has opened meanwhile.
        """
        self.talk.connect()
        self.errors()
        self._check_interlock()
        held, self._holding = self._holding, ()
        if held:
            self._go(held)

    def move(self, motion: Mapping[str, float] | None, planned_s: float) -> None:
        """Make a motion and wait until it is there; one that is already held is only looked at."""
        wanted = orders(motion, self._bench)
        if not wanted or wanted == self._holding:
            self.check()
            return
        self._holding = ()
        self._go(wanted, planned_s)

    def check(self, *, turning: bool = False) -> None:
        """Raises BenchFault when an axis is not where it is held, or reports an error.

        A single reading that is wrong is a doubt. turning: also compare angles with rates, which takes time
        """
        for order in self._holding:
            if self._there(order):
                continue
            self.talk.doubt()
            if not self._there(order):
                raise BenchFault(f"{_said(order)} has left its place: it reads {self._reading(order):g}")
        if turning:
            self._check_turning(self._holding)
        self._refuse_errors("while it held")

    def stop_turning(self) -> None:
        """All axes at zero rate, and seen so: somebody may come near."""
        if self._turning:
            self._holding = ()
            still = tuple(AxisOrder(axis, "rate", 0.0) for axis in sorted(self._turning))
            self._arrive(still, 0.0, lambda: self._order(self._words.stop_all()))
            self._turning = set()
        restless = self.restless()
        if restless:
            raise BenchFault(f"the table does not rest: {', '.join(restless)}")

    def restless(self) -> list[str]:
        """Axes that are not seen at zero rate, in words: by their rates, and by angles that do not stay."""
        for _ in range(TRIES):
            doubts, found = self.talk.doubts, self._restless()
            if self.talk.is_sure() and self.talk.doubts == doubts:
                return found
        raise BenchFault("the table's replies come twice or too late: rest cannot be seen")

    def _restless(self) -> list[str]:
        found = {axis: words for axis in self._axes if (words := self._rate_words(axis))}
        before = {axis: self.angle_deg(axis) for axis in self._axes}
        for seconds in REST_S:
            self._clock.sleep(seconds)
            for axis in self._axes:
                off = math.remainder(self.angle_deg(axis) - before[axis], 360.0)
                if abs(off) > 2 * self._within.position_deg:
                    found.setdefault(axis, f"axis {axis} goes on by {off:g} deg in {seconds:g} s")
        return list(found.values())

    def suspicion(self) -> str:
        """Why its readings are not to be believed; empty when nothing speaks against them."""
        if self._contradicted or not self._before:
            return self._contradicted
        if any(self._readings(axis) != before for axis, before in self._before.items()):
            return ""
        return "its readings did not follow the last order: it is stuck, or they are frozen"

    def order_off(self) -> None:
        """Whatever happened before: to zero rate. Connects again when the line is down.

        Errors of earlier commands may still stand in the controller; what counts is the second time.
        """
        self._holding = ()
        try:
            self._off()
        except BenchFault:
            self.talk.connect()
            self._off()

    def braking_s(self) -> float:
        """How long the way to rest may take, at the limits of the table."""
        return self._longest_s(AxisOrder(1, "rate", 0.0)) + POLL_S[1]

    # ------------------------------------------------------------ orders

    def _go(self, wanted: tuple[AxisOrder, ...], planned_s: float = 0.0) -> None:
        """Axes that turn and have no new order come to rest; the others do what is wanted."""
        stops = sorted(self._turning - {order.axis for order in wanted})
        resting = tuple(AxisOrder(axis, "rate", 0.0) for axis in stops)
        self._turning |= {order.axis for order in wanted if order.mode == "rate" and order.value}
        self._arrive((*resting, *wanted), planned_s, lambda: self._order(self._words.motion(wanted, stops)))
        self._turning = {order.axis for order in wanted if order.mode == "rate" and order.value}
        self._check_turning(wanted)
        self._holding = wanted

    def _off(self) -> None:
        self.talk.order(self._words.stop_all())
        if self.errors():
            self._order(self._words.stop_all())

    def _order(self, commands: Sequence[str]) -> None:
        if commands:
            self.talk.order(commands)
            self._refuse_errors(f"at {commands[-1]!r}")

    def _refuse_errors(self, when: str) -> None:
        errors = self.errors()
        if errors:
            raise BenchFault(f"the table reports an error {when} (ECP of {', '.join(errors)})")

    def errors(self) -> list[str]:
        """What the table says is wrong, in words; reading it makes it forget."""
        codes = self._codes(self._dialect.questions.errors)
        return [f"axis {axis}: {code}" if axis else code for axis, code in codes]

    def _learn_codes(self) -> None:
        """Whether error codes are written with a point, so that an angle can be told from them later."""
        question = self._dialect.questions.errors
        if question is not None:
            word = self._words.question(question, 1)
            self._pointed = "." in self.talk.ask(word, lambda text: question.understood(text, 1)["code"])

    def interlock(self) -> str:
        """What the interlock is, when it is not closed; empty when it is, or the table does not tell."""
        return next((state for _, state in self._codes(self._dialect.questions.interlock)), "")

    def _check_interlock(self) -> None:
        state = self.interlock()
        if state:
            raise BenchFault(f"the interlock of the table is {state}: close it, then go on with --resume")

    def _codes(self, question: Question | None) -> Iterator[tuple[int, str]]:
        """(axis, its answer) where that does not mean that all is well; axis 0: the whole table."""
        if question is None:
            return
        for axis in self._axes if "{axis}" in question.ask else (0,):
            code = self._ask(question, axis)
            if code:
                yield axis, code

    def _ask(self, question: Question, axis: int) -> str:
        """The code of the answer; empty where it is one of those that mean all is well."""

        def understand(text: str) -> str:
            code = question.understood(text, axis or None)["code"]
            if question is self._dialect.questions.errors and "." in code and not self._pointed:
                raise ValueError("an angle or a rate is no error code")
            return "" if question.is_good(code) else code

        return self.talk.ask(self._words.question(question, axis), understand)

    # ------------------------------------------------------------ looking

    def _arrive(self, wanted: Sequence[AxisOrder], planned_s: float, order: Callable[[], None]) -> None:
        """Order, then look until every axis is there twice in a row; what was ignored is ordered again."""
        deadline = self._within.arrival_s + 3 * planned_s + 3 * max(map(self._longest_s, wanted))
        if not all(map(self._there, wanted)):
            self._before = {order.axis: self._readings(order.axis) for order in wanted}
        self._obeyed(order)
        missing = self._missing(wanted, deadline)
        if missing:
            self._obeyed(order)
            missing = self._missing(wanted, deadline)
        if missing:
            said = [f"{_said(order)} reads {self._reading(order):g}" for order in missing]
            raise BenchFault(f"not arrived after {2 * deadline:.0f} s: {', '.join(said)}")
        self._before = {}
        if not self._reads_rate:
            self._clock.sleep(max(map(self._longest_s, wanted)))
        self._refuse_errors("on the way")

    def _obeyed(self, order: Callable[[], None]) -> None:
        """Give an order; one that is refused needs not be followed."""
        try:
            order()
        except LineLost:
            raise
        except BenchFault:
            self._before = {}
            raise

    def _missing(self, wanted: Sequence[AxisOrder], deadline: float) -> list[AxisOrder]:
        """Who is not there at the deadline; late is only who is not there when it is looked."""
        start, seen, first = self._clock.now(), 0, self.talk.doubts
        while seen < 2:
            waited = self._clock.now() - start
            missing = [order for order in wanted if not self._there(order)] if waited > deadline else []
            if missing:
                return missing
            if waited > 3 * deadline and self.talk.doubts - first > TRIES:
                raise BenchFault("the table's replies come twice or too late: nothing can be seen")
            self._clock.sleep(min(max(POLL_S[0], waited / 10), POLL_S[1]))
            doubts = self.talk.doubts
            seen = seen + 1 if all(map(self._there, wanted)) else 0
            if (seen == 2 and not self.talk.is_sure()) or self.talk.doubts != doubts:
                seen = 0
        return []

    def _check_turning(self, wanted: Sequence[AxisOrder]) -> None:
        """An axis that turns is seen elsewhere a moment later: by as much as its rate says."""
        for order in wanted:
            if order.mode == "rate" and order.value:
                said = self._turning_fault(order) and self._turning_fault(order)
                if said:
                    self._contradicted = f"axis {order.axis} reads {order.value:g} deg/s, but {said}"
                    raise BenchFault(self._contradicted)

    def _turning_fault(self, order: AxisOrder) -> str:
        begin = self._clock.now()
        first, then = self.angle_deg(order.axis), self._clock.now()
        self._clock.sleep(comparing_s(order.value))
        again = self._clock.now()
        second, end = self.angle_deg(order.axis), self._clock.now()
        unsure = (then - begin) + (end - again)
        return contradiction(first, second, order.value, 0.5 * (again + end - begin - then), unsure)

    def _can_read_rate(self) -> bool:
        """Some tables read positions only; then rest is seen by angles that stay."""
        try:
            self.rate_dps(1)
        except BenchFault:
            self.errors()
            return False
        return True

    def _there(self, order: AxisOrder) -> bool:
        if order.mode == "rate":
            allowed = self._within.rate_dps + self._within.rate_share * abs(order.value)
            return not self._reads_rate or abs(self.rate_dps(order.axis) - order.value) <= allowed
        off = self.angle_deg(order.axis) - order.value
        return abs(math.remainder(off, 360.0)) <= self._within.position_deg

    def _rate_words(self, axis: int) -> str:
        rate = self.rate_dps(axis) if self._reads_rate else 0.0
        return f"axis {axis} reads {rate:g} deg/s" if abs(rate) > self._within.rate_dps else ""

    def _readings(self, axis: int) -> tuple[float, float]:
        return self.angle_deg(axis), self.rate_dps(axis) if self._reads_rate else 0.0

    def _reading(self, order: AxisOrder) -> float:
        return self.rate_dps(order.axis) if order.mode == "rate" else self.angle_deg(order.axis)

    def angle_deg(self, axis: int) -> float:
        """Where an axis is. Raises BenchFault for what it cannot be."""
        question, stops = self._dialect.questions.position, self._bench.travel.get(axis)

        def understand(text: str) -> float:
            number = finite(question.understood(text, axis)["value"])
            degrees = self._dialect.units.read("position", number)
            if stops is not None and not stops[0] - 1.0 <= degrees <= stops[1] + 1.0:
                raise ValueError("an angle beyond the stops of the axis")
            return degrees

        self.angles[axis] = self.talk.ask(self._words.question(question, axis), understand)
        return self.angles[axis]

    def rate_dps(self, axis: int) -> float:
        """How fast an axis turns, where the table tells that."""
        question = self._dialect.questions.rate
        assert question is not None

        def understand(text: str) -> float:
            return self._dialect.units.read("rate", finite(question.understood(text, axis)["value"]))

        return self.talk.ask(self._words.question(question, axis), understand)

    def _longest_s(self, order: AxisOrder) -> float:
        """Bound of the time to a rate from the opposite one, or of a stop and a whole turn, at the limits."""
        acceleration = self._bench.angular_acceleration_dps2 or SLOWEST_DPS2
        fastest = max(abs(order.value) if order.mode == "rate" else 0.0, self._bench.rate_dps or 0.0)
        if order.mode == "rate":
            return change(-fastest, fastest, acceleration)[0]
        return change(fastest, 0.0, acceleration)[0] + turn_s(360.0, self._bench, acceleration)


def _said(order: AxisOrder) -> str:
    unit = "deg" if order.mode == "position" else "deg/s"
    return f"axis {order.axis}, told {order.mode} {order.value:g} {unit},"
