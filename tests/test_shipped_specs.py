"""Every shipped spec, and the starter, plans, meets its requirements and is proved."""

import pytest

from tests.shipped_plans import NAMES, shipped_plan
from tests.specs import shipped


def test_the_promised_specs_are_there():
    assert {
        "published_one_bench",
        "published_two_benches",
        "published_accelerated",
        "published_optimum",
        "small_uav",
        "helicopter",
        "high_g",
        "tactical_leg",
    } <= set(NAMES)


@pytest.mark.parametrize("name", [*NAMES, "starter"])
def test_a_shipped_spec_is_planned_met_and_proved(name):
    assert shipped(name).warnings == ()
    planned = shipped_plan(name)
    plan = planned.plan
    assert all(requirement.met for requirement in plan.requirements)
    assert plan.proved
    assert plan.gap == 0
    assert plan.steps[-1].end_s == plan.time_s
    if plan.genetic is not None:
        assert 0 <= plan.genetic.gap <= 0.005
        assert all(-1e-9 <= corner.gap <= 0.005 for corner in planned.allowed.corners)
        # neither trivial nor infeasible: the limit takes more than the least campaign, and less than all
        tightest = max(requirement.achieved / requirement.limit for requirement in plan.requirements)
        assert 0.9 < tightest <= 1 + 1e-9
        assert max(planned.allowed.tightness.values()) < 1
