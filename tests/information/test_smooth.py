"""The promise of smooth tables beside that of straight lines."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from planner.information.exact import Foreseen, foreseen, laid_out
from planner.information.parts import left_by_campaign
from planner.information.smooth import mixed
from planner.nouns.choices import TestVisits
from tests.information import cases
from tests.information.cases import visits
from tests.information.test_promise import tree

SEEDS = (1, 2)


def smooth_tree() -> cases.Tree:
    spec = tree("level")
    return spec | {"plan": spec["plan"] | {"temperature_estimator": "smooth"}}


@cache
def promised(campaign: tuple[TestVisits, ...]) -> Foreseen:
    flight = cases.flight(smooth_tree())
    return foreseen(flight, laid_out(flight, campaign))


def drawn(seed: int, count: int) -> tuple[TestVisits, ...]:
    """Both tests at the same temperatures, so that every table has its curve at its nodes."""
    rng = np.random.default_rng(seed)
    degc = tuple(sorted(rng.choice(np.arange(-20.0, 41.0, 10.0), count, replace=False).tolist()))
    times = tuple(int(n) for n in rng.integers(1, 4, count))
    return visits(("static", degc, times), ("rates", degc, times))


@pytest.mark.parametrize("seed", SEEDS[:1])
@pytest.mark.further("seed", SEEDS[1:])
@pytest.mark.parametrize("count", [2, 5])
def test_of_the_family_that_they_assume_they_leave_no_more_of_any_term(seed: int, count: int) -> None:
    found = promised(drawn(seed, count))
    assert found.promise.smooth is not None
    own = replace(found.promise, families={"mixed": mixed(found.promise.families)})
    smooth, lines = (
        left_by_campaign(p, found.counts[0], 0, "mixed") for p in (own, replace(own, smooth=None))
    )
    assert np.all(smooth <= lines * (1.0 + 1e-6))
    curved = [i for i, f in enumerate(own.flying) if f.error.parts in found.promise.smooth.prior]
    assert np.all(smooth[curved] < lines[curved])


def test_at_one_temperature_both_are_constants() -> None:
    found = promised(visits(("static", (10.0,), (3,)), ("rates", (10.0,), (2,))))
    lines = replace(found.promise, smooth=None)
    np.testing.assert_allclose(found.promise.figures(found.counts), lines.figures(found.counts), rtol=1e-9)


def test_a_curve_much_larger_than_all_noise_is_met_at_the_nodes() -> None:
    found = promised(drawn(1, 4))
    s = found.promise.smooth
    assert s is not None
    nodes = np.array([[-20.0, 0.0, 20.0, 40.0]])
    for error in s.prior:
        noise = 1e-9 * np.trace(s.prior[error]) * np.eye(4)[None, None]
        np.testing.assert_allclose(s.weights(error, nodes[0], nodes, noise)[0, 0], np.eye(4), atol=1e-3)
        beyond = s.weights(error, np.array([-80.0, -20.0, 40.0, 90.0]), nodes, noise)[0, 0]
        np.testing.assert_array_equal(beyond[0], beyond[1])  # constant beyond the range of use
        np.testing.assert_array_equal(beyond[2], beyond[3])
