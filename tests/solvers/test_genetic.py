from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from planner.solvers.genetic import (
    GeneticSettings,
    decode,
    minimise,
)

QUICK = GeneticSettings(generations=80)


def bowl(centre: np.ndarray):
    return lambda genes: ((genes - centre) ** 2).sum(axis=1)


def test_the_published_settings_are_the_defaults():
    """K 3.4.3: 256 chromosomes, the best 32 selected, crossover 0.5, mutation 0.01, 500 cycles."""
    s = GeneticSettings()
    assert (s.individuals, s.best, s.crossover, s.mutation, s.generations) == (256, 32, 0.5, 0.01, 500)


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4])
def test_the_lowest_point_of_a_bowl_is_found(seed):
    centre = np.array([0.3, -1.2, 4.0])
    lower, upper = np.array([-1.0, -2.0, 0.0]), np.array([1.0, 2.0, 5.0])
    found = minimise(bowl(centre), lower, upper, GeneticSettings(), np.random.default_rng(seed))
    # a hundredth of the range each: far above the 1.5e-5 that 16 bits resolve, far below random search
    assert found.value < ((0.01 * (upper - lower)) ** 2).sum()
    assert found.value == bowl(centre)(found.best[None, :])[0]


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_best_of_a_problem_small_enough_to_enumerate_is_found(seed):
    """Rastrigin's function with a random centre on a grid of 32 × 32: dozens of local minima, all tried."""
    rng = np.random.default_rng(seed)
    centre = rng.uniform(5.0, 26.0, 2)

    def rastrigin(genes):
        away = 0.3 * (genes - centre)
        return (10.0 + away**2 - 10.0 * np.cos(2.0 * np.pi * away)).sum(axis=1)

    grid = np.stack(np.meshgrid(np.arange(32.0), np.arange(32.0)), axis=-1).reshape(-1, 2)
    settings = GeneticSettings(bits=5, generations=100, patience=100, mutation=0.1)
    found = minimise(rastrigin, np.zeros(2), np.full(2, 31.0), settings, rng)
    assert found.value == pytest.approx(rastrigin(grid).min(), rel=1e-12)


@pytest.mark.parametrize("seed", [1, 7])
def test_the_same_seed_gives_the_same_bytes_and_another_seed_another_run(seed):
    def run(number):
        result = minimise(
            bowl(np.full(4, 0.2)), np.zeros(4), np.ones(4), QUICK, np.random.default_rng(number)
        )
        return result.genes.tobytes(), result.values.tobytes(), result.history

    assert run(seed) == run(seed)
    assert run(seed)[0] != run(seed + 1)[0]


def test_the_best_survive_so_the_best_value_never_rises():
    found = minimise(bowl(np.full(6, 0.7)), np.zeros(6), np.ones(6), QUICK, np.random.default_rng(3))
    assert (np.diff(found.history.best) <= 0).all()
    assert len(found.history.best) == len(found.history.mean) == found.history.generations
    assert found.history.best[-1] == found.value == found.values[0]
    assert (np.diff(found.values) >= 0).all()


def test_every_individual_that_is_evaluated_is_counted_and_lies_between_the_bounds():
    lower, upper, seen = np.array([-3.0, 2.0, 5.0]), np.array([-1.0, 8.0, 5.0]), []

    def watched(genes):
        seen.append(genes)
        return genes.sum(axis=1)

    found = minimise(watched, lower, upper, QUICK, np.random.default_rng(4))
    everything = np.concatenate(seen)
    assert len(everything) == found.history.evaluations
    assert ((everything >= lower) & (everything <= upper)).all()
    assert (everything[:, 2] == 5.0).all()
    np.testing.assert_array_equal(found.best, lower)  # the bounds themselves can be met


def test_it_stops_when_the_target_is_reached():
    found = minimise(
        bowl(np.full(3, 0.5)), np.zeros(3), np.ones(3), QUICK, np.random.default_rng(5), target=0.01
    )
    assert found.history.stopped == "converged"
    assert found.history.best[-1] <= 0.01
    assert all(value > 0.01 for value in found.history.best[:-1])


def test_it_stops_when_patience_is_over_and_not_before():
    settings = GeneticSettings(patience=10)
    flat = minimise(lambda g: np.ones(len(g)), np.zeros(2), np.ones(2), settings, np.random.default_rng(6))
    assert (flat.history.stopped, flat.history.generations) == ("converged", 11)
    short = GeneticSettings(generations=7)
    found = minimise(bowl(np.full(4, 0.3)), np.zeros(4), np.ones(4), short, np.random.default_rng(6))
    assert (found.history.stopped, found.history.generations) == ("generations", 7)


def test_values_that_are_not_numbers_count_as_infinitely_bad():
    def partly(genes):
        return np.where(genes[:, 0] > 0.5, np.nan, 1.0 - genes[:, 0])

    found = minimise(partly, np.zeros(1), np.ones(1), QUICK, np.random.default_rng(7))
    assert found.value == pytest.approx(0.5, abs=2**-15)  # one step of the 16 bits
    assert np.isfinite(found.history.mean).all()


def test_gray_code_reaches_every_value_once_and_neighbours_differ_in_one_bit():
    bits = 7
    codes = np.arange(1 << bits)[:, None]
    values = decode(codes, np.zeros(1), np.array([127.0]), bits)[:, 0]
    np.testing.assert_allclose(np.sort(values), np.arange(128), rtol=0, atol=1e-12)
    in_order = codes[np.argsort(values), 0]
    assert all(int(a ^ b).bit_count() == 1 for a, b in pairwise(in_order))


@pytest.mark.parametrize("bits", [8, 16, 32])
def test_the_bits_of_a_gene_are_the_users(bits):
    """K's 32 bits: eight in each of four genes, or all of them in each; the answer lies on that grid."""
    centre, lower, upper = np.array([0.3, 1.7, 2.2, 0.9]), np.zeros(4), np.full(4, 3.0)
    found = minimise(bowl(centre), lower, upper, GeneticSettings(bits=bits), np.random.default_rng(3))
    number = found.best / 3.0 * (2**bits - 1)
    np.testing.assert_allclose(number, np.round(number), atol=1e-4)
    assert np.abs(found.best - centre).max() <= 0.03


def test_every_published_parameter_is_a_key_of_the_spec():
    from planner.plan.genetic_settings import genetic_settings
    from tests.specs import loaded, small, with_plan

    genetic = {
        "individuals": 64, "best": 8, "crossover": 0.6, "mutation": 0.02, "generations": 9, "bits": 8,
        "patience": 5, "tolerance": 1e-3,
    }  # fmt: skip
    found = genetic_settings(loaded(with_plan(small(), genetic=genetic)).spec)
    assert {key: getattr(found, key) for key in genetic} == genetic
