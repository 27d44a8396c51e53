"""Executes a job step by step.

What "each record exactly once" means after a stop in the middle of a repeat. A repeat is one power-on with
all its records. When the unit loses power between them, finished records stay as they are and only the rest
is made, after a power-on of its own: no record is made twice, none is lost. The price is that this repeat's
records come from two power-ons; every line of the journal says which (`power_on`, counted over the whole
campaign), so that the fit takes them as two runs and not as one. The alternative, to make the whole repeat
again, would throw away records that are good.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime

from planner.bench_run.chamber_driver import ChamberDriver
from planner.bench_run.clock import Clock
from planner.bench_run.job import Job
from planner.bench_run.journal import Entry, Journal
from planner.bench_run.line import Line
from planner.bench_run.people import NoRecorder, Operator, Recorder, Waiting
from planner.bench_run.shifts import Hours, begins
from planner.bench_run.table import TableDriver
from planner.bench_run.tolerances import Tolerances
from planner.control.orders import fastest_dps
from planner.errors import PlannerError
from planner.nouns.bench import BenchFacts
from planner.nouns.plan import Step

ATTENTION = "ATTENTION"  # begins what somebody must look at: the bench may not be safe
LONGEST_WAIT_S = 60.0  # how long nobody looks at table and chamber

Say = Callable[[str], None]


@dataclass(frozen=True)
class Equipment:
    """What a campaign is run with. tables: a line for every driven bench; chamber: None without one.

    week: () -> seconds from Monday 00:00 now; None: as planned, from the session's first step on
    """

    tables: Mapping[str, Line]
    chamber: Line | None
    clock: Clock
    recorder: Recorder = field(default_factory=NoRecorder)
    operator: Operator | None = None
    tolerances: Tolerances = field(default_factory=Tolerances)
    week: Callable[[], float] | None = None


@dataclass(frozen=True)
class Finished:
    """What a run did: steps and records made in this session, and its length on the clock."""

    steps: int
    records: int
    seconds: float


def execute(
    job: Job,
    equipment: Equipment,
    journal: Journal,
    say: Say = lambda text: None,
    before: Callable[[Step], None] = lambda step: None,
) -> Finished:
    """Make all steps that the journal does not tell of; `before` hears of each.

    The limits must have been checked (`bench_run.limits`). Raises BenchFault when the bench does not do
    what it is told; then, as after any other exception, the table goes to zero rate and the chamber to room
    temperature before the exception goes on.
    """
    run = _Run(job, equipment, journal, say)
    begin = len(journal.past.entries)
    start = equipment.clock.now()
    try:
        for step in job.steps[begin:]:
            before(step)
            run.make(step)
    except BaseException:  # whatever ends it, Ctrl-C included, the table must stop
        run.end(failed=True)
        raise
    run.end(failed=False)
    made = job.steps[begin:]
    return Finished(len(made), sum(s.action == "record" for s in made), equipment.clock.now() - start)


class _Run:
    """One session: what the equipment is doing now."""

    def __init__(self, job: Job, equipment: Equipment, journal: Journal, say: Say) -> None:
        self._job, self._eq, self._journal, self._say = job, equipment, journal, say
        self._clock = equipment.clock
        self._operator = equipment.operator or Waiting(equipment.clock)
        self._bench: BenchFacts | None = None
        self._table: TableDriver | None = None
        self._chamber: ChamberDriver | None = None
        self._done = len(journal.past.entries)
        self._hours = Hours(job, equipment.week or self._planned_week(), equipment.tolerances.overtime_s)
        self._powered = False
        self._recording: Step | None = None
        self._began = 0.0

    def make(self, step: Step) -> None:
        """Make one step and write it down."""
        first = self._bench is None
        if self._bench is None or self._bench.name != step.bench:
            self._change_bench(step)
        if first or begins(self._job.steps, self._done):
            self._wait_for_people(self._done)
        if first and self._done:
            self._catch_up(step)
            self._wait_for_people(self._done)  # the soak of catching up may have taken the rest of the shift
        self._began = self._clock.now()
        getattr(self, f"_{step.action}")(step)  # `nouns.plan.ACTIONS` are the names that get here
        self._write(step)
        self._done += 1

    def end(self, *, failed: bool) -> None:
        """Leave everything safe: record void, table at zero rate, chamber at room, unit off.

        Each part is tried whatever became of the others; what fails is said. The table comes first.
        """
        self._try("the table was not seen at zero rate", self._zero_rate)
        self._try("the chamber was not brought to room temperature", self._warm)
        self._try("the record was not ended", self._void)
        if failed and self._powered:
            step = self._job.steps[self._done]
            self._try("the unit was not switched off", lambda: self._switch(False, step))

    # ------------------------------------------------------------ people

    def _planned_week(self) -> Callable[[], float]:
        """The first step of the session is made at its planned moment of the week."""
        start, steps = self._clock.now(), self._job.steps
        planned = self._job.start_s + (steps[self._done].start_s if self._done < len(steps) else 0.0)
        return lambda: planned + self._clock.now() - start

    def _wait_for_people(self, index: int) -> None:
        """Until step `index` may begin (bench_run.shifts), with a look at table and chamber every minute."""
        left = self._hours.left(index) if index < len(self._job.steps) else 0.0
        if left > LONGEST_WAIT_S:
            self._say(f"waiting for people until {self._hours.opens(index)}, {left / 3600:.1f} h")
        while left > 0:
            self._clock.sleep(min(left, LONGEST_WAIT_S))
            if left > LONGEST_WAIT_S:
                self._look()
            left = self._hours.left(index)

    def _attend(self, step: Step, seconds: float) -> None:
        """Somebody at a table that stands still."""
        self._rest()
        self._operator.attend(step, seconds)

    # ------------------------------------------------------------ before the first step

    def _change_bench(self, step: Step) -> None:
        """Leave one bench, open the next: interlocks and limits first, chamber at room."""
        self._zero_rate()
        self._warm()
        bench = self._job.benches[step.bench]
        self._bench, self._table, self._chamber = bench, None, None
        if bench.driven:
            self._table = TableDriver(self._eq.tables[bench.name], self._clock, bench, self._eq.tolerances)
            self._table.open(fastest_dps(_motions(self._job, bench.name), bench))
        if bench.chamber is not None and self._eq.chamber is not None:
            self._chamber = ChamberDriver(self._eq.chamber, self._clock, bench.chamber, self._eq.tolerances)
            self._chamber.open(bench.room_degc)

    def _catch_up(self, step: Step) -> None:
        """After a stop: setpoint and soak, then power when the repeat still lacks records."""
        if step.action in ("install", "ramp", "soak", "remove"):
            return  # they bring the temperature themselves
        self._say(f"going on at {step.id}")
        self._at_temperature(step)
        earlier = self._job.steps[: self._done]
        soaks = [s for s in earlier if s.action == "soak" and _same_place(s, step)]
        if soaks:
            self._hold(soaks[-1].seconds)
        if step.action != "power_on" and self._lacks_records(step):
            powered = next(s for s in reversed(earlier) if s.action == "power_on")
            self._switch(False, step)
            self._power_on(powered)

    def _lacks_records(self, step: Step) -> bool:
        rest = self._job.steps[self._done :]
        return any(s.action == "record" and _same_repeat(s, step) for s in rest)

    # ------------------------------------------------------------ the actions

    def _install(self, step: Step) -> None:
        self._rest()
        self._at_temperature(step)
        self._attend(step, step.seconds)

    _remove = _install

    def _ramp(self, step: Step) -> None:
        self._at_temperature(step)

    def _soak(self, step: Step) -> None:
        self._at_temperature(step)
        self._hold(step.seconds)

    def _power_on(self, step: Step) -> None:
        self._at_temperature(step)
        if step.attended:
            self._attend(step, 0.0)
        self._journal.power_on()
        self._switch(True, step)
        self._hold(step.seconds)

    def _move(self, step: Step) -> None:
        turned = self._turned_round(step)
        if turned or step.attended:
            self._attend(step, step.seconds if turned else 0.0)
        if self._table is not None:
            self._table.move(step.motion, step.seconds)

    def _record(self, step: Step) -> None:
        self._at_temperature(step)
        if self._table is not None:
            self._table.move(step.motion, 0.0)
        self._recording = step
        self._eq.recorder.start(step, self._journal.power_ons)
        self._began = self._clock.now()
        self._hold(step.seconds)
        self._look()
        self._eq.recorder.stop(step, complete=True)
        self._recording = None

    def _power_off(self, step: Step) -> None:
        self._rest()
        self._switch(False, step)

    def _cool_down(self, step: Step) -> None:
        self._hold(step.seconds)

    def _pause(self, step: Step) -> None:
        """Of a test: for its time. Of none: until people are there for what follows (bench_run.shifts)."""
        if step.test is None and (self._job.shifts or self._job.any_time):
            self._wait_for_people(self._done + 1)
        else:
            self._hold(step.seconds)

    # ------------------------------------------------------------ their parts

    def _at_temperature(self, step: Step) -> None:
        if self._chamber is not None and step.temperature_degc is not None:
            self._chamber.bring_to(step.temperature_degc)

    def _turned_round(self, step: Step) -> bool:
        """Whether somebody must turn the unit: by hand on a plate, for the other sign on a one-axis arm."""
        assert self._bench is not None
        if not self._bench.driven:
            return True
        load = (step.motion or {}).get("acceleration_g")
        if load is None or self._bench.axes > 1:
            return False
        return (load < 0) != (self._last_load() < 0)

    def _last_load(self) -> float:
        for step in reversed(self._job.steps[: self._done]):
            if step.bench != self._job.steps[self._done].bench:
                break
            if step.action == "move" and step.motion and "acceleration_g" in step.motion:
                return step.motion["acceleration_g"]
        return 0.0

    def _hold(self, seconds: float) -> None:
        """Wait, with a look at table and chamber every minute."""
        end = self._clock.now() + seconds
        while (left := end - self._clock.now()) > 0:
            self._clock.sleep(min(left, LONGEST_WAIT_S))
            if left > LONGEST_WAIT_S:
                self._look()

    def _look(self) -> None:
        if self._table is not None:
            self._table.check()
        if self._chamber is not None:
            self._chamber.check()

    def _switch(self, on: bool, step: Step) -> None:
        self._eq.recorder.power(on, step, self._journal.power_ons)
        self._powered = on

    def _write(self, step: Step) -> None:
        ended = self._clock.now()
        chamber = self._chamber if step.action in ("soak", "record") else None
        self._journal.finished(
            Entry(
                step=step.id,
                start_s=round(self._began, 6),
                end_s=round(ended, 6),
                session=self._journal.session,
                power_on=self._journal.power_ons,
                utc=datetime.now(UTC).isoformat(timespec="milliseconds"),
                temperature_degc=None if chamber is None else chamber.temperature_degc(),
            )
        )

    # ------------------------------------------------------------ leaving

    def _try(self, otherwise: str, action: Callable[[], None]) -> None:
        """Do it; a signal in the middle only makes it start again, a fault is said and not passed on."""
        try:
            try:
                action()
            except KeyboardInterrupt:
                action()
        except (PlannerError, OSError) as error:
            self._say(f"{ATTENTION}: {otherwise}: {error}")

    def _zero_rate(self) -> None:
        if self._table is not None:
            self._table.zero_rate()

    def _rest(self) -> None:
        if self._table is not None:
            self._table.stop_turning()

    def _warm(self) -> None:
        if self._chamber is not None and self._bench is not None:
            self._chamber.make_safe(self._bench.room_degc)

    def _void(self) -> None:
        if self._recording is not None:
            step, self._recording = self._recording, None
            self._eq.recorder.stop(step, complete=False)


def _motions(job: Job, bench: str) -> Iterator[Mapping[str, float] | None]:
    return (step.motion for step in job.steps if step.bench == bench)


def _same_place(one: Step, other: Step) -> bool:
    return one.bench == other.bench and one.temperature_degc == other.temperature_degc


def _same_repeat(one: Step, other: Step) -> bool:
    return _same_place(one, other) and (one.test, one.repeat) == (other.test, other.repeat)
