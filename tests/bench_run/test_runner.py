import json
import os
import signal

import pytest

from planner.bench_run.errors import BenchFault
from planner.bench_run.interrupts import stoppable
from planner.control.words import OFF
from planner.errors import InputError
from tests.bench_run.rig import Rig, small_job

FAULTS = {
    "lost_reply@60+": "no reply",
    "refused_command@90+": "error",
    "stuck_axis@130": "not arrived|left its place",
    "dropped_connection@200": "dropped",
    "chamber.lost_reply@40+": "no reply",
    "chamber.refused_command@5": "refused",
    "chamber.never_settles@5": "not settled",
    "chamber.dropped_connection@60": "dropped",
}


def steps_of(path):
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    return [line for line in lines if "step" in line]


@pytest.mark.parametrize(("fault", "message"), FAULTS.items())
def test_a_fault_makes_everything_safe_and_the_rest_can_be_made_later(fault, message, tmp_path):
    job, rig, path = small_job(), Rig(fault), tmp_path / "run.jsonl"
    with pytest.raises(BenchFault, match=message) as caught:
        rig.run(job, path)
    assert caught.value.exit_code == 4
    assert rig.is_safe() or any(text.startswith("ATTENTION") for text in rig.said)
    before = len(steps_of(path))
    assert 0 <= before < len(job.steps)
    assert Rig().run(job, path, resume=True).steps == len(job.steps) - before
    assert [line["step"] for line in steps_of(path)] == [step.id for step in job.steps]


@pytest.mark.parametrize("fault", [f for f in FAULTS if not f.endswith("+")])
def test_after_a_passing_fault_the_bench_is_surely_safe(fault, tmp_path):
    rig = Rig(fault)
    with pytest.raises(BenchFault):
        rig.run(small_job(), tmp_path / "run.jsonl")
    assert rig.is_safe()
    assert not [text for text in rig.said if text.startswith("ATTENTION")]


@pytest.mark.parametrize("number", [3, 40, 77, 150, 333])
def test_one_lost_reply_stops_nothing(number, tmp_path):
    job, rig = small_job(), Rig(f"lost_reply@{number}", f"chamber.lost_reply@{number}")
    assert rig.run(job, tmp_path / "run.jsonl").steps == len(job.steps)
    assert len(rig.recorder.made) == sum(step.action == "record" for step in job.steps)


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
    assert at == 0 or rig.table_line.sent[-1][1] == OFF or OFF in [m for _, m in rig.table_line.sent[-5:]]


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


@pytest.mark.parametrize("index", range(0, 110, 7))
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


def test_a_full_disk_stops_the_run_safely_with_exit_2(tmp_path, monkeypatch):
    job, rig = small_job(), Rig()
    write, count = os.write, 0

    def full(handle, data):
        nonlocal count
        count += 1
        if count == 20:
            raise OSError(28, "No space left on device")
        return write(handle, data)

    monkeypatch.setattr(os, "write", full)
    with pytest.raises(InputError, match=r"No space left.*--resume") as caught:
        rig.run(job, tmp_path / "run.jsonl")
    assert caught.value.exit_code == 2
    assert rig.is_safe()


def test_a_slow_answer_is_no_fault_of_the_axis(tmp_path):
    """Every look comes ten minutes late, after any deadline; what is there then is there."""
    job, rig = small_job(), Rig()
    sleep = rig.clock.sleep
    rig.clock.sleep = lambda seconds: sleep(seconds + (600.0 if seconds < 1.0 else 0.0))
    assert rig.run(job, tmp_path / "run.jsonl").steps == len(job.steps)
