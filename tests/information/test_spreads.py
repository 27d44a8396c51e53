"""Spreads that are estimates: by how much figures of several requirements must be kept together."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import InfeasibleError
from planner.information.choose import campaign_found, is_kept
from planner.information.spreads import simultaneous, spread_factors
from tests.information import cases


def few_power_ons(seed: int, power_ons: int = 6, **plan: Any) -> cases.Tree:
    """A small spec whose biases have spreads from few power-ons."""
    made = cases.tree(seed)
    for sensor in ("gyro", "accelerometer"):
        budget = made["unit"][sensor]["bias"]
        budget["run_to_run"] = {"value": budget["run_to_run"], "power_ons": power_ons}
    made["plan"] |= {"fixed": {}, **plan}
    made["plan"]["repeats"]["most"] = 4
    return made


@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 2**31), columns=st.integers(1, 4), share=st.floats(0.6, 0.99))
def test_a_share_of_the_draws_is_within_all_quantiles_together(seed: int, columns: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    drawn = rng.gamma(2.0, size=(2000, columns)) @ rng.uniform(size=(columns, columns))
    found = simultaneous(drawn, share)
    within = np.all(drawn <= found, axis=1).mean()
    assert share <= within <= share + 2e-3
    level = (drawn <= found).mean(axis=0)
    np.testing.assert_allclose(level, level[0], atol=1e-9)  # one level for all
    still = simultaneous(np.column_stack([drawn, np.ones(len(drawn))]), share)
    np.testing.assert_array_equal(still, [*found, 1.0])  # what does not vary asks nothing of the others


def test_the_room_of_a_requirement_goes_by_no_limit() -> None:
    """A load far below its limit had lent its factor to the one at its limit, and the other way round."""
    made = few_power_ons(22, 5)
    made["requirement"] = [made["requirement"][0] | {"error": e} for e in ("horizontal", "up")]
    loose = made | {"requirement": [made["requirement"][0], made["requirement"][1] | {"limit": "1 m"}]}
    (first, visits), (second, _) = ((f := cases.flight(t), _visits(f)) for t in (made, loose))
    np.testing.assert_array_equal(spread_factors(first, visits), spread_factors(second, visits))
    assert np.all(spread_factors(first, visits) > 1.0)


def _visits(flight: Any) -> Any:
    from planner.information.even import even
    from planner.information.model_of import on_offer

    offers, _ = on_offer(flight)
    return offers.visits(even(offers, 3))


@pytest.mark.parametrize("seed", [22])
@pytest.mark.further("seed", [*range(22), *range(23, 60)])
def test_what_is_planned_keeps_its_limits_with_the_room_of_its_own_spreads(seed: int) -> None:
    """The bound's search asked for the room of the campaign it began with: "proved", and not met."""
    made = few_power_ons(seed)
    reached = campaign_found(cases.flight(made), effort="brief").foreseen.largest
    for requirement, figure in zip(made["requirement"], reached, strict=True):
        requirement["limit"] = f"{1.15 * figure:.6g} m"
    flight = cases.flight(made)
    found = campaign_found(flight)
    assert is_kept(flight, found.foreseen.figures, spread_factors(flight, found.visits))
    np.testing.assert_array_equal(found.spread_factors, spread_factors(flight, found.visits))


@pytest.mark.parametrize("seed", [4])
@pytest.mark.further("seed", [6, 10])
def test_the_nearest_limits_of_two_requirements_can_be_met_together(seed: int) -> None:
    made = few_power_ons(seed, 5)
    one = made["requirement"][0] | {"rule": {"percentile": "90 %"}, "temperature": "range"}
    made["requirement"] = [one | {"error": e, "limit": "0.001 m"} for e in ("horizontal", "up")]
    with pytest.raises(InfeasibleError) as refused:
        campaign_found(cases.flight(made), effort="brief")
    nearest = re.findall(r"nearest limit that can be met is (\S+) m", str(refused.value))
    assert len(nearest) == 2
    for requirement, limit in zip(made["requirement"], nearest, strict=True):
        requirement["limit"] = f"{1.02 * float(limit):.6g} m"
    flight = cases.flight(made)
    found = campaign_found(flight, effort="brief")
    assert is_kept(flight, found.foreseen.figures, found.spread_factors)
