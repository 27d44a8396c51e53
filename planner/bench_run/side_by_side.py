"""Several benches by one run: each in a thread, waiting for the others where the plan has them wait.

A batch of units goes from bench to bench. What is done with it on a bench begins when it has left the bench
before: when the last step of its earlier visits is in the journal. All benches share one clock, one journal
and the people. When one bench stops, all stop, and each is left safe.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from planner.bench_run.clock import Clock, WallClock
from planner.bench_run.equipment import Equipment, Finished, Say, Status
from planner.bench_run.errors import Interrupted
from planner.bench_run.interrupts import Stop
from planner.bench_run.job import Job
from planner.bench_run.journal import Journal, LaneJournal
from planner.bench_run.people import Operator, Waiting
from planner.bench_run.runner import execute
from planner.bench_run.safety import ATTENTION, Left
from planner.bench_run.shifts import planned_week
from planner.nouns.step import Step

LOOK_S = 5.0  # how often a bench that waits for another looks whether it may go on
WALL_S = 0.5  # how often the main thread listens for signals


class SharedClock:
    """One clock for several benches.

    By the wall each waits for itself; a clock that is moved from here goes on only when all of them wait, to
    the earliest end of a wait.
    """

    def __init__(self, clock: Clock, benches: int) -> None:
        self.clock, self.speed, self.cancelled = clock, clock.speed, threading.Event()
        self._stepped, self._active = not isinstance(clock, WallClock), benches
        self._waiting: dict[int, float] = {}
        self._moved = threading.Condition()

    def wait(self, seconds: float) -> None:
        """Until the time has passed."""
        if not self._stepped:
            if self.cancelled.is_set():
                self.clock.sleep(seconds)
            else:
                self.cancelled.wait(seconds / self.speed)
            return
        me = threading.get_ident()
        with self._moved:
            until = self._waiting[me] = self.clock.now() + max(seconds, 0.0)
            self._step()
            while me in self._waiting and self.clock.now() < until:
                self._moved.wait(WALL_S)
            self._waiting.pop(me, None)

    def leave(self) -> None:
        """One bench less: the others need not wait for it."""
        with self._moved:
            self._active -= 1
            self._step()

    def cancel(self) -> None:
        """Every bench comes back from its wait and stops."""
        self.cancelled.set()

    def _step(self) -> None:
        if self._waiting and len(self._waiting) >= self._active:
            earliest = min(self._waiting.values())
            self.clock.sleep(max(earliest - self.clock.now(), 0.0))
            for who in [w for w, until in self._waiting.items() if until <= self.clock.now() + 1e-9]:
                del self._waiting[who]
            self._moved.notify_all()


class LaneClock:
    """The shared clock as one bench sees it: when all are to stop, its next wait says so, once."""

    def __init__(self, shared: SharedClock) -> None:
        self._shared, self.speed, self.leaving = shared, shared.speed, False

    def now(self) -> float:
        """Seconds since some moment."""
        return self._shared.clock.now()

    def sleep(self, seconds: float) -> None:
        """Wait. Raises Interrupted when another bench has stopped, or somebody has stopped all."""
        self.check()
        self._shared.wait(seconds)
        self.check()

    def check(self) -> None:
        """Raises Interrupted, once, when all are to stop."""
        if self._shared.cancelled.is_set() and not self.leaving:
            self.leaving = True
            raise Interrupted("the run was stopped")


class LaneStop(Stop):
    """What a bench knows of being stopped: signals are the main thread's."""

    def __init__(self, whole: Stop, clock: LaneClock) -> None:
        self._whole, self._clock = whole, clock
        super().__init__()

    @property
    def told(self) -> bool:
        """Whether somebody has said to give up."""
        return self._whole.told

    @told.setter
    def told(self, value: bool) -> None:
        """Only the main thread is told."""

    def leave(self) -> None:
        """Waits of this bench no longer say that all are to stop."""
        self._clock.leaving = True


@dataclass(frozen=True)
class Lane:
    """What became of one bench: what it made, how it was left, why it stopped; each once, at its end."""

    name: str
    made: list[Finished]
    left: list[Left]
    failed: list[BaseException]


def execute_side_by_side(
    job: Job,
    equipment: Equipment,
    journal: Journal,
    say: Say,
    before: Callable[[Step], None],
    left: Callable[[Left], None],
    watch: Callable[[Status], None],
) -> Finished:
    """As `runner.execute`, all benches at once. Raises what stopped the first bench that stopped."""
    start, shared = equipment.clock.now(), SharedClock(equipment.clock, len(job.used_benches))
    works = _works(job, equipment, journal, shared)
    threads = [
        threading.Thread(target=work.run, args=(say, before, watch), name=work.lane.name, daemon=True)
        for work in works
    ]
    _run_all(threads, shared, equipment.stop)
    lanes = [work.lane for work in works]
    left(sum((how for lane in lanes for how in lane.left), Left()))
    failed = [error for lane in lanes for error in lane.failed]
    first = next((e for e in failed if not isinstance(e, Interrupted)), failed[0] if failed else None)
    if first is not None:
        raise first
    made = [finished for lane in lanes for finished in lane.made]
    return Finished(
        sum(f.steps for f in made),
        sum(f.records for f in made),
        equipment.clock.now() - start,
        sum(f.void for f in made),
    )


def _works(job: Job, equipment: Equipment, journal: Journal, shared: SharedClock) -> list[_Work]:
    """The part of each bench, with a view of its own of clock, journal, people and being stopped."""
    done = {entry.step for entry in journal.past.entries}
    week = equipment.week or _planned_week(job, equipment.clock, done)
    people, works = _OneAtATime(equipment.operator or Waiting(equipment.clock)), []
    for name in job.used_benches:
        part, clock = job.on(name), LaneClock(shared)
        own = replace(
            equipment, clock=clock, week=week, operator=people.on(clock), stop=LaneStop(equipment.stop, clock)
        )
        own_journal = LaneJournal(journal, [step.id for step in part.steps])
        works.append(_Work(part, own, own_journal, Lane(name, [], [], []), shared, done, gates_of(job, name)))
    return works


def gates_of(job: Job, bench: str) -> Mapping[str, frozenset[str]]:
    """First step of each visit of a batch to a bench -> the steps that must be done before it begins.

    These are the last steps of that batch's earlier visits to other benches.
    """
    firsts: dict[tuple[str, int | None], Step] = {}
    lasts: dict[tuple[str, int | None], Step] = {}
    for step in job.steps:
        firsts.setdefault((step.bench, step.batch), step)
        lasts[step.bench, step.batch] = step
    return {
        first.id: frozenset(
            lasts[other].id
            for other, begins in firsts.items()
            if other[1] == batch and other[0] != bench and begins.start_s < first.start_s
        )
        for (name, batch), first in firsts.items()
        if name == bench
    }


class _Work:
    """What one thread does. done: steps of all benches that are in the journal."""

    def __init__(
        self,
        job: Job,
        equipment: Equipment,
        journal: LaneJournal,
        lane: Lane,
        shared: SharedClock,
        done: set[str],
        gates: Mapping[str, frozenset[str]],
    ) -> None:
        self._job, self._eq, self._journal, self.lane = job, equipment, journal, lane
        self._shared, self._done, self._gates = shared, done, gates
        self._before: Step | None = None

    def run(self, say: Say, before: Callable[[Step], None], watch: Callable[[Status], None]) -> None:
        """The part of the job on this bench."""

        def begins(step: Step) -> None:
            if self._before is not None:
                self._done.add(self._before.id)
            self._wait_for_others(step, say)
            self._before = step
            before(step)

        def tell(text: str) -> None:
            name = self.lane.name
            say(f"{text} ({name})" if text.startswith(ATTENTION) else f"{name}: {text}")

        try:
            self.lane.made.append(
                execute(self._job, self._eq, self._journal, tell, begins, self.lane.left.append, watch)
            )
            if self._before is not None:
                self._done.add(self._before.id)
        except BaseException as error:  # told to the main thread, which raises it
            self.lane.failed.append(error)
            self._shared.cancel()
        finally:
            self._shared.leave()

    def _wait_for_others(self, step: Step, say: Say) -> None:
        gate = self._gates.get(step.id, frozenset())
        if not gate <= self._done:
            say(f"{self.lane.name}: {step.id} waits for {', '.join(sorted(gate))}")
        while not gate <= self._done:
            self._eq.clock.sleep(LOOK_S)


class _OneAtATime:
    """People are at one bench at a time; who waits for them keeps looking whether all are to stop."""

    def __init__(self, operator: Operator) -> None:
        self._operator, self._busy = operator, threading.Lock()

    def on(self, clock: LaneClock) -> Operator:
        """The people, as one bench sees them."""
        return _Attended(self._operator, self._busy, clock)


class _Attended:
    def __init__(self, operator: Operator, busy: threading.Lock, clock: LaneClock) -> None:
        self._operator, self._busy, self._clock = operator, busy, clock

    def attend(self, step: Step, seconds: float) -> None:
        """Wait the planned time where nobody is asked; else one bench after the other."""
        if isinstance(self._operator, Waiting):
            self._clock.sleep(seconds)
            return
        while not self._busy.acquire(timeout=WALL_S):
            self._clock.check()
        try:
            self._asked(step, seconds)
        finally:
            self._busy.release()

    def _asked(self, step: Step, seconds: float) -> None:
        """In a thread that may wait for ever: what nobody answers keeps no bench from leaving."""
        answered, failed = threading.Event(), []

        def ask() -> None:
            try:
                self._operator.attend(step, seconds)
            except Exception as error:  # handed on to whoever waits
                failed.append(error)
            answered.set()

        threading.Thread(target=ask, daemon=True).start()
        while not answered.wait(WALL_S):
            self._clock.check()
        if failed:
            raise failed[0]


def _planned_week(job: Job, clock: Clock, done: set[str]) -> Callable[[], float]:
    """The earliest step that is left is made at its planned moment of the week."""
    begin = min((step.start_s for step in job.steps if step.id not in done), default=0.0)
    return planned_week(clock, job.start_s + begin)


def _run_all(threads: list[threading.Thread], shared: SharedClock, stop: Stop) -> None:
    """Start all and wait for all; the first signal stops them, and each leaves its bench safe."""
    for thread in threads:
        thread.start()
    interrupt: KeyboardInterrupt | None = None
    while any(thread.is_alive() for thread in threads):
        try:
            for thread in threads:
                thread.join(WALL_S / len(threads))
            if shared.cancelled.is_set():
                stop.leave()
        except KeyboardInterrupt as error:
            interrupt = error
            shared.cancel()
    if interrupt is not None:
        raise interrupt
