"""1000 campaigns are in benchmarks/study_bench_faults.py --campaigns 1000; here some, of fixed seeds."""

import json
import os

import pytest

from planner.bench_run.record import Recording
from planner.bench_run.table import TableDriver
from tests.bench_run.campaigns import campaign
from tests.bench_run.other_bench import Fault
from tests.bench_run.rig import small_job


@pytest.mark.parametrize("first", [1])
@pytest.mark.further("first", [1001, 2001])
def test_whatever_goes_wrong_each_record_is_made_once_and_the_end_is_told_truly(first, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda handle: None)
    for seed in range(first, first + 6):
        folder = tmp_path / str(seed)
        folder.mkdir()
        assert campaign(small_job(), folder, seed).wrong == (), f"seed {seed}"


def test_the_study_sees_a_runner_that_voids_nothing(tmp_path, monkeypatch):
    """A test that cannot fail tests nothing: without doubts and without looking, something is found."""
    monkeypatch.setattr(os, "fsync", lambda handle: None)
    monkeypatch.setattr(Recording, "_why", lambda self, step, lasted, doubtful: "")
    assert any(campaign(small_job(), _made(tmp_path / str(seed)), seed).wrong for seed in range(1, 25))


@pytest.mark.parametrize("is_blind", [True, False])
def test_the_study_sees_a_bench_that_is_said_to_rest_and_turns(is_blind, tmp_path, monkeypatch):
    """A table that hears nothing any more, from some moment on; and a runner that looks at nothing."""
    monkeypatch.setattr(os, "fsync", lambda handle: None)
    if is_blind:
        monkeypatch.setattr(TableDriver, "restless", lambda self: [])
    job, calm, loud = small_job(), _made(tmp_path / "calm"), _made(tmp_path / "loud")
    assert campaign(job, calm, 1, []).wrong == ()
    turning = next(step.id for step in job.steps if step.action == "record" and "rate_1_dps" in step.motion)
    lines = map(json.loads, (calm / "run.jsonl").read_text().splitlines())
    start = next(line["start_s"] for line in lines if line.get("step") == turning)
    outcome = campaign(job, loud, 1, [Fault("table", "deaf", start + 10.0, 1e9)])
    assert any("said to be at zero rate" in why for why in outcome.wrong) == is_blind
    assert outcome.attention == (not is_blind)


def _made(folder):
    folder.mkdir()
    return folder
