from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.optimize import brentq

from planner.errors import InfeasibleError
from planner.nouns.sensitivities import Constraint
from planner.solvers.convex import Corners, relaxed_time
from planner.solvers.limit_surface import LimitSurface, binding
from planner.solvers.linear_combination import combined
from tests.solvers.constraint_cases import RULES, binding_case, named, random_constraint

CASES = [(rule, errors, seed) for rule in RULES for errors, seed in [(1, 1), (4, 2), (7, 3), (12, 4)]]
INTERIOR_POINT = 1e-6  # the solver stops at 1e-8 of the objective; a flat optimum moves by its root


def largest_load(constraints, errors, sizes) -> float:
    return max(float(combined(c, errors, sizes)) / c.limit for c in constraints)


@pytest.mark.parametrize(("rule", "errors", "seed"), CASES)
def test_the_corner_is_where_the_other_errors_are_least_and_the_limit_is_met(rule, errors, seed):
    """Beside a root search of scipy on the bare rule; `Corners` itself compares cvxpy with its own search."""
    constraints, lower, upper = binding_case(rule, errors, 3, seed)
    corners = Corners(constraints, named(errors), lower, upper)
    for j in range(min(errors, 4)):
        point = corners.error(j)

        def excess(size, j=j):
            sizes = np.where(np.arange(errors) == j, size, lower)
            return largest_load(constraints, named(errors), sizes) - 1.0

        expected = (
            upper[j] if excess(upper[j]) <= 0 else brentq(excess, lower[j], upper[j], rtol=1e-13, xtol=1e-300)
        )
        assert point[j] == pytest.approx(expected, rel=1e-10)  # percentiles are iterated to 1e-12
        np.testing.assert_array_equal(np.delete(point, j), np.delete(lower, j))


@pytest.mark.parametrize(("rule", "errors", "seed"), CASES)
def test_the_even_point_relaxes_all_errors_alike(rule, errors, seed):
    constraints, lower, upper = binding_case(rule, errors, 3, seed)
    point = Corners(constraints, named(errors), lower, upper).even()
    shares = (point - lower) / (upper - lower)
    np.testing.assert_allclose(shares, shares[0], rtol=1e-9)
    assert largest_load(constraints, named(errors), point) == pytest.approx(1.0, rel=1e-10)


@pytest.mark.parametrize("rule", ["worst_case", "rss"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_cvxpy_and_the_search_along_the_ray_find_the_same_corner(rule, seed):
    constraints, lower, upper = binding_case(rule, 5, 4, seed)
    corners = Corners(constraints, named(5), lower, upper)
    assert corners._program is not None
    for j in range(5):
        certified = lower[j] + corners._program.solve(j) * (upper[j] - lower[j])
        assert certified == pytest.approx(corners.error(j)[j], rel=INTERIOR_POINT)


@pytest.mark.parametrize("rule", RULES)
def test_no_random_point_within_the_limits_beats_a_corner(rule):
    constraints, lower, upper = binding_case(rule, 3, 2, 9)
    corners = Corners(constraints, named(3), lower, upper)
    points = lower + (upper - lower) * np.random.default_rng(9).random((20_000, 3)) ** 3
    allowed = points[LimitSurface(constraints, named(3), 1e-9).load(points) <= 1.0]
    assert len(allowed) > 100
    for j in range(3):
        assert allowed[:, j].max() <= corners.error(j)[j] * (1 + 1e-9)


def test_a_wide_limit_leaves_the_upper_bounds():
    constraints, lower, upper = binding_case("rss", 3, 1, 5)
    wide = [replace(constraints[0], limit=1e9)]
    np.testing.assert_allclose(Corners(wide, named(3), lower, upper).even(), upper, rtol=1e-12)


def test_an_error_that_does_not_matter_may_be_as_large_as_it_can():
    constraint = Constraint(0, "north", "m", "worst_case", 1.0, 60.0, {"a": np.array([[2.0]])})
    point = Corners([constraint], ("a", "b"), np.zeros(2), np.array([9.0, 7.0])).error(1)
    np.testing.assert_allclose(point, [0.0, 7.0])


@pytest.mark.parametrize("rule", RULES)
def test_lower_bounds_beyond_the_limit_are_refused(rule):
    constraints, lower, upper = binding_case(rule, 3, 2, 6)
    with pytest.raises(InfeasibleError, match="smallest"):
        Corners(
            [replace(c, limit=c.limit * 1e-6) for c in constraints], named(3), lower + 1e-3 * upper, upper
        )


# ---------------------------------------------------------------- the limit surface


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_load_is_the_worst_share_of_a_limit(rule, seed):
    constraints, lower, upper = binding_case(rule, 4, 3, seed)
    points = lower + (upper - lower) * np.random.default_rng(seed).random((20, 4))
    expected = [largest_load(constraints, named(4), point) for point in points]
    np.testing.assert_allclose(LimitSurface(constraints, named(4)).load(points), expected, rtol=1e-11)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_reach_ends_on_the_limit_or_at_the_bound_and_never_beyond(rule, seed):
    constraints, lower, upper = binding_case(rule, 4, 3, seed)
    surface = LimitSurface(constraints, named(4))
    rays = (upper - lower) * np.random.default_rng(seed).random((50, 4)) ** 2
    far = surface.reach(lower, rays, np.ones(50))
    loads = surface.load(lower + far[:, None] * rays)
    assert (loads <= 1 + 1e-11).all()
    assert ((loads >= 1 - 1e-11) | (far == 1.0)).all()
    assert (far < 1.0).any()


def test_mixed_rules_are_all_kept():
    cases = [binding_case(rule, 3, 2, 11) for rule in RULES]
    constraints = [c for case in cases for c in case[0]]
    lower, upper = cases[0][1], cases[0][2]
    corners = Corners(constraints, named(3), lower, upper)
    for point in [corners.error(0), corners.error(2), corners.even()]:
        assert largest_load(constraints, named(3), point) <= 1 + 1e-11
    together = LimitSurface(constraints, named(3)).load(upper)
    assert together == pytest.approx(
        max(LimitSurface(c, named(3)).load(upper) for c, _, _ in cases), rel=1e-11
    )


def test_the_binding_constraints_are_those_that_are_used_most_somewhere():
    rng = np.random.default_rng(12)
    base = random_constraint("rss", 3, rng)
    slack = replace(base, limit=2.0, requirement=1)
    other = replace(random_constraint("rss", 3, rng, index=2), limit=1e6)
    assert binding([slack, base, other], named(3), rng.random((50, 3))) == [base]


def test_a_limit_that_is_not_positive_is_refused():
    with pytest.raises(ValueError, match="positive"):
        LimitSurface([random_constraint("rss", 2, np.random.default_rng(1), limit=0.0)], named(2))


# ---------------------------------------------------------------- the relaxed campaign


def problem(seed: int, errors: int = 5, requirements: int = 1):
    rng = np.random.default_rng(seed)
    cost, spread = rng.uniform(0.1, 5.0, errors), 10 ** rng.uniform(-5, -2, errors)
    weights = 10 ** rng.uniform(0, 5, (requirements, errors))
    return cost, spread, weights, (weights @ spread) / rng.uniform(3.0, 30.0, requirements)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_one_requirement_has_lagranges_answer(seed):
    """worst_case: d_j ∝ (c_j q_j² / w_j)^(1/3); rss: d_j ∝ (c_j q_j² / w_j²)^(1/4); value ∝ R⁻² in both."""
    cost, spread, weights, slack = problem(seed)
    w = weights[0]
    for rule, width in (
        ("worst_case", (cost * spread**2 / w) ** (1 / 3)),
        ("rss", (cost * spread**2 / w**2) ** (1 / 4)),
    ):
        used = w @ width if rule == "worst_case" else np.sqrt(w**2 @ width**2)
        width *= slack[0] / used
        found = relaxed_time(cost, spread, weights, slack, rule, 1e-9)
        value = cost @ (spread / width) ** 2
        assert found.value == pytest.approx(value, rel=INTERIOR_POINT)
        assert found.dual[0] == pytest.approx(2 * value / slack[0], rel=1e-4)  # multipliers converge last


@pytest.mark.parametrize("rule", ["worst_case", "rss"])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_dual_is_the_slope_of_the_value(rule, seed):
    cost, spread, weights, slack = problem(seed, requirements=3)
    dual = relaxed_time(cost, spread, weights, slack, rule, 1.0).dual
    for r in range(3):
        step = 1e-3 * slack * (np.arange(3) == r)
        values = [relaxed_time(cost, spread, weights, slack + s, rule, 1.0).value for s in (-step, step)]
        slope = (values[0] - values[1]) / (2 * step[r])
        # the difference divides 1e-8 of the value by 2e-3; the value's curvature adds 1e-6
        assert dual[r] == pytest.approx(slope, rel=1e-3, abs=1e-4 * max(dual))


@pytest.mark.parametrize("rule", ["worst_case", "rss"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_whole_repeats_are_never_cheaper_than_the_relaxation(rule, seed):
    """Every combination of 2..12 repeats of three errors, tried."""
    cost, spread, weights, _ = problem(seed, errors=3, requirements=2)
    middle = spread / np.sqrt(6.0)
    norm = 1 if rule == "worst_case" else 2
    slack = ((weights * middle) ** norm).sum(axis=1) ** (1 / norm)
    found = relaxed_time(cost, spread, weights, slack, rule, 2.0)
    best = min(
        cost @ np.array(n)
        for n in product(range(2, 13), repeat=3)
        if (((weights * spread / np.sqrt(n)) ** norm).sum(axis=1) ** (1 / norm) <= slack * (1 + 1e-12)).all()
    )
    assert found.value <= best * (1 + INTERIOR_POINT)
    assert found.value > 0.6 * best  # and it is no empty bound
    used = ((weights * found.half_widths) ** norm).sum(axis=1) ** (1 / norm)
    assert (used <= slack * (1 + INTERIOR_POINT)).all()
    assert (found.repeats >= 2.0 * (1 - 1e-12)).all()


def test_with_slack_to_spare_the_least_repeats_do_and_more_slack_is_worth_nothing():
    cost, spread, weights, slack = problem(7)
    found = relaxed_time(cost, spread, weights, slack * 1e3, "worst_case", 2.0)
    assert found.value == pytest.approx(2.0 * cost.sum(), rel=INTERIOR_POINT)
    assert found.dual[0] * slack[0] * 1e3 < 1e-4 * found.value


def test_what_cannot_be_relaxed_is_refused():
    cost, spread, weights, slack = problem(8)
    with pytest.raises(InfeasibleError, match="leaves nothing"):
        relaxed_time(cost, spread, weights, 0 * slack, "rss", 2.0)
    with pytest.raises(ValueError, match="percentile"):
        relaxed_time(cost, spread, weights, slack, "percentile", 2.0)
    with pytest.raises(ValueError, match="positive"):
        relaxed_time(cost, 0 * spread, weights, slack, "rss", 2.0)
