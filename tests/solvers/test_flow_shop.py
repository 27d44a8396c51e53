"""Sequences of jobs against every sequence."""

from itertools import pairwise, permutations

import numpy as np
import pytest

from planner.solvers.flow_shop import MOST_JOBS, completion_times, johnson, shortest_sequence


def longest_path(times, sequence):
    """The makespan as the longest monotone path through the table of times: no recursion over completions."""
    table = times[list(sequence)]
    jobs, machines = table.shape
    best = 0.0
    for turns in np.ndindex(*([jobs] * (machines - 1))):
        if list(turns) == sorted(turns):
            edges = [0, *turns, jobs - 1]
            best = max(best, sum(table[a : b + 1, m].sum() for m, (a, b) in enumerate(pairwise(edges))))
    return best


@pytest.mark.parametrize("machines", [1, 2, 3, 4])
@pytest.mark.parametrize("seed", range(3))
def test_no_sequence_is_shorter(machines, seed):
    rng = np.random.default_rng(seed)
    for _ in range(25):
        times = rng.integers(0, 9, (int(rng.integers(1, 6)), machines)).astype(float)
        found = shortest_sequence(times)
        every = {s: longest_path(times, s) for s in permutations(range(len(times)))}
        assert found.makespan == min(every.values()) == every[found.sequence]


def test_the_example_of_johnsons_rule():
    """S. M. Johnson's rule on a worked example whose answer is known: 5 jobs, 24 hours."""
    times = np.array([[3, 6], [5, 2], [1, 2], [6, 6], [7, 5]], dtype=float)
    assert johnson(times[:, 0], times[:, 1]) == (2, 0, 3, 4, 1)
    assert shortest_sequence(times).makespan == 24


def test_equal_batches_take_one_passage_and_the_slowest_bench_for_each_of_the_others():
    for machines in range(1, 6):
        passage = np.random.default_rng(machines).uniform(1, 9, machines)
        times = np.tile(passage, (40, 1))
        found = shortest_sequence(times)
        assert found.sequence == tuple(range(40))
        assert found.makespan == pytest.approx(passage.sum() + 39 * passage.max(), rel=1e-12)


def test_too_many_different_jobs_are_refused_on_three_machines_but_not_on_two():
    times = np.random.default_rng(0).uniform(1, 9, (MOST_JOBS + 1, 3))
    with pytest.raises(ValueError, match="exact up to"):
        shortest_sequence(times)
    assert len(shortest_sequence(times[:, :2]).sequence) == MOST_JOBS + 1


def test_nothing_takes_no_time():
    assert shortest_sequence(np.zeros((0, 2))).makespan == 0
    assert completion_times(np.ones((2, 2)), (1, 0)).tolist() == [[1, 2], [2, 3]]
