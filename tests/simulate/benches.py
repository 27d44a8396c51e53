"""Campaigns to simulate: the shipped small UAV at a chosen number of temperatures and repeats."""

from __future__ import annotations

from functools import cache

from planner.campaign.design import Design, design
from planner.nouns.choices import Campaign, TestVisits
from planner.plan.schedule_to_steps import steps
from planner.simulate.campaign import Settings
from planner.spec.even_points import even_points
from planner.spec.load import load_spec
from planner.spec.model import Spec
from tests.specs import SHIPPED


@cache
def shipped(name: str) -> Spec:
    return load_spec(SHIPPED / name).spec


def campaign_of(temperatures: int = 3, repeats: int = 3, name: str = "small_uav.yaml") -> tuple[Spec, Design]:
    """Every test of a shipped spec; one temperature is 20 degC."""
    spec = shipped(name)
    points = (20.0,) if temperatures == 1 else even_points(-60.0, 60.0, temperatures)
    visits = tuple(TestVisits(test, points, (repeats,) * len(points)) for test in spec.tests)
    return spec, design(steps(spec, Campaign(visits, (), 0.0, 0.0, False)), spec)


def noiseless() -> Settings:
    return Settings(
        white={"gyro": 0.0, "accelerometer": 0.0},
        temperature_jitter=0.0,
        run_to_run=False,
        in_run=False,
        storage=False,
    )
