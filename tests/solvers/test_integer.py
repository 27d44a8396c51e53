"""The integer program against every selection there is."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.solvers.integer import fold_private_resources, monotone_cut, solve
from planner.solvers.integer_problem import Group, Problem


def random_problem(seed: int, groups: int = 3, rows: int = 6, tightness: float = 0.8) -> Problem:
    rng = np.random.default_rng(seed)
    resources, limits = rng.integers(0, 5), rng.integers(1, 3)
    found = []
    for _ in range(groups):
        count = rng.integers(1, rows + 1)
        found.append(
            Group(
                rng.integers(0, 10, count).astype(float),
                rng.random((count, limits)),
                rng.integers(0, 3, (count, resources)).astype(float),
                np.arange(count),
            )
        )
    return Problem(
        tuple(found),
        rng.integers(0, 10, resources).astype(float),
        rng.random(limits) * groups * tightness,
        rng.integers(0, 2, resources).astype(float),
    )


def every_selection(problem: Problem):
    return product(*(range(len(group.cost)) for group in problem.groups))


@settings(deadline=None, max_examples=150)
@given(st.integers(0, 2**32 - 1))
def test_the_answer_is_the_cheapest_of_all_selections(seed):
    problem = random_problem(seed)
    costs = [problem.cost(s) for s in every_selection(problem) if problem.within_limits(s)]
    choice = solve(problem)
    if not costs:
        assert choice is None
        return
    assert choice is not None
    assert choice.proved
    assert choice.gap == 0
    assert choice.cost == pytest.approx(min(costs), abs=1e-9)
    assert problem.within_limits(choice.rows)
    assert problem.cost(choice.rows) == pytest.approx(choice.cost, abs=1e-9)


@settings(deadline=None, max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_a_nonlinear_condition_is_met_exactly_by_cuts(seed):
    problem = random_problem(seed, tightness=1.2)
    bar = 0.4 * len(problem.groups)

    def length(rows):
        return float(
            np.sqrt(sum(g.contribution[r, 0] ** 2 for g, r in zip(problem.groups, rows, strict=True)))
        )

    def check(rows):
        return monotone_cut(problem, rows) if length(rows) > bar else None

    allowed = [s for s in every_selection(problem) if problem.within_limits(s) and length(s) <= bar]
    choice = solve(problem, check=check)
    assert (choice is None) == (not allowed)
    if choice is not None:
        assert choice.proved
        assert length(choice.rows) <= bar
        assert choice.cost == pytest.approx(min(problem.cost(s) for s in allowed), abs=1e-9)


@settings(deadline=None, max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_folding_private_resources_changes_no_cost(seed):
    problem = random_problem(seed)
    folded = fold_private_resources(problem)
    for selection in every_selection(problem):
        assert folded.cost(selection) == pytest.approx(problem.cost(selection), abs=1e-9)


def test_a_limit_is_never_overstepped_by_the_solvers_own_tolerance():
    # the cheap row misses the limit by 1e-7, which HiGHS takes for zero; the exact answer is the dear one
    rows = Group(np.array([1.0, 2.0]), np.array([[1.0 + 1e-7], [0.5]]), np.zeros((2, 0)), np.arange(2))
    choice = solve(Problem((rows,), np.zeros(0), np.array([1.0]), np.zeros(0)))
    assert choice is not None
    assert choice.rows == (1,)


def test_a_resource_is_paid_once_at_its_largest_amount():
    group = Group(np.zeros(1), np.zeros((1, 1)), np.array([[3.0]]), np.arange(1))
    other = Group(np.zeros(1), np.zeros((1, 1)), np.array([[5.0]]), np.arange(1))
    choice = solve(Problem((group, other), np.array([7.0]), np.array([1.0]), np.zeros(1)))
    assert choice is not None
    assert choice.cost == 35


def test_running_out_of_solves_keeps_a_valid_bound():
    problem = random_problem(11, groups=3, tightness=2.0)
    with pytest.raises(TimeoutError, match="no selection was found"):
        solve(problem, check=lambda rows: monotone_cut(problem, rows), most_solves=1)
