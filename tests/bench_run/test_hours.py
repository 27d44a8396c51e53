"""People are asked for nothing outside the shifts, however late or early a run is."""

from dataclasses import replace

import pytest

from planner.bench_run import limits
from planner.bench_run.job import Job, job_from
from planner.bench_run.shifts import Hours, attended_spans
from planner.errors import InputError
from planner.export.json import plan_document
from planner.nouns.step import Step
from planner.quantities import DAY_S
from tests.bench_run.rig import Rig, small_job
from tests.specs import planned, small, with_plan

HOUR = 3600.0
WEEK = 7 * DAY_S
SHIFT = {"days": ["mon", "tue", "wed"], "from": "08:00", "to": "12:00"}


@pytest.fixture(scope="module")
def document() -> dict:
    """One attended test of two moves at two temperatures, in short shifts."""
    spec = small(requirement=[{"error": "position", "limit": "100 m", "rule": "worst_case"}])
    bench = spec["benches"]["rate_table"] | {"axes": 2, "move": "1 min", "remove": "20 min"}
    test = spec["tests"]["gyro_drift"] | {"attended": True, "power_on": "2 min", "cool_down": "10 min"}
    test["motions"] = [{"position_1": "0 deg"}, {"position_1": "90 deg"}]
    by_hand = {"gyro_drift": {"temperatures": ["-40 degC", "60 degC"], "repeats": 4}}
    spec |= {"benches": {"rate_table": bench}, "tests": {"gyro_drift": test}}
    return plan_document(planned(with_plan(spec, fixed=by_hand, shifts=SHIFT)).plan)


@pytest.fixture
def job(document) -> Job:
    return job_from(document)


class Watched(Rig):
    """A rig with somebody who notes when, in the week of the plan, he was asked; now and then he is slow."""

    def __init__(self, job: Job, *, delay_s: float = 0.0, begun_s: float = 0.0) -> None:
        super().__init__()
        self.origin, self.delay_s, self.asked = job.start_s + begun_s, delay_s, []

    def week(self) -> float:
        return self.origin + self.clock.now()

    def attend(self, step: Step, seconds: float) -> None:
        self.asked.append((step.id, self.week() % WEEK))
        self.clock.sleep(seconds + self.delay_s)

    def equipment(self, job: Job, **changes):
        return super().equipment(job, operator=self, week=self.week, **changes)


def in_shift(moment: float) -> bool:
    """Ten minutes of overtime are for what has been begun."""
    return any(8 * HOUR - 1e-3 <= moment - day * DAY_S <= 12 * HOUR + 600.0 for day in range(3))


@pytest.mark.parametrize("delay_s", [0.0, 1500.0])
@pytest.mark.further("delay_s", [2.9 * HOUR])
def test_nobody_is_asked_outside_the_shifts(job, delay_s, tmp_path):
    rig = Watched(job, delay_s=delay_s)
    rig.run(job, tmp_path / "run.jsonl")
    assert {id for id, _ in rig.asked} == {s.id for s in job.steps if s.attended}
    assert [id for id, when in rig.asked if not in_shift(when)] == []


def test_a_punctual_run_keeps_to_the_plan(job, tmp_path):
    """The plan's waiting is part of it: it ends when the plan does, but for the seconds of the polling."""
    rig = Watched(job)
    assert any(s.action == "pause" and s.test is None for s in job.steps)
    made = rig.run(job, tmp_path / "run.jsonl")
    assert made.seconds == pytest.approx(job.steps[-1].end_s, abs=600.0)


def test_whoever_is_late_waits_less(job, tmp_path):
    """Eight minutes lost while installing, within the overtime, are won back in the first night."""
    late, ends = Watched(job), []
    slow = late.attend
    late.attend = lambda step, s: slow(step, s + (480.0 if step.action == "install" else 0.0))
    late.run(job, tmp_path / "run.jsonl", before=lambda step: ends.append(late.clock.now()))
    waits = [i for i, s in enumerate(job.steps) if s.action == "pause" and s.test is None]
    assert ends[1] == pytest.approx(job.steps[1].start_s + 480.0, abs=3.0)  # looking at rest
    for i in waits:  # the clock at the beginning of the step after the waiting; 30 s of polling
        assert ends[i + 1] == pytest.approx(job.steps[i + 1].start_s, abs=30.0)


def test_a_run_that_begins_at_night_waits_for_the_morning(job, tmp_path):
    rig = Watched(job, begun_s=12 * HOUR)  # monday 20:00
    rig.run(job, tmp_path / "run.jsonl")
    assert rig.asked[0] == (job.steps[0].id, pytest.approx(DAY_S + 8 * HOUR, abs=1.0))
    assert any("waiting for people until tue 08:00" in text for text in rig.said)


def test_a_resumed_run_asks_in_the_shift_too(job, tmp_path):
    """Stopped in the midst of a repeat in the last minutes of the shift, resumed after it."""
    path, at = tmp_path / "run.jsonl", 12

    class StoppedError(Exception):
        pass

    def stop(step: Step) -> None:
        if step.id == job.steps[at].id:
            raise StoppedError

    with pytest.raises(StoppedError):
        Watched(job).run(job, path, before=stop)
    rig = Watched(job, begun_s=5 * HOUR)  # monday 13:00
    rig.run(job, path, resume=True)
    assert rig.asked[0][1] >= DAY_S + 8 * HOUR - 1e-3
    assert all(in_shift(when) for _, when in rig.asked)


def test_people_who_are_there_at_any_time_are_not_waited_for(document, tmp_path):
    job = job_from(document, any_time=True)
    rig = Watched(job)
    rig.run(job, tmp_path / "run.jsonl")
    waiting = sum(s.end_s - s.start_s for s in job.steps if s.action == "pause" and s.test is None)
    assert waiting > 24 * HOUR
    # ramps take what the simulated chamber takes, not what the plan gives them
    assert rig.clock.now() == pytest.approx(job.steps[-1].end_s - waiting, abs=0.5 * HOUR)


def test_a_plan_without_shifts_waits_for_nobody(tmp_path):
    job, moments = small_job(), []
    hours = Hours(job, lambda: moments.append(0.0) or 0.0, 0.0)
    assert all(hours.left(i) == 0.0 for i in range(len(job.steps)))


def test_the_spans_of_a_repeat_are_those_up_to_its_power_off(job):
    index = next(i for i, s in enumerate(job.steps) if s.action == "power_on")
    spans = attended_spans(job.steps, index)
    assert spans == ((0.0, 120.0), (120.0, 180.0), (1380.0, 1440.0))
    assert attended_spans(job.steps, index + 2) == ((1380.0 - 180.0, 1440.0 - 180.0),)
    cool_down = next(i for i, s in enumerate(job.steps) if s.action == "cool_down")
    assert attended_spans(job.steps, cool_down) == ()


def test_work_that_fits_into_no_shift_still_begins_in_one(job):
    short = replace(job, shifts=((8 * HOUR, 8 * HOUR + 60.0),))
    index = next(i for i, s in enumerate(job.steps) if s.action == "power_on")
    assert Hours(short, lambda: 9 * HOUR, 0.0).left(index) == pytest.approx(WEEK - HOUR)


def test_benches_that_work_at_the_same_time_are_run_one_by_one():
    spec = small(requirement=[{"error": "position", "limit": "100 m", "rule": "worst_case"}])
    bench = spec["benches"]["rate_table"]
    spec["benches"] = {name: bench | {"kind": "rate_table"} for name in ("one", "two")}
    for test, name in zip(spec["tests"].values(), spec["benches"], strict=True):
        test["bench"] = name
    job = job_from(plan_document(planned(with_plan(spec, units=3)).plan))
    limits.check(job)
    assert limits.side_by_side(job)
    parts = [job.on("one"), job.on("two")]
    assert sum(len(part.steps) for part in parts) == len(job.steps)
    for part in parts:
        limits.check(part)
    with pytest.raises(InputError, match="no steps on a bench 'three'"):
        job.on("three")
