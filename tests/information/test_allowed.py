"""The bounds of the region of allowed errors are sizes that errors have in flight."""

from __future__ import annotations

import numpy as np
import pytest

from planner.information.allowed import extreme_sizes, in_sizes, largest_quantile
from planner.information.choose import campaign_found
from planner.information.parts import left_in_flight
from planner.plan.spec_to_sensitivity import constraints, sensitivities
from planner.solvers.linear_combination import combined
from tests.information import cases


@pytest.mark.parametrize("seed", [0])
@pytest.mark.further("seed", [1, 2])
def test_no_plan_leaves_less_than_the_most_records_and_none_leaves_what_units_have(seed: int) -> None:
    """A campaign may leave more than units have: of an error that it hardly tells it makes an estimate."""
    flight = cases.flight(cases.tree(seed))
    smallest, largest = extreme_sizes(flight)
    found = campaign_found(flight, effort="brief")
    z = largest_quantile(flight.spec)
    for error, parts in left_in_flight(flight, found.foreseen, 0).parts.items():
        sensor, _, effect = str(error).partition(".")
        budget = getattr(flight.spec.unit, sensor)[effect]
        size = z * float(np.linalg.norm([*parts.values()]))
        assert 0.97 * smallest[str(error)] <= size, error
        assert largest[str(error)] >= max(smallest[str(error)], z * budget.systematic_size / np.sqrt(3.0))


def test_sizes_are_quantiles_so_the_limit_takes_the_factor() -> None:
    made = cases.tree(1) | {
        "requirement": [{"error": "position", "limit": "50 m", "rule": {"percentile": "95 %"}}]
    }
    flight = cases.flight(made)
    names = ["gyro.bias", "accelerometer.bias"]
    known = sensitivities(cases._trajectory("level"), names)
    plain = constraints(flight.spec, known)
    (scaled,) = in_sizes(plain, flight.spec)
    z = largest_quantile(flight.spec)
    assert z == pytest.approx(1.959964, rel=1e-6)
    sizes = np.array([1e-4, 1e-2])
    figure = combined(plain[0], names, sizes / z)
    assert combined(scaled, names, sizes) / scaled.limit == pytest.approx(figure / plain[0].limit)
