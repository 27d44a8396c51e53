"""The prior of smooth tables: one for search, judge, `calibrate` and `verify`, whichever curves are drawn.

A table that begins with three points says nothing of slopes: nearly straight curves are as large as they
like, and the second moment is that of the few largest, others in every draw.
"""

from __future__ import annotations

import numpy as np
import pytest

from planner.information import curves
from planner.information.curves import Curves
from planner.verify.smooth import Tables, prior_of
from tests.information import cases
from tests.information.test_smooth import smooth_tree
from tests.specs import loaded

DEGC = np.linspace(-20.0, 40.0, 13)
ERROR = ("gyro", "bias")


def tree(seed: int) -> cases.Tree:
    spec = smooth_tree()
    budget = spec["unit"]["gyro"]["bias"]
    budget["temperature_residual"] = {3: "0.008 deg/s", 6: "0.003 deg/s", 10: "0.002 deg/s"}
    return spec | {"plan": spec["plan"] | {"seed": seed}}


def slope(seed: int) -> float:
    """Root mean square of the prior from one end of the range to the other, SI."""
    M = Curves(loaded(tree(seed)).spec).prior(ERROR, DEGC)
    assert M is not None
    ends = np.array([1.0, *np.zeros(len(DEGC) - 2), -1.0])
    return float(np.sqrt(ends @ M @ ends))


def scatter() -> float:
    of_seeds = [slope(seed) for seed in range(8)]
    return float(np.std(of_seeds) / np.mean(of_seeds))


def test_it_hardly_depends_on_which_curves_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    tamed = scatter()
    monkeypatch.setattr(curves, "TAIL", 1e9)
    monkeypatch.setattr(curves, "LARGEST", 1e9)
    assert tamed < 0.01
    assert scatter() > 0.05


@pytest.mark.parametrize("seed", [1, 2])
def test_verify_reads_tables_by_the_same(seed: int) -> None:
    spec = loaded(tree(seed)).spec
    prior = Curves(spec).prior(ERROR, DEGC)
    own = Tables(prior_of(spec), *spec.plan.temperatures.range)._moment(ERROR, DEGC, DEGC)
    assert prior is not None
    apart = np.linalg.norm(prior - own) / np.linalg.norm(own)
    assert apart < 0.1
