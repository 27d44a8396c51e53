"""Drives a thermal chamber: setpoint, read back, then looking until the air has settled."""

from __future__ import annotations

from planner.bench_run.clock import Clock
from planner.bench_run.errors import BenchFault
from planner.bench_run.line import Conversation, Line
from planner.bench_run.readings import Air
from planner.bench_run.tolerances import Tolerances
from planner.control.dialect import ChamberDialect, filled, fits
from planner.control.dialect_files import chamber_dialect
from planner.nouns.bench import ChamberFacts

POLL_S = (1.0, 30.0)  # at first, and at most: a twentieth of what has been waited already


class ChamberDriver:
    """One chamber."""

    def __init__(
        self,
        line: Line,
        clock: Clock,
        facts: ChamberFacts,
        tolerances: Tolerances,
        room_degc: float = 20.0,
        dialect: ChamberDialect | None = None,
    ) -> None:
        self._dialect = dialect or chamber_dialect()
        self.talk = Conversation(line, "chamber", self._dialect)
        self._clock, self._facts, self._within, self._room = clock, facts, tolerances, room_degc
        self._air = Air(facts, room_degc, tolerances)
        self._target: float | None = None
        self._good_s = clock.now()
        self.last_degc: float | None = None
        self._started = False
        self._tells_mode: bool | None = None if self._dialect.questions.mode else False

    def open(self, harmless_degc: float | None = None) -> None:
        """Setpoint before power, so that it starts from a harmless one: from room, if no other is given."""
        self._target = None
        self._set(self._room if harmless_degc is None else harmless_degc)
        self._start()
        self._check_mode()
        self._started = True

    def bring_to(self, temperature_degc: float) -> None:
        """Set a temperature and wait until the air has it; at once when it has it already."""
        if self._target == temperature_degc:
            self.check()
            return
        self._target = None
        self._check_mode()
        self._set(temperature_degc)
        self._settle(temperature_degc)
        self._target, self._good_s = temperature_degc, self._clock.now()

    def sweep_to(self, temperature_degc: float) -> None:
        """Order a setpoint on the way of a ramp, and do not wait for the air."""
        self._target = None
        self._set(temperature_degc)

    def swept(self, temperature_degc: float) -> None:
        """Raises BenchFault when the air is not near where a ramp should have brought it."""
        strayed = self._strayed(temperature_degc)
        if strayed is not None:
            raise BenchFault(
                f"the chamber does not follow its ramp: it reads {strayed:g} degC, "
                f"not {temperature_degc:g} degC"
            )

    def temperature_degc(self) -> float:
        """The air, as the chamber reads it. Raises BenchFault for what it cannot be."""
        self.last_degc = self.talk.ask(self._dialect.questions.temperature.ask, self._measured)
        return self.last_degc

    def check(self) -> None:
        """Raises BenchFault when the air has strayed from the temperature that it had."""
        if self._target is None:
            return
        strayed = self._strayed(self._target)
        if strayed is not None:
            raise BenchFault(f"the chamber has left {self._target:g} degC: it reads {strayed:g} degC")
        self._good_s = self._clock.now()

    def reconnect(self) -> float:
        """After a connection that dropped: setpoint, mode and air as before.

        Returns for how many seconds the temperature was lost: what must be soaked again. Raises LineLost
        when it is still down.
        """
        self.talk.connect()
        reading = self.temperature_degc()
        if not self._started:
            return 0.0
        self._start()
        if self._target is None:
            return 0.0
        shown = self.setpoint_degc()
        if shown is not None and not self._same(shown, self._target):
            self._set(self._target)
        elif abs(reading - self._target) <= self._within.drift_k:
            return 0.0
        self._settle(self._target)
        lost, self._good_s = self._clock.now() - self._good_s, self._clock.now()
        return lost

    def order_room(self) -> None:
        """Whatever happened before: to room temperature. Connects again when the line is down."""
        self._target = None
        try:
            self._tell(self._room)
        except BenchFault:
            self.talk.connect()
            self._tell(self._room)

    def not_at_room(self) -> list[str]:
        """What speaks against the chamber's going to room, in words: its setpoint, its mode."""
        shown, mode = self.setpoint_degc(), self._wrong_mode()
        found = (
            [] if shown is None or self._same(shown, self._room) else [f"its setpoint reads {shown:g} degC"]
        )
        return [*found, *([f"its mode reads {mode}"] if mode else [])]

    def mode(self) -> str:
        """Its mode in words, or that it tells none."""
        wrong = self._wrong_mode()
        return wrong or ("it holds a temperature" if self._tells_mode else "it does not answer to that")

    def seen(self) -> str:
        """What could be read back of it, in words."""
        told = {"setpoint": self._dialect.tells_setpoint, "mode": bool(self._tells_mode)}
        seen = [name for name, is_told in told.items() if is_told]
        return f"{' and '.join(seen)} read back" if seen else "it tells neither setpoint nor mode"

    # ------------------------------------------------------------ orders

    def _set(self, degc: float) -> None:
        """Order a setpoint and read it back; what was ignored is ordered once more."""
        self._tell(degc)
        shown = self.setpoint_degc()
        if shown is not None and not self._same(shown, degc):
            self._tell(degc)
            shown = self.setpoint_degc()
        if shown is not None and not self._same(shown, degc):
            words = self._words(degc)
            raise BenchFault(f"the chamber did not take {words[-1]!r}: its setpoint is {shown:g} degC")

    def _tell(self, degc: float) -> None:
        self.talk.order(self._words(degc))

    def _words(self, degc: float) -> list[str]:
        return [filled(word, value=self._dialect.sent(degc)) for word in self._dialect.orders.setpoint]

    def _start(self) -> None:
        for word in self._dialect.orders.start:
            self.talk.order([word])

    def _check_mode(self) -> None:
        if not (self._wrong_mode() and self._wrong_mode()):
            return
        self._start()  # an order may have been lost
        mode = self._wrong_mode()
        if mode:
            raise BenchFault(f"the chamber does not hold a temperature: its mode is {mode}")

    # ------------------------------------------------------------ looking

    def setpoint_degc(self) -> float | None:
        """The setpoint as the chamber tells it; None when it does not."""
        apart = self._dialect.questions.setpoint
        if apart is not None:
            return self.talk.ask(apart.ask, lambda text: self._dialect.read(apart.understood(text)["value"]))
        return self.talk.ask(self._dialect.questions.temperature.ask, self._setpoint)

    def _wrong_mode(self) -> str:
        """The mode, when it is told and is none that holds a temperature.

        Not every chamber that speaks a dialect answers this question: one that refuses it has no mode.
        """
        question = self._dialect.questions.mode
        if question is None or self._tells_mode is False:
            return ""
        words = self._dialect.acknowledgement

        def understand(text: str) -> str:
            if words and fits(words.refused, text):
                return "refused"
            return question.understood(text)["code"]

        try:
            mode = self.talk.ask(question.ask, understand, tries=2)
        except BenchFault:
            if self._tells_mode:
                raise
            self.talk.connect()
            mode = "refused"
        self._tells_mode = self._tells_mode or mode != "refused"
        return "" if mode == "refused" or question.is_good(mode) else mode

    def _strayed(self, degc: float) -> float | None:
        """What the air reads, where that is off a temperature twice: a single reading is a doubt."""
        now = self.temperature_degc()
        if abs(now - degc) > self._within.drift_k:
            self._air.forget()
            self.talk.doubt()
            now = self.temperature_degc()
        return now if abs(now - degc) > self._within.drift_k else None

    def _measured(self, text: str) -> float:
        found = self._dialect.questions.temperature.understood(text)
        return self._air.accepted(self._clock.now(), self._dialect.read(found["measured"]))

    def _setpoint(self, text: str) -> float | None:
        found = self._dialect.questions.temperature.understood(text)
        return self._dialect.read(found["setpoint"]) if found.get("setpoint") else None

    def _same(self, shown: float, degc: float) -> bool:
        """Whether a setpoint is the one that was sent: to half of the digit that is sent, and shown."""
        return abs(shown - degc) <= 0.51 * 10.0**-self._dialect.decimals + 1e-6

    def _settle(self, target: float) -> None:
        start = inside_since = moved = self._clock.now()
        first = last = self.temperature_degc()
        deadline = self._within.settling_s + 3 * self._ramp_s(first, target)
        while True:
            doubts, reading = self.talk.doubts, self.temperature_degc()
            now = self._clock.now()
            moved, last = (moved, last) if reading == last else (now, reading)
            if abs(reading - target) > self._within.temperature_k:
                inside_since = now
            elif now - inside_since >= self._within.settled_s or now == start:
                if self.talk.is_sure() and self.talk.doubts == doubts:
                    return
                inside_since = now
            frozen = inside_since == now and now - moved > self._within.frozen_s
            if frozen or (now - start > deadline and inside_since == now):
                stood = (
                    f", and has for {(now - moved) / 60:.0f} min: frozen, or it does not go" if frozen else ""
                )
                raise BenchFault(
                    f"the chamber has not settled at {target:g} degC after {(now - start) / 60:.0f} min: "
                    f"it reads {reading:g} degC{stood}"
                )
            self._clock.sleep(min(max(POLL_S[0], (now - start) / 20), POLL_S[1]))

    def _ramp_s(self, start: float, end: float) -> float:
        rates = self._facts.heating_k_per_min, self._facts.cooling_k_per_min
        speed = rates[0] if end > start else rates[1]
        return 60 * abs(end - start) / speed if speed else 0.0
