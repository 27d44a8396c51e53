"""Tables that begin with three points say nothing of slopes: nearly straight curves are scaled without end.

Of kinks and cubics a share of k⁻² is then k times as large as in the middle, and they have no second moment.
What is drawn ends at LARGEST medians, in flights as in figures, so that plan and verify find the same.
"""

from __future__ import annotations

import numpy as np
import pytest

from planner.information.curves import Curves
from planner.nouns.array import Array
from planner.simulate.temperature_curves import LARGEST, curve_family
from planner.spec.temperature_residual import CurveName
from planner.verify.curves import family
from planner.verify.families import curves_in
from planner.verify.second_moments import moments_of
from tests.information.test_prior_of_smooth_tables import DEGC, ERROR, tree
from tests.specs import loaded

TABLE = {3: 8e-3, 6: 3e-3, 10: 2e-3}
SHAPES = ("kink", "cubic")
ENDS = np.array([1.0, *np.zeros(len(DEGC) - 2), -1.0])


def slope(moment: Array) -> float:
    """Root mean square from one end of the range to the other."""
    return float(np.sqrt(ENDS @ moment @ ENDS))


def planned(name: str, seed: int) -> float:
    return slope(Curves(loaded(tree(seed)).spec, unseen=True).moments(DEGC)[name][ERROR])


@pytest.mark.parametrize("name", SHAPES)
def test_plan_and_verify_find_the_same_slopes(name: str) -> None:
    of_verify = moments_of(curves_in(loaded(tree(0)).spec, name))[ERROR].at(DEGC)
    assert planned(name, 0) == pytest.approx(slope(of_verify), rel=0.02)


@pytest.mark.parametrize("name", SHAPES)
def test_slopes_hardly_depend_on_the_seed(name: str) -> None:
    found = [planned(name, seed) for seed in range(4)]
    assert np.std(found) < 0.012 * np.mean(found)


@pytest.mark.parametrize("name", SHAPES)
def test_no_unit_has_a_larger_curve(name: CurveName) -> None:
    rng = np.random.default_rng(3)
    drawn = curve_family(TABLE, -20.0, 40.0, shape=name).draws(4000, rng)
    others = family(TABLE, -20.0, 40.0, "largest", name).drawn(4000, rng)
    for curves in (drawn, others):
        sizes = np.sqrt(np.mean(curves**2, axis=1))
        assert 0.9 * LARGEST < np.max(sizes) / np.median(sizes) < 1.1 * LARGEST


@pytest.mark.parametrize("name", ["cosines", "kink", "cubic", "matern"])
def test_a_table_of_the_whole_range_bounds_its_curves_itself(name: CurveName) -> None:
    whole = {1: 32e-3, 3: 8.5e-3, 5: 3.5e-3}
    curves = curve_family(whole, -20.0, 40.0, shape=name).draws(4000, np.random.default_rng(3))
    sizes = np.sqrt(np.mean(curves**2, axis=1))
    assert np.max(sizes) < 0.6 * LARGEST * np.median(sizes)
