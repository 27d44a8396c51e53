"""A plan's steps become power-ons, motions and installations by their order; their ids say nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.campaign.design import Design, design
from planner.nouns.choices import Campaign, TestVisits
from planner.nouns.step import Step
from planner.plan.schedule_to_steps import steps
from planner.spec.even_points import even_points
from planner.spec.model import Spec
from tests.simulate.benches import shipped


def laid(name: str, repeats: int = 2) -> tuple[Spec, tuple[Step, ...]]:
    spec = shipped(name)
    low, high = spec.plan.temperatures.range
    visits = tuple(
        TestVisits(test, points, (repeats,) * len(points))
        for test in spec.tests
        for points in [(20.0,) if spec.tests[test].temperatures == "room" else even_points(low, high, 2)]
    )
    return spec, steps(spec, Campaign(visits, (), 0.0, 0.0, False))


def columns(plan: Design) -> list[np.ndarray]:
    c = plan.conditions
    return [c.rate, c.specific_force, c.temperature_degc, c.time_on, c.day, plan.run, plan.installation]


@pytest.mark.parametrize("name", ["small_uav.yaml", "high_g.yaml", "tactical_leg.yaml"])
def test_ids_may_be_anything(name: str) -> None:
    spec, timeline = laid(name)
    anonymous = [replace(step, id=f"step {i}") for i, step in enumerate(timeline)]
    for a, b in zip(columns(design(timeline, spec)), columns(design(anonymous, spec)), strict=True):
        assert np.array_equal(a, b)


@pytest.mark.parametrize("name", ["small_uav.yaml", "high_g.yaml"])
def test_a_run_is_what_lies_between_power_on_and_power_off(name: str) -> None:
    spec, timeline = laid(name)
    plan = design(timeline, spec)
    switched = [s for s in timeline if s.action == "power_on"]
    assert plan.run.tolist() == sorted(plan.run.tolist())
    assert len(plan.starts) == len(switched) == plan.run[-1]
    started = plan.conditions.day[plan.starts] * 86400.0 - plan.conditions.time_on[plan.starts]
    np.testing.assert_allclose(started, [s.start_s for s in switched], atol=1e-6)


def test_power_that_stays_on_is_one_run_however_many_tests_it_spans() -> None:
    spec, timeline = laid("small_uav.yaml")
    first, *_ = (s for s in timeline if s.action == "power_on")
    kept = [s for s in timeline if s is first or s.action not in ("power_on", "power_off")]
    plan = design(kept, spec)
    assert set(plan.run.tolist()) == {1}
    np.testing.assert_allclose(
        plan.conditions.day * 86400.0 - plan.conditions.time_on, first.start_s, atol=1e-6
    )
    usual = design(timeline, spec)
    assert np.array_equal(plan.conditions.rate, usual.conditions.rate)  # the motions are the same


def test_records_that_no_power_on_precedes_are_one_run_a_repeat() -> None:
    spec, timeline = laid("small_uav.yaml")
    bare = [s for s in timeline if s.action == "record"]
    plan, usual = design(bare, spec), design(timeline, spec)
    assert np.array_equal(plan.run, usual.run)
    np.testing.assert_allclose(plan.conditions.time_on, plan.duration / 2.0)


def test_installations_follow_the_install_steps_and_the_benches() -> None:
    spec, timeline = laid("high_g.yaml")
    plan = design(timeline, spec)
    assert [s.bench for s in timeline if s.action == "install"] == list(dict.fromkeys(plan.bench.tolist()))
    assert dict(zip(plan.bench.tolist(), plan.installation.tolist(), strict=True)) == {
        bench: k for k, bench in enumerate(dict.fromkeys(plan.bench.tolist()), start=1)
    }
    without = design([s for s in timeline if s.action != "install"], spec)
    assert np.array_equal(without.installation, plan.installation)


def test_a_unit_that_is_installed_again_is_mounted_anew_and_powered_off_before() -> None:
    spec, timeline = laid("small_uav.yaml")
    install = next(s for s in timeline if s.action == "install")
    half = next(i for i, s in enumerate(timeline) if s.action == "power_on" and i > len(timeline) // 2)
    plan = design([*timeline[:half], install, *timeline[half:]], spec)
    assert set(plan.installation.tolist()) == {1, 2}
    assert np.array_equal(plan.run, design(timeline, spec).run)


def test_only_the_first_batch_is_ours() -> None:
    spec, timeline = laid("small_uav.yaml")
    batches = [replace(s, id=f"b{b:02d}/{s.id}") for b in (1, 2) for s in timeline]
    for a, b in zip(columns(design(batches, spec)), columns(design(timeline, spec)), strict=True):
        assert np.array_equal(a, b)
