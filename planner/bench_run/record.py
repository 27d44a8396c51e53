"""Making one record: void and made again when something about it is in doubt.

Void is a record in which a reply was lost, late, doubled or garbled, a connection dropped, a reading could
not be, or that lasted longer than planned (the process was stopped, the computer asleep): nobody looked at
the bench meanwhile. The journal tells that a record begins before it does: one whose end is not told is
known to be void, and is not made again without a word.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from planner.bench_run.equipment import Equipment, Say
from planner.bench_run.errors import BenchFault
from planner.bench_run.journal import Journal
from planner.bench_run.open_bench import OpenBench
from planner.errors import PlannerError
from planner.nouns.step import Step


class Recording:
    """Records of one session. voided: how many were made in vain."""

    def __init__(self, equipment: Equipment, journal: Journal, say: Say) -> None:
        self._eq, self._journal, self._say = equipment, journal, say
        self._clock, self._within = equipment.clock, equipment.tolerances
        self._open: Step | None = None
        self._began = 0.0
        self.voided = 0

    def make(self, step: Step, bench: OpenBench, lead: Callable[[], None] = lambda: None) -> float:
        """Make a record until it is good; when that one began.

        lead: brings a chamber that moves during the record to where it begins, once more
        Raises BenchFault when one after the other is void.
        """
        for attempt in range(self._within.voids):
            if attempt:
                lead()
            why = self._made(step, bench)
            if not why:
                return self._began
            self.voided += 1
            self._say(f"{step.id} is void, {why}; it is made again")
        raise BenchFault(f"{step.id} was void {self._within.voids} times, at last: {why}")

    def written(self) -> None:
        """The journal tells of the record."""
        self._open = None

    def void_the_open(self) -> None:
        """A record that was begun and is not told of as finished is void."""
        if self._open is not None:
            step, self._open = self._open, None
            try:
                self._eq.recorder.stop(step, complete=False)
            finally:
                self._noted(step, "the run ended", self._began, self._clock.now())

    def void_the_unfinished(self, steps: Sequence[Step]) -> None:
        """Records that an earlier session was in the middle of: their data are void, and that is said."""
        by_id = {step.id: step for step in steps}
        for begun in self._journal.past.begun:
            if begun.step not in by_id:
                continue
            self._say(
                f"{begun.step} was begun at {begun.utc} and never finished: "
                "its data are void, it is made again"
            )
            step = by_id[begun.step]
            try:
                self._eq.recorder.lost(step, begun.power_on)
            except PlannerError as error:
                self._say(f"the recorder was not told that {step.id} is void: {error}")
            self._noted(step, "the run ended in its midst", begun.start_s, None)

    def _noted(self, step: Step, why: str, start_s: float, end_s: float | None) -> None:
        """In the journal, as far as that can be written: that the record began stands there already."""
        try:
            self._journal.void(step.id, why, start_s, end_s)
        except PlannerError as error:
            self._say(f"{step.id} is void: {error}")

    def _made(self, step: Step, bench: OpenBench) -> str:
        """Why the record is void; empty when it is good."""
        if step.swept_degc is None:
            bench.at_temperature(step.temperature_degc)
            bench.move(step.motion)
        self._begin(step)
        doubts = bench.doubts
        if step.swept_degc is None:
            bench.hold(step.seconds, given_up=lambda: bench.doubts != doubts)
        else:
            bench.sweep(step.swept_degc, step.seconds, given_up=lambda: bench.doubts != doubts)
        bench.look()
        bench.is_sure()
        self._clock.sleep(0.0)  # a simulator tells its time when it is asked to move it
        lasted = self._clock.now() - self._began
        why = self._why(step, lasted, bench.doubts != doubts)
        self._eq.recorder.stop(step, complete=not why)
        if why:
            self._open = None
            self._journal.void(step.id, why, self._began, self._clock.now())
        return why

    def _begin(self, step: Step) -> None:
        self._journal.begun(step.id, self._clock.now())
        self._open = step
        self._eq.recorder.start(step, self._journal.power_ons)
        self._began = self._clock.now()

    def _why(self, step: Step, lasted: float, doubtful: bool) -> str:
        over = self._within.overlong_s * self._clock.speed + self._within.overlong_share * step.seconds
        if doubtful:
            return "a reply or a connection was in doubt"
        if abs(lasted - step.seconds) > over:
            return f"it lasted {lasted:.0f} s instead of {step.seconds:.0f} s"
        return ""
