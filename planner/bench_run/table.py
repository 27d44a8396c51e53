"""Drives a rate table over a line: says what to do, then looks until it is done."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from planner.bench_run.clock import Clock
from planner.bench_run.errors import BenchFault
from planner.bench_run.line import Line, ask, last_number, send
from planner.bench_run.tolerances import Tolerances
from planner.control import words
from planner.control.kinematics import change, turn_s
from planner.control.orders import AxisOrder, orders
from planner.nouns.bench import BenchFacts

POLL_S = (0.05, 1.0)  # at first, and at most: a tenth of what has been waited already
SLOWEST_DPS2 = 10.0  # to bound the time of a start when the plan knows no limit of acceleration


class TableDriver:
    """One bench's table. Every order is checked in the ECP of each axis before anything else happens."""

    def __init__(self, line: Line, clock: Clock, bench: BenchFacts, tolerances: Tolerances) -> None:
        self._line, self._clock, self._bench, self._within = line, clock, bench, tolerances
        self._turning: set[int] = set()
        self._holding: tuple[AxisOrder, ...] = ()
        self._reads_rate = True

    def open(self, fastest_dps: float) -> None:
        """Interlocks, then limits, then rest; fastest_dps: of the campaign.

        Raises BenchFault when the table does not obey.
        """
        for message in words.INTERLOCKS:
            send(self._line, "table", message)
        self._errors()  # of whoever used the table before us; what persists is refused next
        self._order(";".join([*words.limits(self._bench, fastest_dps), words.OFF]))
        self._reads_rate = self._can_read_rate()
        self._turning = set(range(1, self._bench.axes + 1)) if self._reads_rate else set()
        self.stop_turning()

    def move(self, motion: Mapping[str, float] | None, planned_s: float) -> None:
        """Make a motion and wait until it is there; one that is already held is only looked at."""
        wanted = orders(motion, self._bench)
        if not wanted or wanted == self._holding:
            self.check()
            return
        self._holding = ()
        named = {order.axis for order in wanted}
        self._order(words.motion(wanted, sorted(self._turning - named)))
        self._turning = {order.axis for order in wanted if order.mode == "rate" and order.value}
        self._arrive(wanted, planned_s)
        self._holding = wanted

    def check(self) -> None:
        """Raises BenchFault when an axis is not where it is held, or reports an error."""
        for order in self._holding:
            if not self._there(order):
                raise BenchFault(f"{_said(order)} has left its place: it reads {self._reading(order):g}")
        self._refuse_errors("while it held")

    def stop_turning(self) -> None:
        """Axes that turn go to zero rate, and are seen to."""
        if self._turning:
            self._holding = ()
            self._order(words.OFF)
            still = tuple(AxisOrder(axis, "rate", 0.0) for axis in sorted(self._turning))
            self._arrive(still, 0.0)
            self._turning = set()

    def zero_rate(self) -> None:
        """Whatever happened before: to zero rate. Connects again when the line is down."""
        self._holding = ()
        try:
            self._off()
        except BenchFault:
            self._line.reopen()
            self._off()
        self._turning = set()

    def _off(self) -> None:
        """Errors of earlier commands may still stand in the ECP; what counts is the second time."""
        send(self._line, "table", words.OFF)
        if any(self._errors().values()):
            self._order(words.OFF)

    def _order(self, message: str) -> None:
        send(self._line, "table", message)
        self._refuse_errors(f"at {message!r}")

    def _refuse_errors(self, when: str) -> None:
        errors = self._errors()
        if any(errors.values()):
            named = ", ".join(f"axis {axis}: {code:g}" for axis, code in errors.items() if code)
            raise BenchFault(f"the table reports an error {when} (ECP of {named})")

    def _errors(self) -> dict[int, float]:
        return {
            axis: ask(self._line, "table", f":Status:ECP? {axis}", last_number)
            for axis in range(1, self._bench.axes + 1)
        }

    def _can_read_rate(self) -> bool:
        """Some tables read positions only; then a rate is waited for as long as the limits ask."""
        try:
            ask(self._line, "table", ":Read:Rate? 1", last_number)
        except BenchFault:
            self._errors()
            return False
        return True

    def _arrive(self, wanted: Sequence[AxisOrder], planned_s: float) -> None:
        """Look until every axis is there twice in a row; late is only who is not there when it is looked."""
        start, seen = self._clock.now(), 0
        deadline = self._within.arrival_s + 3 * planned_s + 3 * max(map(self._longest_s, wanted))
        while seen < 2:
            waited = self._clock.now() - start
            missing = [order for order in wanted if not self._there(order)] if waited > deadline else []
            if missing:
                said = [f"{_said(order)} reads {self._reading(order):g}" for order in missing]
                raise BenchFault(f"not arrived after {waited:.0f} s: {', '.join(said)}")
            self._clock.sleep(min(max(POLL_S[0], waited / 10), POLL_S[1]))
            seen = seen + 1 if all(map(self._there, wanted)) else 0
        if not self._reads_rate:
            self._clock.sleep(max(map(self._longest_s, wanted)))
        self._refuse_errors("on the way")

    def _there(self, order: AxisOrder) -> bool:
        if order.mode == "rate":
            allowed = self._within.rate_dps + self._within.rate_share * abs(order.value)
            return not self._reads_rate or abs(self._reading(order) - order.value) <= allowed
        off = self._reading(order) - order.value
        return abs(math.remainder(off, 360.0)) <= self._within.position_deg

    def _reading(self, order: AxisOrder) -> float:
        return ask(self._line, "table", f":Read:{order.mode.title()}? {order.axis}", last_number)

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
