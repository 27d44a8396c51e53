"""Every shipped spec, and the starter, plans and meets its requirements; what is proved of it is said."""

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
        "small_uav_worst_case",
        "helicopter",
        "high_g",
        "tactical_leg",
    } <= set(NAMES)


@pytest.mark.parametrize("name", [*NAMES, "starter"])
def test_a_shipped_spec_is_planned_without_remarks_and_met(name):
    assert shipped(name).warnings == ()
    plan = shipped_plan(name).plan
    assert all(requirement.met for requirement in plan.requirements)
    assert plan.steps[-1].end_s == plan.time_s
    if plan.genetic is not None:
        # neither trivial nor infeasible: the limit takes more than the least campaign, and less than all
        tightest = max(requirement.achieved / requirement.limit for requirement in plan.requirements)
        assert 0.85 < tightest <= 1 + 1e-6


@pytest.mark.parametrize("name", [*NAMES, "starter"])
def test_a_published_plan_is_proved_and_another_says_how_much_shorter_one_could_be(name):
    planned = shipped_plan(name)
    plan = planned.plan
    if plan.method == "published":
        assert plan.proved
        assert plan.gap == 0
        if plan.genetic is not None:
            assert 0 <= plan.genetic.gap <= 0.005
            assert all(-1e-9 <= corner.gap <= 0.005 for corner in planned.allowed.corners)
            assert max(planned.allowed.tightness.values()) < 1
    else:
        assert 0 < plan.bound_s <= plan.objective_value
        assert plan.proved == (plan.gap == 0)
        assert plan.genetic is None or plan.genetic.time_s >= plan.objective_value * (1 - 1e-9)
        for i, requirement in enumerate(plan.requirements):
            assert requirement.achieved == max(figures[i] for figures in plan.families.values())


def test_the_worst_case_is_planned_as_published_and_the_rest_by_what_will_be_flown():
    methods = {name: shipped_plan(name).plan.method for name in ("small_uav", "small_uav_worst_case")}
    assert methods == {"small_uav": "information", "small_uav_worst_case": "published"}


def test_the_starter_is_no_longer_than_a_search_of_another_kind_found():
    """Simulated annealing found 5.40 h at four temperatures, where steps downhill had ended at 6.02 h.

    By 240 000 flights of 32 000 curves, three seeds, those 5.40 h leave 99.99 to 100.09 m of 100 m:
    whether they keep it is beyond what a plan's draws tell (99.69 m once, 100.03 m now).
    """
    assert shipped_plan("starter").plan.objective_value <= 5.59 * 3600
