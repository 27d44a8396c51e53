from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.nouns.array import Rule
from planner.nouns.sensitivities import Constraint
from planner.solvers.linear_combination import combination, combined, shares, weights
from tests.solvers.constraint_cases import RULES, named, random_constraint

# sums of a few products: a handful of roundings of 1.1e-16; percentiles are iterated to 1e-12
ROUNDING = 1e-13
ITERATED = 1e-11

cases = st.tuples(st.sampled_from(RULES), st.integers(1, 6), st.integers(1, 3), st.integers(0, 2**32 - 1))


def drawn(case: tuple[Rule, int, int, int]) -> tuple[Constraint, tuple[str, ...], np.ndarray]:
    rule, errors, components, seed = case
    rng = np.random.default_rng(seed)
    constraint = random_constraint(rule, errors, rng, components=components)
    return constraint, named(errors), 10 ** rng.uniform(-3, 1, errors)


@settings(deadline=None, max_examples=60)
@given(cases, st.floats(1e-6, 1e6))
def test_scaled_sizes_scale_the_value(case, factor):
    constraint, errors, sizes = drawn(case)
    value = combined(constraint, errors, sizes)
    assert combined(constraint, errors, factor * sizes) == pytest.approx(factor * value, rel=ITERATED)


@settings(deadline=None, max_examples=60)
@given(cases, st.integers(0, 5), st.floats(1.001, 10))
def test_the_value_grows_with_every_size(case, which, factor):
    constraint, errors, sizes = drawn(case)
    larger = sizes.copy()
    larger[which % len(sizes)] *= factor
    # not strictly in floating point: an error may add less than the last digit
    assert combined(constraint, errors, larger) >= combined(constraint, errors, sizes) * (1 - ITERATED)


@settings(deadline=None, max_examples=60)
@given(cases, st.randoms(use_true_random=False))
def test_the_order_of_the_errors_does_not_matter(case, random):
    constraint, errors, sizes = drawn(case)
    order = random.sample(range(len(errors)), len(errors))
    shuffled = combined(constraint, [errors[i] for i in order], sizes[order])
    assert shuffled == pytest.approx(combined(constraint, errors, sizes), rel=ITERATED)


@settings(deadline=None, max_examples=60)
@given(cases)
def test_the_sum_is_never_below_the_root_of_squares(case):
    constraint, errors, sizes = drawn(case)
    total = combined(replace(constraint, rule="worst_case"), errors, sizes)
    root = combined(replace(constraint, rule="rss"), errors, sizes)
    assert total >= root * (1 - ROUNDING)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_sum_is_the_longest_vector_that_aligned_contributions_could_make(seed):
    """All vectors along one axis: the worst of all combinations of signs is the sum."""
    rng = np.random.default_rng(seed)
    vectors = {name: np.outer(rng.normal(size=2), [0.0, 1.0, 0.0]) for name in named(3)}
    constraint = Constraint(0, "position", "m", "worst_case", 1.0, 60.0, vectors)
    sizes = rng.uniform(0.1, 1.0, 3)
    moved = np.concatenate([vectors[name] * size for name, size in zip(named(3), sizes, strict=True)])
    worst = max(np.linalg.norm(np.array(signs) @ moved) for signs in product((-1, 1), repeat=len(moved)))
    assert combined(constraint, named(3), sizes) == pytest.approx(worst, rel=ROUNDING)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_root_of_squares_is_the_rms_length_of_independent_contributions(seed):
    rng = np.random.default_rng(seed)
    constraint, sizes = random_constraint("rss", 4, rng), rng.uniform(0.1, 1.0, 4)
    trace = sum(
        size**2 * np.trace(constraint.vectors[name].T @ constraint.vectors[name])
        for name, size in zip(named(4), sizes, strict=True)
    )
    assert combined(constraint, named(4), sizes) == pytest.approx(np.sqrt(trace), rel=ROUNDING)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("probability", [0.5, 0.95])
def test_the_percentile_is_that_of_simulated_flights(seed, probability):
    rng = np.random.default_rng(seed)
    constraint = random_constraint("percentile", 4, rng, percentile=probability)
    sizes = rng.uniform(0.1, 1.0, 4)
    vectors = np.concatenate([constraint.vectors[n] * s for n, s in zip(named(4), sizes, strict=True)])
    flights = 400_000
    lengths = np.linalg.norm(rng.normal(size=(flights, len(vectors))) @ vectors, axis=1)
    value = combined(constraint, named(4), sizes)
    scatter = np.sqrt(probability * (1 - probability) / flights)
    # five sigma of the binomial count: one false alarm in two million
    assert abs((lengths < value).mean() - probability) < 5 * scatter


@pytest.mark.parametrize("rule", RULES)
def test_leading_axes_are_a_batch(rule):
    rng = np.random.default_rng(5)
    constraint = random_constraint(rule, 3, rng)
    sizes = rng.uniform(0.1, 1.0, (2, 5, 3))
    batch = combined(constraint, named(3), sizes)
    assert batch.shape == (2, 5)
    for place in np.ndindex(2, 5):
        assert batch[place] == pytest.approx(combined(constraint, named(3), sizes[place]), rel=ITERATED)


@pytest.mark.parametrize("rule", RULES)
def test_an_error_without_vectors_adds_nothing(rule):
    constraint = random_constraint(rule, 2, np.random.default_rng(6))
    errors = [*named(2), "accelerometer.unknown"]
    assert weights(constraint, errors)[2] == 0.0
    with_it = combined(constraint, errors, np.array([0.3, 0.4, 1e9]))
    assert with_it == pytest.approx(combined(constraint, named(2), np.array([0.3, 0.4])), rel=ITERATED)
    assert shares(constraint, errors, np.array([0.3, 0.4, 1e9]))[2] == 0.0


@pytest.mark.parametrize("rule", RULES)
def test_the_weight_is_what_one_unit_adds_alone(rule):
    """For the percentile it is the root mean square: there the value is that times a factor of the shape."""
    constraint = random_constraint(rule, 4, np.random.default_rng(7))
    alone = combination(replace(constraint, rule="rss") if rule == "percentile" else constraint, named(4))
    np.testing.assert_allclose(alone(np.eye(4)), weights(constraint, named(4)), rtol=ROUNDING)


@settings(deadline=None, max_examples=40)
@given(cases)
def test_the_shares_are_fractions_of_the_whole(case):
    constraint, errors, sizes = drawn(case)
    parts = shares(constraint, errors, sizes)
    assert (parts >= 0).all()
    assert parts.sum() == pytest.approx(1.0, rel=ROUNDING)
    assert (shares(constraint, errors, 0 * sizes) == 0).all()


def test_the_shares_are_those_of_the_sum_or_of_its_square():
    vectors = {"a": np.array([[3.0]]), "b": np.array([[1.0]])}
    constraint = Constraint(0, "north", "m", "worst_case", 1.0, 60.0, vectors)
    np.testing.assert_allclose(shares(constraint, "ab", np.ones(2)), [0.75, 0.25])
    np.testing.assert_allclose(shares(replace(constraint, rule="rss"), "ab", np.ones(2)), [0.9, 0.1])


def test_a_percentile_without_probability_is_refused():
    constraint = replace(random_constraint("percentile", 2, np.random.default_rng(8)), percentile=None)
    with pytest.raises(ValueError, match="no probability"):
        combined(constraint, named(2), np.ones(2))
