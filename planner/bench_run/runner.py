"""Executes a job step by step.

What "each record exactly once" means after a stop in the middle of a repeat. A repeat is one power-on with
all its records. When the unit loses power between them, finished records stay as they are and only the rest
is made, after a power-on of its own: no record is made twice, none is lost. The price is that this repeat's
records come from two power-ons; every line of the journal says which (`power_on`, counted over the whole
campaign), so that the fit takes them as two runs and not as one. The alternative, to make the whole repeat
again, would throw away records that are good.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping

from planner.bench_run.equipment import Equipment, Finished, Say, Status
from planner.bench_run.errors import BenchFault
from planner.bench_run.job import Job
from planner.bench_run.journal import Entry, Journal, now_text
from planner.bench_run.open_bench import LONGEST_WAIT_S, OpenBench
from planner.bench_run.people import Waiting
from planner.bench_run.record import Recording
from planner.bench_run.safety import ATTENTION, Left
from planner.bench_run.shifts import Hours, begins, planned_week, same_place, same_repeat
from planner.control.orders import fastest_dps
from planner.errors import PlannerError
from planner.nouns.step import Step


def execute(
    job: Job,
    equipment: Equipment,
    journal: Journal,
    say: Say = lambda text: None,
    before: Callable[[Step], None] = lambda step: None,
    left: Callable[[Left], None] = lambda how: None,
    watch: Callable[[Status], None] = lambda status: None,
) -> Finished:
    """Make all steps that the journal does not tell of.

    before: hears of each step; left: how the bench was left, at the end; watch: where it is, now and then
    The limits must have been checked (`bench_run.limits`). Raises BenchFault when the bench does not do
    what it is told; then, as after any other exception, the table goes to zero rate and the chamber to room
    temperature before the exception goes on. BenchFault too when all was made and that was not seen.
    """
    run = _Run(job, equipment, journal, say, watch)
    begin = len(journal.past.entries)
    start = equipment.clock.now()
    try:
        for step in job.steps[begin:]:
            before(step)
            run.make(step)
    except BaseException:  # whatever ends it, Ctrl-C included, the table must stop
        left(run.end(failed=True))
        raise
    how = run.end(failed=False)
    left(how)
    if not how.safe:
        raise BenchFault("every step was made, but the bench could not be left safe")
    made = job.steps[begin:]
    records = sum(s.action == "record" for s in made)
    return Finished(len(made), records, equipment.clock.now() - start, run.recording.voided)


class _Run:
    """One session: what the equipment is doing now."""

    def __init__(
        self, job: Job, equipment: Equipment, journal: Journal, say: Say, watch: Callable[[Status], None]
    ) -> None:
        self._job, self._eq, self._journal, self._say, self._watch = job, equipment, journal, say, watch
        self._clock = equipment.clock
        self._operator = equipment.operator or Waiting(equipment.clock)
        self._bench: OpenBench | None = None
        self._done = len(journal.past.entries)
        self._hours = Hours(job, equipment.week or self._planned_week(), equipment.tolerances.overtime_s)
        self._attended = [i for i, step in enumerate(job.steps) if step.attended]
        self._powered = False
        self._began = 0.0
        self.recording = Recording(equipment, journal, say)

    def make(self, step: Step) -> None:
        """Make one step and write it down."""
        self._began = self._clock.now()
        first = self._bench is None
        if self._bench is None or self._bench.facts.name != step.bench:
            self._change_bench(step)
        if first:
            self.recording.void_the_unfinished(self._job.steps)
        if first or begins(self._job.steps, self._done):
            self._wait_for_people(self._done)
        if first and self._done:
            self._catch_up(step)
            self._wait_for_people(self._done)  # the soak of catching up may have taken the rest of the shift
        self._began = self._clock.now()
        self._tell_status()
        getattr(self, f"_{step.action}")(step)  # `nouns.step.ACTIONS` are the names that get here
        self._write(step)
        self._done += 1

    def end(self, *, failed: bool) -> Left:
        """Leave everything safe: table at zero rate, record void, unit off, chamber at room.

        Each part is tried whatever became of the others; what fails is said. The table comes first, and is
        looked at until it is seen at zero rate, or somebody says to give up.
        """
        self._eq.stop.leave()
        if failed and self._bench is not None:
            self._bench.order_off()
        self._try("the record was not ended", self.recording.void_the_open)
        if failed and self._powered:
            step = self._job.steps[self._done]
            self._try("the unit was not switched off", lambda: self._switch(False, step))
        return Left() if self._bench is None else self._bench.leave()

    @property
    def _open(self) -> OpenBench:
        assert self._bench is not None
        return self._bench

    # ------------------------------------------------------------ people

    def _planned_week(self) -> Callable[[], float]:
        """The first step of the session is made at its planned moment of the week."""
        steps = self._job.steps
        begin = steps[self._done].start_s if self._done < len(steps) else 0.0
        return planned_week(self._clock, self._job.start_s + begin)

    def _wait_for_people(self, index: int) -> None:
        """Until step `index` may begin (bench_run.shifts), with a look at table and chamber every minute."""
        left = self._hours.left(index) if index < len(self._job.steps) else 0.0
        if left > LONGEST_WAIT_S:
            self._say(f"waiting for people until {self._hours.opens(index)}, {left / 3600:.1f} h")
        while left > 0:
            self._clock.sleep(min(left, LONGEST_WAIT_S))
            if left > LONGEST_WAIT_S:
                self._open.look()
            left = self._hours.left(index)

    def _attend(self, step: Step, seconds: float) -> None:
        """Somebody at a table that stands still, and is seen to."""
        self._open.rest()
        self._eq.notify("person", f"{step.id}: {step.action}, {seconds / 60:.0f} min planned")
        self._operator.attend(step, seconds)

    # ------------------------------------------------------------ before the first step

    def _change_bench(self, step: Step) -> None:
        """Leave one bench, open the next: interlocks and limits first, chamber at room."""
        if self._bench is not None:
            how = self._bench.leave()
            if not how.safe:
                raise BenchFault(f"{self._bench.facts.name} could not be left: {how}")
        bench = self._job.benches[step.bench]
        self._bench = OpenBench(bench, self._eq, self._say, self._tell_status)
        self._bench.open(fastest_dps(_motions(self._job, bench.name), bench))

    def _catch_up(self, step: Step) -> None:
        """After a stop: setpoint and soak, then power when the repeat still lacks records."""
        if step.action in ("install", "ramp", "soak", "remove") and step.swept_degc is None:
            return  # they bring the temperature themselves
        self._say(f"going on at {step.id}")
        self._at_temperature(step)
        earlier = self._job.steps[: self._done]
        soaks = [
            s for s in earlier if s.action == "soak" and (same_place(s, step) or s.id == f"{step.visit}/soak")
        ]
        if soaks:
            self._open.hold(soaks[-1].seconds)
        if step.action != "power_on" and self._lacks_records(step):
            powered = next(s for s in reversed(earlier) if s.action == "power_on")
            self._switch(False, step)
            self._power_on(powered)
        self._lead_again()

    def _lacks_records(self, step: Step) -> bool:
        rest = self._job.steps[self._done :]
        return any(s.action == "record" and same_repeat(s, step) for s in rest)

    # ------------------------------------------------------------ the actions

    def _install(self, step: Step) -> None:
        self._open.rest()
        self._at_temperature(step)
        self._attend(step, step.seconds)

    _remove = _install

    def _ramp(self, step: Step) -> None:
        if step.swept_degc is None:
            self._at_temperature(step)
        else:
            self._open.sweep(step.swept_degc, step.seconds)

    def _soak(self, step: Step) -> None:
        self._at_temperature(step)
        self._open.hold(step.seconds)

    def _power_on(self, step: Step) -> None:
        self._at_temperature(step)
        if step.attended:
            self._attend(step, 0.0)
        self._journal.power_on()
        self._switch(True, step)
        self._open.hold(step.seconds)

    def _move(self, step: Step) -> None:
        turned = self._turned_round(step)
        if turned or step.attended:
            self._attend(step, step.seconds if turned else 0.0)
        self._open.move(step.motion, step.seconds)

    def _record(self, step: Step) -> None:
        self._began = self.recording.make(step, self._open, self._lead_again)

    def _lead_again(self) -> None:
        """After a void record on a ramp, or a stop in the midst of one: from where its ramp begins."""
        step = self._job.steps[self._done]
        if step.swept_degc is None:
            return
        record = step.id.removesuffix("/lead").removesuffix("/tail")
        way = [s for s in self._job.steps[: self._done] if s.id in (record, f"{record}/lead")]
        sweeps = [(s.swept_degc, s.seconds) for s in (*way, step) if s.swept_degc is not None]
        self._open.at_temperature(sweeps[0][0][0])
        self._open.move(next(s.motion for s in self._job.steps if s.id == record))
        for degc, seconds in sweeps[:-1]:
            self._open.sweep(degc, seconds)

    def _power_off(self, step: Step) -> None:
        self._open.rest()
        self._switch(False, step)

    def _cool_down(self, step: Step) -> None:
        self._open.hold(step.seconds)

    def _pause(self, step: Step) -> None:
        """Of a test: for its time. Of none: until people are there for what follows (bench_run.shifts)."""
        if step.test is None and (self._job.shifts or self._job.any_time):
            self._wait_for_people(self._done + 1)
        else:
            self._open.hold(step.seconds)

    # ------------------------------------------------------------ their parts

    def _at_temperature(self, step: Step) -> None:
        self._open.at_temperature(step.temperature_degc)

    def _turned_round(self, step: Step) -> bool:
        """Whether somebody must turn the unit: by hand on a plate, for the other sign on a one-axis arm."""
        bench = self._open.facts
        if not bench.driven:
            return True
        load = (step.motion or {}).get("acceleration_g")
        if load is None or bench.axes > 1:
            return False
        return (load < 0) != (self._last_load() < 0)

    def _last_load(self) -> float:
        for step in reversed(self._job.steps[: self._done]):
            if step.bench != self._job.steps[self._done].bench:
                break
            if step.action == "move" and step.motion and "acceleration_g" in step.motion:
                return step.motion["acceleration_g"]
        return 0.0

    def _switch(self, on: bool, step: Step) -> None:
        """A unit that could not be switched on may be on all the same: it will be switched off."""
        self._powered = self._powered or on
        self._eq.recorder.power(on, step, self._journal.power_ons)
        self._powered = on

    def _write(self, step: Step) -> None:
        measured = self._bench if step.action in ("soak", "record") else None
        entry = Entry(
            step=step.id,
            start_s=round(self._began, 6),
            end_s=round(self._clock.now(), 6),
            session=self._journal.session,
            power_on=self._journal.power_ons,
            utc=now_text(),
            temperature_degc=None if measured is None else measured.temperature_degc,
            planned_start_s=step.start_s,
            planned_end_s=step.end_s,
        )
        with self._eq.stop.held():
            self._journal.finished(entry)
            self.recording.written()

    def _tell_status(self) -> None:
        step, steps = self._job.steps[self._done], self._job.steps
        spent = min(self._clock.now() - self._began, step.seconds)
        at = bisect_right(self._attended, self._done)
        attended = steps[self._attended[at]] if at < len(self._attended) else None
        now = step.start_s + spent
        self._watch(
            Status(
                step.bench,
                step,
                self._done,
                len(steps),
                steps[-1].end_s - now,
                attended,
                0.0 if attended is None else attended.start_s - now,
                self._open.temperature_degc,
                self._open.angles,
            )
        )

    def _try(self, otherwise: str, action: Callable[[], None]) -> None:
        """A fault is said and not passed on."""
        try:
            action()
        except (PlannerError, OSError) as error:
            self._say(f"{ATTENTION}: {otherwise}: {error}")


def _motions(job: Job, bench: str) -> Iterator[Mapping[str, float] | None]:
    return (step.motion for step in job.steps if step.bench == bench)
