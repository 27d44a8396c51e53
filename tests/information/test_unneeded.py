"""What a plan says that nobody needs, against units drawn one by one."""

from __future__ import annotations

import numpy as np
import pytest

from planner.information.choose import campaign_found
from planner.information.model_of import Flight
from planner.information.unneeded import unneeded
from planner.nouns.array import Array
from planner.simulate.families import curve_families
from planner.spec.curve_names import families_of
from tests.information import cases
from tests.information.cases import Tree

UNITS = 40_000


def asked(share: int, limit: float) -> Tree:
    """One component at the end, on flights over the whole range."""
    made = cases.tree(0)
    made["requirement"] = [
        {
            "error": "north",
            "limit": f"{limit:g} m",
            "rule": {"percentile": f"{share} %"},
            "temperature": "range",
        }
    ]
    made["trajectory"] = cases.TRAJECTORIES["level"]
    return made


def as_they_are(flight: Flight, share: float) -> float:
    """The quantile of |north| of units that nobody calibrates, of the family that makes it largest, m."""
    rng, spec = np.random.default_rng(3), flight.spec
    J = flight.response.errors[-1][0].sum(axis=1)
    t = rng.uniform(*spec.plan.temperatures.range, UNITS)
    found = []
    for family in families_of(spec):
        curves, north = curve_families(spec, family), np.zeros(UNITS)
        for column, f in zip(J, flight.response.flying, strict=True):
            north += column * _error(spec, f, curves.get(f.error.parts), t, rng)  # type: ignore[arg-type]  # parts are a pair
        found.append(float(np.quantile(np.abs(north), share)))
    return max(found)


def _error(spec, f, curve, t: Array, rng) -> Array:
    budget = getattr(spec.unit, f.error.sensor)[f.error.effect]
    walk = budget.storage_sigma * np.sqrt(spec.flown_after_days / 60.0)
    spread = np.sqrt(budget.run_to_run_sigma(t) ** 2 + budget.in_run_sigma**2 + walk**2)
    e = rng.uniform(-1.0, 1.0, UNITS) * budget.systematic_size + spread * rng.normal(size=UNITS)
    if curve is not None:
        pool = curve.draws(2000, rng)[rng.integers(2000, size=UNITS)]
        place = np.rint(np.interp(t, curve.grid, np.arange(len(curve.grid)))).astype(int)
        e += pool[np.arange(UNITS), place] * rng.choice([-1.0, 1.0], UNITS)
    return np.asarray(e)


@pytest.mark.parametrize("share", [95])
@pytest.mark.further("share", [60])
def test_no_calibration_is_needed_where_units_as_they_are_keep_the_limit(share):
    true = as_they_are(cases.flight(asked(share, 1e6)), share / 100.0)
    for factor, needless in ((1.06, True), (0.96, False)):  # 40 000 units tell it to 1 %
        flight = cases.flight(asked(share, true * factor))
        said = [*unneeded(flight, campaign_found(flight, effort="brief"))]
        assert any("no calibration is needed" in s for s in said) == needless


def with_g_sensitivity(systematic: str) -> Tree:
    """Six faces tell a gyro's g-sensitivity to some 0.0002 deg/s/g, whatever it was before."""
    made = asked(95, 60.0)
    made["unit"]["gyro"]["g_sensitivity"] = {"systematic": systematic}
    made["effects"] = [*made["effects"], "g_sensitivity"]
    return made


@pytest.mark.parametrize(("systematic", "said"), [("0.00002 deg/s/g", True), ("0.02 deg/s/g", False)])
def test_effects_that_are_better_known_without_a_calibration_are_named(systematic: str, said: bool) -> None:
    flight = cases.flight(with_g_sensitivity(systematic))
    found = campaign_found(flight, effort="brief")
    remarks = [s for s in unneeded(flight, found) if s.startswith("effects: g_sensitivity: told worse")]
    assert bool(remarks) == said
    if said:
        without = cases.flight(asked(95, 60.0))
        assert "suffice" not in remarks[0] or campaign_found(without).cost < found.cost
