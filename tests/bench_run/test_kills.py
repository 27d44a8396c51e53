"""1000 kills are in benchmarks/study_bench_faults.py --kills 1000; here some over several campaigns."""

import os

import pytest

from planner.bench_run.record import Recording
from tests.bench_run.kills import campaigns_with_kills


@pytest.fixture(autouse=True)
def _disk(monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda handle: None)  # what the disk does is not at stake


@pytest.mark.parametrize("seed", [1])
def test_kill_9_anywhere_loses_no_record_and_makes_none_twice(tmp_path, seed):
    tally = campaigns_with_kills(tmp_path, kills=8, seed=seed)
    assert tally.wrong == ()
    assert tally.campaigns > 1


def test_the_study_sees_a_runner_that_forgets_what_it_was_in_the_middle_of(tmp_path, monkeypatch):
    """A test that cannot fail tests nothing: data of a record cut short would stand beside the good."""
    monkeypatch.setattr(Recording, "void_the_unfinished", lambda self, steps: None)
    assert campaigns_with_kills(tmp_path, kills=12, seed=3).wrong
