from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.errors import InfeasibleError
from planner.nouns.allowances import AllowedErrors
from planner.nouns.sensitivities import Constraint
from planner.plan.sensitivity_to_allowance import FRONT_POINTS, allowed_errors
from planner.solvers.genetic import GeneticSettings
from planner.solvers.linear_combination import combined, shares
from tests.solvers.constraint_cases import RULES, binding_case, named

LARGEST_GAP = 0.005  # how far the genetic algorithm may stay behind the exact optimum
EXACT = 1e-11  # percentiles are iterated to 1e-12, everything else to rounding
CASES = [
    (rule, errors, requirements, seed)
    for rule in RULES
    for errors, requirements, seed in [(1, 1, 1), (4, 1, 2), (4, 3, 3), (8, 2, 4)]
]


def allowed(constraints, lower, upper, seed=1, settings=None) -> AllowedErrors:
    errors = named(len(lower))
    return allowed_errors(
        constraints,
        errors,
        dict.fromkeys(errors, "deg/s"),
        dict(zip(errors, lower, strict=True)),
        dict(zip(errors, upper, strict=True)),
        settings or GeneticSettings(),
        seed,
    )


def loads(constraints, errors, points) -> np.ndarray:
    return np.max([combined(c, errors, points) / c.limit for c in constraints], axis=0)


@pytest.fixture(scope="module", params=CASES, ids=str)
def case(request):
    rule, errors, requirements, seed = request.param
    constraints, lower, upper = binding_case(rule, errors, requirements, seed)
    return constraints, lower, upper, allowed(constraints, lower, upper, seed)


def test_the_front_lies_on_the_limit_or_at_the_bounds_and_never_beyond(case):
    constraints, lower, upper, found = case
    front = np.array(found.front)
    used = loads(constraints, found.errors, front)
    assert (used <= 1 + EXACT).all()
    assert ((used >= 1 - EXACT) | np.isclose(front, upper, rtol=1e-12).all(axis=1)).all()
    # a bound may be met by smallest + 1·(largest − smallest), which rounds in the last digit
    assert ((front >= lower * (1 - 1e-15)) & (front <= upper * (1 + 1e-15))).all()


def test_no_point_of_the_front_is_exceeded_by_another_in_every_error(case):
    front = np.array(case[3].front)
    assert 1 <= len(front) <= FRONT_POINTS
    for i, point in enumerate(front):
        others = np.delete(front, i, axis=0)
        assert not (others >= point).all(axis=1).any()


def test_no_error_of_the_front_could_be_raised(case):
    constraints, _, upper, found = case
    for point in np.array(found.front)[::20]:
        for j in range(len(upper)):
            raised = point.copy()
            raised[j] = min(point[j] * (1 + 1e-6), upper[j])
            # raised by a millionth it must break a limit, unless its bound stopped it or it hardly counts
            counts = max(shares(c, found.errors, raised)[j] for c in constraints) > 1e-4
            if raised[j] > point[j] * (1 + 1e-9) and counts:
                assert loads(constraints, found.errors, raised) > 1


def test_every_exact_corner_is_at_least_the_genetic_one_and_the_gap_is_kept(case):
    constraints, lower, upper, found = case
    assert [corner.name for corner in found.corners] == [*found.errors, "even"]
    for corner in found.corners[:-1]:
        exact, genetic = corner.exact[corner.name], corner.genetic[corner.name]
        assert genetic <= exact * (1 + EXACT)
        assert 0 <= corner.gap <= LARGEST_GAP
        assert corner.gap == pytest.approx((exact - genetic) / exact, abs=EXACT)
    for corner in found.corners:
        for sizes in (corner.exact, corner.genetic):
            point = np.array([sizes[error] for error in found.errors])
            assert loads(constraints, found.errors, point) <= 1 + EXACT
    exact, genetic = (
        min((sizes[e] - a) / (b - a) for e, a, b in zip(found.errors, lower, upper, strict=True))
        for sizes in (found.corners[-1].exact, found.corners[-1].genetic)
    )
    assert genetic <= exact * (1 + 1e-9)
    assert (exact - genetic) / exact <= LARGEST_GAP


def test_the_front_reaches_its_corners(case):
    """No point has more of an error than its corner, and one has as much as the genetic corner."""
    found = case[3]
    front = np.array(found.front)
    for j, corner in enumerate(found.corners[:-1]):
        assert front[:, j].max() <= corner.exact[corner.name] * (1 + EXACT)
        assert front[:, j].max() >= corner.genetic[corner.name] * (1 - EXACT)


def test_tightness_is_what_the_smallest_errors_use(case):
    constraints, lower, _, found = case
    for constraint in constraints:
        used = float(combined(constraint, found.errors, lower)) / constraint.limit
        assert found.tightness[constraint.requirement] == pytest.approx(used, rel=EXACT)


def test_a_front_of_two_errors_covers_the_whole_line():
    """1·a + 1·b = 1: the front is the segment between the corners, without a hole."""
    vectors = {name: np.array([[1.0]]) for name in named(2)}
    constraint = Constraint(0, "north", "m", "worst_case", 1.0, 60.0, vectors)
    front = np.array(allowed([constraint], np.zeros(2), np.full(2, 5.0)).front)
    np.testing.assert_allclose(front.sum(axis=1), 1.0, rtol=EXACT)
    assert len(front) > 100
    assert np.diff(np.concatenate([[0.0], np.sort(front[:, 0]), [1.0]])).max() < 0.03


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3, 4])
def test_the_gap_is_kept_for_several_seeds(rule, seed):
    constraints, lower, upper = binding_case(rule, 4, 1, 21)
    found = allowed(constraints, lower, upper, seed)
    assert max(corner.gap for corner in found.corners) <= LARGEST_GAP


def test_the_published_model_has_its_corners():
    """K table 3.1 and theory's coefficients of small UAV 1: S = Σ w ε is linear, so a corner is R / w."""
    unit = np.array([0.001, 0.001, 1e-4, 1e-4])  # °/s, g, 1, 1
    weight = 0.25 * np.array([2.314, 1.245, 0.136, 4.006]) / unit
    vectors = {name: np.array([[w]]) for name, w in zip(named(4), weight, strict=True)}
    constraint = Constraint(0, "position", "m", "worst_case", 10.0, 60.0, vectors)
    upper = np.array([0.03, 0.02, 0.005, 0.005])
    found = allowed([constraint], np.zeros(4), upper)
    corner = [c.exact[c.name] for c in found.corners[:-1]]
    np.testing.assert_allclose(corner, np.minimum(10.0 / weight, upper), rtol=1e-12)


@pytest.mark.parametrize("rule", RULES)
def test_the_same_seed_gives_the_same_answer_and_another_seed_another_front(rule):
    constraints, lower, upper = binding_case(rule, 4, 1, 5)
    few = GeneticSettings(generations=10)
    first, again, other = (allowed(constraints, lower, upper, seed, few) for seed in (3, 3, 4))
    assert first == again
    assert first.front != other.front


@pytest.mark.parametrize(
    "extreme",
    [
        GeneticSettings(individuals=4, best=2, generations=1),
        GeneticSettings(individuals=5, best=4, mutation=1.0, crossover=1.0, generations=3),
        GeneticSettings(individuals=10_000, best=2, mutation=0.0, crossover=0.0, generations=2),
        GeneticSettings(bits=1, generations=5),
    ],
)
def test_poor_settings_cost_gap_but_never_the_limit(extreme):
    constraints, lower, upper = binding_case("rss", 4, 2, 12)
    found = allowed(constraints, lower, upper, settings=extreme)
    assert (loads(constraints, found.errors, np.array(found.front)) <= 1 + EXACT).all()
    assert all(0 <= corner.gap <= 1 for corner in found.corners)


def test_a_tighter_limit_never_allows_more():
    constraints, lower, upper = binding_case("worst_case", 4, 1, 6)
    exact = []
    for factor in (1.0, 1.3, 2.0):
        wider = [replace(c, limit=factor * c.limit) for c in constraints]
        exact.append([c.exact[c.name] for c in allowed(wider, lower, upper).corners[:-1]])
    assert (np.diff(exact, axis=0) >= 0).all()
    assert (np.diff(exact, axis=0) > 0).any()


def test_errors_without_a_choice_are_constants():
    constraints, lower, upper = binding_case("rss", 4, 1, 7)
    upper = np.where(np.arange(4) == 2, lower, upper)
    found = allowed(constraints, lower, upper)
    assert {point[2] for point in found.front} == {lower[2]}
    assert [corner.name for corner in found.corners] == [*np.delete(named(4), 2), "even"]


def test_when_everything_is_allowed_the_front_is_the_largest_point():
    constraints, lower, upper = binding_case("percentile", 3, 1, 8)
    found = allowed([replace(constraints[0], limit=1e9)], lower, upper)
    assert found.front == (tuple(upper),)
    assert all(corner.exact == corner.genetic and corner.gap == 0 for corner in found.corners)
    assert found.history.generations == 0


@pytest.mark.parametrize("rule", RULES)
def test_what_cannot_be_met_is_refused_with_what_binds_and_the_nearest_limit(rule):
    constraints, lower, upper = binding_case(rule, 4, 1, 9)
    lower = 0.5 * upper
    reachable = float(combined(constraints[0], named(4), lower))
    impossible = replace(constraints[0], limit=reachable / 2)
    with pytest.raises(InfeasibleError, match="cannot be met") as refused:
        allowed([impossible], lower, upper)
    assert refused.value.nearest_limit == pytest.approx(reachable, rel=EXACT)
    parts = shares(impossible, named(4), lower)
    assert [name for name, _ in refused.value.binds] == [named(4)[i] for i in np.argsort(-parts)]
    assert [share for _, share in refused.value.binds] == pytest.approx(np.sort(parts)[::-1].tolist())
    for slack in (0.0, 1e-9, 1e-4):
        barely = replace(impossible, limit=refused.value.nearest_limit * (1 + slack))
        found = allowed([barely], lower, upper)
        assert found.tightness[0] == pytest.approx(1.0, abs=2 * slack + EXACT)
        assert (loads([barely], found.errors, np.array(found.front)) <= 1 + 1e-9).all()
        # what a slack of 1e-4 of the limit leaves is of that order, not the whole range
        assert max(c.gap for c in found.corners) <= LARGEST_GAP


def test_contradictory_bounds_are_refused():
    constraints, lower, upper = binding_case("rss", 3, 1, 10)
    for wrong in ((upper, lower), (-lower, upper), (lower, upper * np.inf), (lower * np.nan, upper)):
        with pytest.raises(ValueError, match="smallest"):
            allowed(constraints, *wrong)
