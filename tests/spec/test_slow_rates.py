"""Where calibration of a scale factor is hopeless: K table 2.17."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from planner.spec.slow_rates import repeats_for, slow_rates, spread_of_one
from tests.specs import SHIPPED

# K table 2.17: deg/s, 3 δ in %, repeats; .05, .1 and 1 deg/s are left out, they follow no one half-width
ROWS = [
    (0.005, 39.7, 116_600),
    (0.01, 24.3, 43_900),
    (10.0, 0.32, 8),
    (50.0, 0.33, 8),
    (100.0, 0.32, 8),
    (200.0, 0.339, 9),
    (300.0, 0.351, 9),
    (400.0, 0.363, 10),
    (500.0, 0.367, 10),
]


@pytest.mark.parametrize(("rate", "three_sigma", "printed"), ROWS)
def test_k_s_repeats_are_those_of_a_tenth_of_a_percent_at_99_percent(
    rate: float, three_sigma: float, printed: int
) -> None:
    # K's spreads have three digits: 1 % of n in the long rows, one repeat in the short ones
    assert repeats_for(three_sigma / 300.0) == pytest.approx(printed, rel=0.01, abs=1)


def test_the_bias_weighs_with_one_over_the_rate() -> None:
    assert spread_of_one(500.0, 1.07e-3, 0.0066 / 3) == pytest.approx(1.07e-3, rel=1e-3)
    slow = [spread_of_one(rate, 1.07e-3, 1e-3) for rate in (0.01, 0.1)]
    assert slow[0] / slow[1] == pytest.approx(10.0, rel=0.01)
    assert np.isfinite(spread_of_one(-5.0, 0.0, 1e-3))


def test_a_plan_says_which_rates_are_hopeless() -> None:
    import planner

    tree = yaml.safe_load((SHIPPED / "helicopter.yaml").read_text(encoding="utf-8"))
    (name,) = [n for n, t in tree["tests"].items() if "gyro.scale_factor" in t["calibrates"]]
    for rates, said in (([0.5, 500], True), ([10, 500], False)):
        tree["tests"][name]["motions"] = [
            {axis: f"{sign * rate} deg/s"}
            for axis in ("rate_1", "rate_2")
            for rate in rates
            for sign in (1, -1)
        ]
        sentences = list(slow_rates(planner.load(tree).spec))
        assert bool(sentences) == said
        assert all("1/1000 of the 500 deg/s" in s and "5 deg/s or more" in s for _, s in sentences)
