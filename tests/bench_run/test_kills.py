"""1000 kills are in benchmarks/study_bench_faults.py --kills 1000; here a few dozen."""

import pytest

from tests.bench_run.kills import campaign_with_kills


@pytest.mark.parametrize("seed", [1, 2])
def test_kill_9_anywhere_loses_no_record_and_makes_none_twice(tmp_path, seed):
    assert campaign_with_kills(tmp_path, kills=30, seed=seed) >= 1
