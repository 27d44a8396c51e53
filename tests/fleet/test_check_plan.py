"""A check is planned to decide; one that may stop after every power-on keeps its rates."""

from __future__ import annotations

import numpy as np
import pytest

from planner.errors import InfeasibleError, InputError
from planner.fleet.check_plan import planned_checks
from planner.fleet.judge import ErrorRates
from planner.fleet.looks import accepted_as_they_come
from tests.fleet.fleets import check_table, small_basis
from tests.fleet.test_judge import batch
from tests.specs import loaded, small

RATES = ErrorRates(0.05, 0.05)


def plans(load: float, share: float = 0.9):
    basis = small_basis()
    return planned_checks(loaded(small()).spec, basis.models, basis.region, load, share, RATES)


def test_the_cheapest_check_comes_first_and_decides():
    found = plans(0.9)
    assert [c.time_s for c in found] == sorted(c.time_s for c in found)
    for check in found:
        assert check.decides >= 0.9 - 1e-9
        assert 1 <= check.expected <= max(1.0, 1.25 * check.power_ons)


def test_nearer_to_the_limit_takes_more():
    assert plans(0.95)[0].time_s > plans(0.85)[0].time_s


def test_what_no_check_decides_is_said():
    with pytest.raises(InfeasibleError, match="smaller --load"):
        plans(0.99999)
    with pytest.raises(InputError, match="--load"):
        plans(1.2)


@pytest.mark.parametrize(("load", "wrong"), [(1 + 1e-9, "accepted"), (1 - 1e-9, "rejected")])
def test_looks_keep_the_rates(load, wrong):
    """A sample of 50 units on the limit; thousands in benchmarks/study_accept.py."""
    basis = small_basis()
    table = check_table(*batch(load, 50, 21), np.random.default_rng(21), power_ons=8)
    found = accepted_as_they_come(table, basis.models, basis.region, (-60.0, 60.0), RATES, 8)
    share = sum(u.verdict == wrong for u in found) / 50
    assert share <= 0.05 + 3 * np.sqrt(0.05 * 0.95 / 50)


def test_clear_units_are_decided_early():
    basis = small_basis()
    table = check_table(*batch(0.6, 20, 22), np.random.default_rng(22), power_ons=12)
    found = accepted_as_they_come(table, basis.models, basis.region, (-60.0, 60.0), RATES, 12)
    accepted = [u for u in found if u.verdict == "accepted"]
    assert len(accepted) >= 18
    assert np.mean([u.power_ons for u in accepted]) < 0.8 * 36
    assert "the check may stop there" in accepted[0].notes[-1]
