"""1000 campaigns are in benchmarks/study_bench_faults.py --campaigns 1000; here some, of fixed seeds."""

import os

import pytest

from tests.bench_run.campaigns import Notebook, campaign
from tests.bench_run.rig import small_job


@pytest.mark.parametrize("first", [1, 1001, 2001])
def test_whatever_goes_wrong_each_record_is_made_once_and_the_end_is_told_truly(first, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda handle: None)
    for seed in range(first, first + 6):
        folder = tmp_path / str(seed)
        folder.mkdir()
        assert campaign(small_job(), folder, seed).wrong == (), f"seed {seed}"


def test_the_study_sees_a_runner_that_voids_nothing(tmp_path, monkeypatch):
    """A test that cannot fail tests nothing: without doubts and without looking, something is found."""
    from planner.bench_run.record import Recording

    monkeypatch.setattr(os, "fsync", lambda handle: None)
    monkeypatch.setattr(Recording, "_why", lambda self, step, lasted, doubtful: "")
    assert any(campaign(small_job(), _made(tmp_path / str(seed)), seed).wrong for seed in range(1, 25))


def test_the_study_sees_a_bench_that_is_said_to_rest_and_turns(tmp_path, monkeypatch):
    from planner.bench_run.table import TableDriver

    monkeypatch.setattr(os, "fsync", lambda handle: None)
    monkeypatch.setattr(TableDriver, "restless", lambda self: [])
    outcomes = [campaign(small_job(), _made(tmp_path / str(seed)), seed) for seed in DEAF]
    assert any("said to be at zero rate" in why for outcome in outcomes for why in outcome.wrong)


def _made(folder):
    folder.mkdir()
    return folder


DEAF = range(1, 25)
assert Notebook  # the recorder that looks at the true bench
