import json
import os
import re
import signal
from itertools import cycle

import pytest

from planner.bench_run.errors import BenchFault
from planner.bench_run.interrupts import Stop, stoppable
from planner.bench_run.tolerances import Tolerances
from planner.control.words import OFF
from tests.bench_run.rig import Rig, compare, small_job

FAULTS = {
    "lost_reply@60+": "no reply",
    "refused_command@90+": "error",
    "stuck_axis@160": "not arrived|left its place",
    "dropped_connection:9999@200": "gave up after 10 min: .*dropped",
    "power_cut@200": "error at",  # the interlock has opened
    "nan_reading@150+": "'nan', 'nan' is no number",
    "jumped_reading@150+": "left its place|not arrived",
    "doubled_reply@150+": "void 5 times|twice",
    "late_reply:2.4@150+": "no reply",
    "full_disk@180": "No space left",
    "chamber.lost_reply@40+": "no reply",
    "chamber.refused_command@8": "refused",
    "chamber.ignored_command@8..20": "did not take 'TEMP,S-40.0': its setpoint is 20 degC",
    "chamber.never_settles@8": "not settled .* frozen, or it does not go",
    "chamber.frozen_reading@30+": "not settled .* frozen, or it does not go",
    "chamber.nan_reading@30+": "is no number",
    "chamber.jumped_reading:60@30+": "is a jump",
    "chamber.jumped_reading:500@30+": "beyond what the chamber can have",
    "chamber.dropped_connection:9999@60": "gave up after 10 min: .*dropped",
}
ONCE = [
    "lost_reply@{}",
    "late_reply:2.4@{}",
    "doubled_reply@{}",
    "garbled_reply@{}",
    "nan_reading@{}",
    "jumped_reading@{}",
    "ignored_command@{}",
    "dropped_connection:300@{}",
    "suspended_client@{}",
    "chamber.lost_reply@{}",
    "chamber.late_reply:2.4@{}",
    "chamber.nan_reading@{}",
    "chamber.jumped_reading@{}",
    "chamber.ignored_command@{}",
    "chamber.dropped_connection:300@{}",
    "chamber.power_cut:300@{}",
]


def steps_of(path):
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    return [line for line in lines if "step" in line]


@pytest.mark.parametrize(("fault", "message"), FAULTS.items())
def test_a_fault_makes_everything_safe_and_the_rest_can_be_made_later(fault, message, tmp_path):
    job, rig, path = small_job(), Rig(fault), tmp_path / "run.jsonl"
    with pytest.raises(BenchFault, match=message) as caught:
        rig.run(job, path)
    assert caught.value.exit_code == 4
    assert rig.left[0].safe == (not any(text.startswith("ATTENTION") for text in rig.said))
    assert rig.is_safe() or not rig.left[0].safe
    before = len(steps_of(path))
    assert 0 <= before < len(job.steps)
    assert Rig().run(job, path, resume=True).steps == len(job.steps) - before
    assert [line["step"] for line in steps_of(path)] == [step.id for step in job.steps]


@pytest.mark.parametrize("fault", ["refused_command@90", "full_disk@180", "chamber.never_settles@8"])
def test_after_a_passing_fault_the_bench_is_surely_safe(fault, tmp_path):
    rig = Rig(fault)
    with pytest.raises(BenchFault):
        rig.run(small_job(), tmp_path / "run.jsonl")
    assert rig.is_safe()
    assert rig.left[0].safe
    assert not [text for text in rig.said if text.startswith("ATTENTION")]


def test_an_axis_that_does_not_follow_is_not_said_to_rest(tmp_path):
    """Stuck, or its readings frozen: nobody can tell from here, so somebody must look. Not for ever."""
    rig = Rig("frozen_reading@160+")
    with pytest.raises(BenchFault):
        rig.run(small_job(), tmp_path / "run.jsonl")
    assert any("ATTENTION: table reads zero rate, but look at it" in text for text in rig.said)


@pytest.mark.parametrize(("fault", "number"), [*zip(ONCE, cycle([77, 333, 7]), strict=False)])
def test_what_passes_stops_nothing_and_no_record_is_doubtful(fault, number, tmp_path):
    """Every record is made once as complete, of its planned length, as the plan says it should be."""
    job, rig, path = small_job(), Rig(fault.format(number)), tmp_path / "run.jsonl"
    assert rig.run(job, path).steps == len(job.steps)
    records = [step for step in job.steps if step.action == "record"]
    assert [made[0] for made in rig.recorder.made] == [step.id for step in records]
    for step, (_, start, end, _) in zip(records, rig.recorder.made, strict=True):
        compare(rig, job.benches[step.bench], step, start, end, late_s=2.0)
    assert [line["step"] for line in steps_of(path)] == [step.id for step in job.steps]
    assert rig.left[0].safe
    assert rig.is_safe()


def test_one_late_reply_voids_its_record_and_shifts_no_other(tmp_path):
    """Message 340 is in a record; without making the line anew every later answer would be one too late."""
    job, rig, path = small_job(), Rig("late_reply:2.4@340"), tmp_path / "run.jsonl"
    rig.run(job, path)
    assert len(rig.recorder.void) <= 1
    told = [json.loads(line) for line in path.read_text().splitlines()]
    assert [line["void"] for line in told if "void" in line] == rig.recorder.void


def test_a_table_that_ignores_off_is_never_said_to_rest(tmp_path):
    """From the first record at a rate on the table hears nothing, and the run is stopped."""
    job, rig, path = small_job(), Rig("ignored_command@1+"), tmp_path / "run.jsonl"
    faulty = rig.table_line._device
    faults, faulty._faults = faulty._faults, ()
    turning = next(s for s in job.steps if s.action == "record" and "rate_1_dps" in s.motion)

    def stop(step):
        if step.start_s >= turning.end_s:
            faulty._faults = faults
            raise BenchFault("enough")

    with pytest.raises(BenchFault, match="enough"):
        rig.run(job, path, before=stop)
    assert rig.table.at(1).rate_dps == pytest.approx(-200.0)
    assert not rig.left[0].safe
    assert "table ordered off, NOT seen at zero rate: axis 1 reads -200 deg/s" in str(rig.left[0])
    attention = [text for text in rig.said if text.startswith("ATTENTION")]
    assert len(attention) > 30  # for an hour, every minute or so
    orders = [m for _, m in rig.table_line.sent if m == OFF]
    assert len(orders) > 60


def test_trying_ends_when_somebody_says_so(tmp_path):
    stop, rig = Stop(), Rig("ignored_command@400+", "refused_command@399+")
    stop.told = True
    with pytest.raises(BenchFault):
        rig.run(small_job(), tmp_path / "run.jsonl", stop=stop, patience_s=float("inf"))


def test_a_chamber_that_lost_its_temperature_is_soaked_again_for_as_long(tmp_path):
    job, rig, path = small_job(), Rig("chamber.power_cut:3600@160"), tmp_path / "run.jsonl"
    rig.run(job, path, tolerances=Tolerances(reconnect_s=7200.0))
    lost = [text for text in rig.said if "the temperature was lost for" in text]
    assert len(lost) == 1
    assert int(re.search(r"for (\d+) min", lost[0])[1]) >= 60
    records = [step for step in job.steps if step.action == "record"]
    for step, (_, start, end, _) in zip(records, rig.recorder.made, strict=True):
        compare(rig, job.benches[step.bench], step, start, end, late_s=2.0)


def test_a_device_that_starts_again_slowly_is_waited_for(tmp_path):
    """After a drop it takes connections, and says nothing for nine minutes."""
    job, rig = small_job(), Rig("chamber.dropped_connection@160", "chamber.lost_reply@161..200")
    assert rig.run(job, tmp_path / "run.jsonl").steps == len(job.steps)


def test_a_process_that_was_stopped_for_long_makes_its_record_again(tmp_path):
    """26 minutes pass in the middle of a record, with nobody looking at the bench."""
    job, rig, path = small_job(), Rig(), tmp_path / "run.jsonl"
    sleep, record = rig.clock.sleep, next(step for step in job.steps if step.action == "record")

    def suspended(seconds):
        if rig.recorder._start != (0.0, 0) and seconds > 10:
            rig.clock.sleep, seconds = sleep, seconds + 1560.0
        sleep(seconds)

    rig.clock.sleep = suspended
    rig.run(job, path)
    assert rig.recorder.void == [record.id]
    told = [json.loads(line) for line in path.read_text().splitlines()]
    (void,) = [line for line in told if "void" in line]
    assert "it lasted 1620 s instead of 60 s" in void["why"]
    for line in (line for line in told if "step" in line):
        step = next(s for s in job.steps if s.id == line["step"])
        assert (line["planned_start_s"], line["planned_end_s"]) == (step.start_s, step.end_s)


def test_a_rate_whose_angle_stays_is_a_frozen_reading(tmp_path):
    """The rate reads what was ordered, the angle no longer moves: one of them lies."""
    job, rig = small_job(), Rig()
    receive = rig.table.receive
    rig.table.receive = lambda message: (
        "12.5000" if message == ":Read:Position? 1" and turns() else receive(message)
    )

    def turns():
        return abs(rig.table.at(1).rate_dps) > 199.0

    with pytest.raises(BenchFault, match=r"axis 1 reads -200 deg/s, but its angle stays .* frozen reading"):
        rig.run(job, tmp_path / "run.jsonl")


def test_a_unit_that_could_not_be_switched_on_is_switched_off(tmp_path):
    job, rig = small_job(), Rig()
    power = rig.recorder.power

    def fails(on, step, number):
        power(on, step, number)
        if on:
            raise BenchFault("the recorder failed")

    rig.recorder.power = fails
    with pytest.raises(BenchFault, match="the recorder failed"):
        rig.run(job, tmp_path / "run.jsonl")
    assert [on for on, _ in rig.recorder.powered] == [True, False]


def test_a_record_that_was_begun_and_never_ended_is_said_to_be_void(tmp_path):
    """As after kill -9 in its midst."""
    job, path = small_job(), tmp_path / "run.jsonl"
    record = next(step for step in job.steps if step.action == "record")
    with pytest.raises(BenchFault):
        Rig("full_disk@180").run(job, path)
    rig = Rig()
    path.write_text("".join(line for line in path.read_text().splitlines(True) if '"void"' not in line))
    rig.run(job, path, resume=True)
    assert rig.recorder.lost_ones == [] or rig.recorder.lost_ones[0].startswith(record.id[:10])
    assert any("never finished: its data are void" in text for text in rig.said) == bool(
        rig.recorder.lost_ones
    )
    assert len(rig.recorder.made) + len(steps_of(path)) >= len(job.steps)


@pytest.mark.parametrize("signal_number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("at", [0, 3, 9, 17])
def test_a_signal_makes_everything_safe_and_keeps_the_journal(signal_number, at, tmp_path):
    job, rig, path = small_job(), Rig(), tmp_path / "run.jsonl"

    def before(step):
        if step.id == job.steps[at].id:
            os.kill(os.getpid(), signal_number)

    with stoppable(), pytest.raises(KeyboardInterrupt):
        rig.run(job, path, before=before)
    assert len(steps_of(path)) == at
    assert rig.is_safe()
    assert at == 0 or [m for _, m in rig.table_line.sent if "?" not in m][-1] == OFF


def test_a_signal_in_the_middle_of_a_record_makes_it_void(tmp_path):
    job, rig, path = small_job(), Rig(), tmp_path / "run.jsonl"
    record = next(step for step in job.steps if step.action == "record")
    sleep = rig.clock.sleep

    def interrupted(seconds):
        if rig.recorder._start != (0.0, 0):
            rig.clock.sleep = sleep
            raise KeyboardInterrupt
        sleep(seconds)

    rig.clock.sleep = interrupted
    with pytest.raises(KeyboardInterrupt):
        rig.run(job, path)
    assert rig.recorder.void == [record.id]
    assert rig.recorder.made == []
    assert record.id not in [line["step"] for line in steps_of(path)]


def stopped_before(job, path, index):
    """Run the campaign up to a step, then stop as after a power cut."""

    def before(step):
        if step.id == job.steps[index].id:
            raise BenchFault("power cut")

    with pytest.raises(BenchFault):
        Rig().run(job, path, before=before)


def test_resuming_within_a_repeat_soaks_and_powers_on_again_and_says_so(tmp_path):
    job, path = small_job(), tmp_path / "run.jsonl"
    index = next(i for i, s in enumerate(job.steps) if s.id.endswith("r02/m2"))
    stopped_before(job, path, index)
    rig = Rig()
    rig.run(job, path, resume=True)
    target = job.steps[index]
    sent = [message for _, message in rig.chamber_line.sent]
    assert [m for m in sent if m.startswith("TEMP,S")][:2] == [
        "TEMP,S20.0",
        f"TEMP,S{target.temperature_degc:.1f}",
    ]
    first = rig.recorder.made[0]
    assert first[0] == target.id
    soak = next(s for s in job.steps if s.action == "soak" and s.temperature_degc == target.temperature_degc)
    assert first[1] > soak.end_s - soak.start_s + 30.0  # the soak and the unit's 30 s from power-on
    lines = {line["step"]: line for line in steps_of(path)}
    earlier = next(s.id for s in job.steps if s.id.endswith("r02/m1") and s.repeat == target.repeat)
    assert lines[target.id]["power_on"] == lines[earlier]["power_on"] + 1
    assert lines[target.id]["session"] == 2


@pytest.mark.parametrize("index", range(0, 110, 14))
@pytest.mark.further("index", range(7, 110, 14))
def test_a_stop_anywhere_and_every_record_is_made_once(index, tmp_path):
    job, path = small_job(), tmp_path / "run.jsonl"
    stopped_before(job, path, index % len(job.steps))
    rig = Rig()
    rig.run(job, path, resume=True)
    assert [line["step"] for line in steps_of(path)] == [step.id for step in job.steps]
    on = [number for powered, number in rig.recorder.powered if powered]
    assert on == sorted(set(on))
    assert {made[3] for made in rig.recorder.made} <= set(on)


def test_interlocks_and_limits_come_first_and_demands_are_absolute(tmp_path):
    rig = Rig()
    rig.run(small_job(), tmp_path / "run.jsonl")
    orders = [m for _, m in rig.table_line.sent if "?" not in m]
    assert orders[:2] == [":Interlock:Reset ALL", ":Interlock:Close ALL"]
    assert orders[2].startswith(":Limit:Rate p,1,600;:Limit:Rate r,1,600;:Limit:Rate p,2,600")
    assert orders[-1] == OFF


def test_a_table_that_cannot_read_rates_is_waited_for(tmp_path, monkeypatch):
    from planner.bench_run.simulator import grammar

    known = {name: kinds for name, kinds in grammar.COMMANDS.items() if name != "Read:Rate?"}
    monkeypatch.setattr(grammar, "COMMANDS", known)
    job, rig = small_job(), Rig()
    assert rig.run(job, tmp_path / "run.jsonl").steps == len(job.steps)
    turning = [s.id for s in job.steps if s.action == "record" and "rate_1_dps" in s.motion]
    for name, start, end, _ in rig.recorder.made:
        if name in turning:
            assert [rig.table.at(1, t).rate_dps for t in (start, end)] == pytest.approx([-200.0, -200.0])


def test_a_full_disk_stops_the_run_safely_with_exit_4(tmp_path, monkeypatch):
    job, rig, path = small_job(), Rig(), tmp_path / "run.jsonl"
    write, count = os.write, 0

    def full(handle, data):
        nonlocal count
        count += 1
        if count >= 20:
            write(handle, data[:10])  # what still fits
            raise OSError(28, "No space left on device")
        return write(handle, data)

    monkeypatch.setattr(os, "write", full)
    with pytest.raises(BenchFault, match=r"No space left.*--resume") as caught:
        rig.run(job, path)
    assert caught.value.exit_code == 4
    assert rig.is_safe()
    monkeypatch.undo()
    assert all(json.loads(line) for line in path.read_text().splitlines())  # no part of a line stays
    again = Rig()
    again.run(job, path, resume=True)
    made = [name for name, *_ in [*rig.recorder.made, *again.recorder.made] if name not in rig.recorder.void]
    assert made == [step.id for step in job.steps if step.action == "record"]


def test_a_slow_answer_is_no_fault_of_the_axis(tmp_path):
    """Every look comes ten minutes late, after any deadline; what is there then is there."""
    job, rig = small_job(), Rig()
    sleep = rig.clock.sleep
    rig.clock.sleep = lambda seconds: sleep(seconds + (600.0 if 0.0 < seconds < 1.0 else 0.0))
    assert rig.run(job, tmp_path / "run.jsonl").steps == len(job.steps)
