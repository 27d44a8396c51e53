"""End to end over TCP: PyVISA, the command line, the simulator's ports."""

import json
import os
import signal

import pytest

from planner.bench_run import session
from planner.bench_run.errors import BenchFault, Interrupted
from planner.bench_run.simulator.faults import fault_from_text
from planner.bench_run.simulator.server import SimulatedBench
from planner.bench_run.visa import is_simulator
from planner.cli import app
from planner.errors import InputError
from planner.export.json import document_text
from tests.bench_run.rig import small_document, small_job


def request(bench, path, **changes):
    ports = bench.ports
    given = {
        "tables": (f"TCPIP::127.0.0.1::{ports.table}::SOCKET",),
        "chambers": (f"TCPIP::127.0.0.1::{ports.chamber}::SOCKET",),
        "journal": path,
        "clock_ports": (ports.clock,),
    }
    return session.Request(**(given | changes))


def records(path):
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    ids = {step.id for step in small_job().steps if step.action == "record"}
    return [line for line in lines if line.get("step") in ids]


def test_a_campaign_over_pyvisa_from_the_command_line(tmp_path):
    plan, job = tmp_path / "plan.json", small_job()
    plan.write_text(document_text(small_document()))
    with SimulatedBench() as bench:
        asked = request(bench, tmp_path / "run.jsonl")
        words = ["run", str(plan), "--table", asked.tables[0], "--chamber", asked.chambers[0]]
        app([*words, "--clock-port", str(bench.ports.clock)], standalone_mode=False)
        assert bench.table.refusals == []
        assert bench.chamber.refusals == []
        for line in records(tmp_path / "run.jsonl"):
            step = next(s for s in job.steps if s.id == line["step"])
            assert line["end_s"] - line["start_s"] == pytest.approx(60.0, abs=1e-3)
            for time in (line["start_s"], line["end_s"]):
                assert bench.chamber.at(time) == pytest.approx(step.temperature_degc, abs=0.55)
                if "rate_1_dps" in step.motion:
                    assert bench.table.at(1, time).rate_dps == pytest.approx(-200.0, abs=0.03)
    assert len(records(tmp_path / "run.jsonl")) == sum(s.action == "record" for s in job.steps)


FAULTS = [
    "dropped_connection:30@120",
    "late_reply:2.4@150",
    "doubled_reply@170",
    "garbled_reply@220",
    "suspended_client@240",
    "chamber.dropped_connection:30@40",
    "chamber.doubled_reply@60",
]


def test_what_passes_is_ridden_through_over_tcp(tmp_path):
    """All in one campaign: seconds of the wall are waited for replies only."""
    job, said = small_job(), []
    with SimulatedBench(faults=list(map(fault_from_text, FAULTS))) as bench:
        done = session.run(job, request(bench, tmp_path / "run.jsonl"), said.append)
        assert bench.table.refusals == []
        assert [bench.table.mode(axis) for axis in (1, 2)] == ["off", "off"]
        assert bench.chamber.setpoint_degc == 20.0
    assert done.steps == len(job.steps)
    assert sum("connecting again" in text for text in said) >= 2
    assert len(records(tmp_path / "run.jsonl")) == sum(s.action == "record" for s in job.steps)


def test_a_table_that_never_rests_again_is_tried_until_somebody_says_enough(tmp_path):
    """By the wall there is no other end; the message does not say that the table rests."""
    said, broken = [], []

    def enough(text):
        said.append(text)
        if text.startswith("ATTENTION"):
            os.kill(os.getpid(), signal.SIGTERM)

    def stop_at_the_ramp(step):
        if step.action == "ramp":
            broken.append(step)
            raise BenchFault("a bang")

    with SimulatedBench(speed=2000.0) as bench:
        receive = bench.table.receive
        bench.table.receive = lambda text: "200.0" if ":Read:Rate?" in text and broken else receive(text)
        asked = request(bench, tmp_path / "run.jsonl", clock_ports=(), speed=2000.0)
        with pytest.raises(
            BenchFault, match=r"a bang.*NOT everything.*NOT seen at zero rate: axis 1 reads 200"
        ):
            session.run(small_job(), asked, enough, stop_at_the_ramp)
    assert sum(text.startswith("ATTENTION") for text in said) == 1


def test_ctrl_c_ends_with_exit_4_and_says_how_to_go_on(tmp_path):
    def stop(step):
        if step.action == "record":
            os.kill(os.getpid(), signal.SIGINT)

    with SimulatedBench() as bench:
        with pytest.raises(Interrupted, match=r"SIGINT.*zero rate.*--resume") as caught:
            session.run(small_job(), request(bench, tmp_path / "run.jsonl"), lambda text: None, stop)
        assert caught.value.exit_code == 4
        assert bench.table.mode(1) == "off"
        assert bench.chamber.setpoint_degc == 20.0


def test_by_the_wall_the_simulator_runs_faster_too(tmp_path):
    """A few steps only: at a factor the network's time counts, so only the order of things is looked at."""
    job = small_job()
    with SimulatedBench(speed=2000.0) as bench:

        def stop(step):
            if step.action == "record":
                raise BenchFault("enough")

        asked = request(bench, tmp_path / "run.jsonl", clock_ports=(), speed=2000.0)
        with pytest.raises(BenchFault, match="enough"):
            session.run(job, asked, lambda text: None, stop)
        assert bench.table.refusals == []


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"tables": ()}, "no table for rate_table"),
        ({"tables": ("moon=TCPIP::127.0.0.1::1::SOCKET",)}, "--table takes one for all, or BENCH="),
        ({"chambers": ()}, "no chamber for rate_table; give --chamber RESOURCE"),
        ({"tables": ("TCPIP::127.0.0.1::1::SOCKET",)}, "cannot open|dropped"),
        ({"tables": ("nonsense",), "clock_ports": ()}, "cannot open|nobody to ask"),
        ({"tables": ("TCPIP::192.0.2.1::1::SOCKET",)}, "simulators on this machine"),
        ({"clock_ports": (1,)}, "no simulator's clock"),
        ({"clock_ports": (), "speed": 0.0}, "more than 0"),
        ({"tables": ("TCPIP::192.0.2.1::1::SOCKET",), "clock_ports": ()}, "nobody to ask"),
    ],
)
def test_what_cannot_be_run_with_is_refused(changes, message, tmp_path):
    with SimulatedBench() as bench, pytest.raises((InputError, BenchFault), match=message):
        session.run(small_job(), request(bench, tmp_path / "j", **changes), lambda t: None, lambda s: None)


def test_only_ports_of_this_machine_are_simulators():
    assert is_simulator("TCPIP::127.0.0.1::5025::SOCKET")
    assert is_simulator("tcpip0::localhost::5025::socket")
    for real in ("TCPIP::127.0.0.1.example.com::1::SOCKET", "TCPIP::10.0.0.1::1::SOCKET", "ASRL1::INSTR"):
        assert not is_simulator(real)


def test_a_dry_run_says_what_would_be_sent_and_opens_nothing(tmp_path):
    said = []
    asked = session.Request(tables=(), chambers=(), journal=tmp_path / "run.jsonl")
    session.rehearse(small_job(), asked, said.append)
    assert any(":Mode:Rate 1;:Demand:Rate 1,-200" in text for text in said)
    assert any("TEMP,S-40.0" in text for text in said)
    assert sum("record 60 s" in text for text in said) == sum(s.action == "record" for s in small_job().steps)
    assert list(tmp_path.iterdir()) == []


def test_a_plan_changed_by_hand_is_refused(tmp_path):
    plan = tmp_path / "plan.json"
    plan.write_text(document_text(small_document()).replace('"rate_1_dps": -200', '"rate_1_dps": -100'))
    with pytest.raises(InputError, match="changed after planner wrote it"):
        app(["run", str(plan), "--dry-run"], standalone_mode=False)


def test_a_bench_that_does_not_answer_is_named_before_anything_begins(tmp_path):
    with SimulatedBench() as bench:
        asked = request(bench, tmp_path / "run.jsonl", clock_ports=(), speed=10.0)
    with pytest.raises(InputError, match=r"cannot open TCPIP::127\.0\.0\.1::\d+::SOCKET: .*refused"):
        session.run(small_job(), asked, lambda text: None, lambda step: None)


def test_one_bench_of_a_plan_is_run_alone_with_a_journal_of_its_own(tmp_path):
    plan = tmp_path / "plan.json"
    plan.write_text(document_text(small_document()))
    with SimulatedBench() as bench:
        asked = request(bench, tmp_path / "run.jsonl")
        words = ["run", str(plan), "--table", asked.tables[0], "--chamber", asked.chambers[0]]
        app([*words, "--clock-port", str(bench.ports.clock), "--bench", "rate_table"], standalone_mode=False)
    assert len(records(tmp_path / "run.rate_table.jsonl")) == sum(
        step.action == "record" for step in small_job().steps
    )
