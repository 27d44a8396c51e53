"""Intervals of coefficients cover as often as they say, and are as wide as the strength of the effect says.

Shares over many campaigns are measured by benchmarks/study_intervals.py; here a few seeds of three effects.
"""

from __future__ import annotations

import pytest

from tests.diagnose.coverage import Campaign, hidden_together

SEEDS = (0, 1)


@pytest.fixture(scope="module")
def campaigns() -> dict[str, list[Campaign]]:
    names = ("g_sensitivity", "temperature_rate", "warm_up")
    found = [hidden_together(names, seed) for seed in SEEDS]
    return {name: [each[k] for each in found] for k, name in enumerate(names)}


def test_intervals_hold_the_truth_as_often_as_they_say(campaigns: dict[str, list[Campaign]]) -> None:
    """12 intervals of 95 %: fewer than 10 hold it by chance in 2 % of such tests, were they independent."""
    held = [
        inside for several in campaigns.values() for c in several for inside in (c.covered or {}).values()
    ]
    assert len(held) == len(SEEDS) * (3 + 1 + 2)
    assert sum(held) >= 10


def test_a_coefficient_of_its_own_is_as_many_sigma_as_the_effect(
    campaigns: dict[str, list[Campaign]],
) -> None:
    """value / standard error = √Δ where an effect has one coefficient, up to what estimates the noise.

    The noise of 30 power-ons is known to a tenth or so, and the value itself strays by one of its sigma.
    """
    for c in campaigns["temperature_rate"]:
        assert c.found is not None
        (t,) = c.found.terms
        sigma = abs(t.value) / ((t.high - t.low) / 2.0 / 2.0)
        assert sigma == pytest.approx(c.found.strength, rel=0.25)
        assert sigma == pytest.approx(c.strength, rel=0.4)
