"""Effects that nothing in the program knows by name are counted, calibrated and flown like ours."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from planner import catalog
from planner.effects._channels import CHANNELS, BaseEffect, ChannelEffect
from planner.pipelines.promise import FlightOptions, verify
from planner.verify.experiment import experiment, units_left
from planner.verify.starts import anywhere
from planner.verify.structure import affine
from tests.plugins.installing import Installed
from tests.verify.plans import flown, planned_from

BUDGETS = {
    "self_heating": {"systematic": "0.002 deg/s", "run_to_run": "0.0003 deg/s"},
    "cold_knee": {"systematic": "0.00005 deg/s/K", "run_to_run": "0.000005 deg/s/K"},
    "ripple": {"systematic": "0.002 deg/s", "run_to_run": "0.0003 deg/s"},
}


def with_effects(*names: str) -> dict[str, Any]:
    spec = copy.deepcopy(flown())
    spec["unit"]["gyro"] |= {name: BUDGETS[name] for name in names}
    spec["effects"] = [*spec["effects"], *names]
    spec["requirement"][0]["limit"] = "9000 m"
    return spec


@pytest.mark.parametrize("name", BUDGETS)
def test_a_plan_with_an_effect_of_a_package_has_no_fault(installed_example: Installed, name: str) -> None:
    one = planned_from(with_effects(name))
    options = FlightOptions(flights=50, through_files=0)
    found = verify(one.loaded, one.document, options, lambda message: None)
    assert found.recount.ok, found.recount.faults[:3]
    assert found.outcomes


def test_they_go_through_files_too(installed_example: Installed) -> None:
    """Calibrated by `planner calibrate`, exported, corrected by `planner apply`, flown."""
    one = planned_from(with_effects("self_heating", "cold_knee"))
    found = verify(one.loaded, one.document, FlightOptions(flights=100), lambda message: None)
    assert found.files.units == 2
    assert found.files.ok, found.files.faults


def test_what_a_table_carries_flies_with_the_effect_that_it_changes() -> None:
    spec = copy.deepcopy(flown())
    spec["unit"]["gyro"]["bias_temperature"] = {"systematic": "0.0001 deg/s/K"}
    one = planned_from(spec)
    e = experiment(one.document, one.loaded.spec, one.trajectory, seed=2, starts=anywhere(one.loaded.spec))
    left = {str(x.name): x for x in units_left(e, 0, 50)}
    assert "gyro.bias_temperature" not in left
    # the table takes a slope out whole: estimate and curve are as small as without it
    plain = {str(x.name): x for x in units_left(_without(one, e), 0, 50)}
    for part in (3, 4):
        sizes = [np.sqrt(np.mean(of["gyro.bias"].parts[part] ** 2)) for of in (left, plain)]
        assert sizes[0] == pytest.approx(sizes[1], rel=0.01)
    moved = left["gyro.bias"].true - plain["gyro.bias"].true
    assert np.abs(moved).max() > np.radians(0.0001) * 20.0


def _without(one, e):
    from dataclasses import replace

    fewer = {k: b for k, b in e.unit.budgets.items() if k != ("gyro", "bias_temperature")}
    return replace(e, unit=replace(e.unit, budgets=fewer))


# ---------------------------------------------------------------- told by the effects themselves


class Offset(ChannelEffect):
    """Another bias under another name: constant, so that it is corrected exactly."""

    name, units, group = "offset", {"gyro": "deg/s", "accelerometer": "g"}, "bias"

    def drive(self, sensor, conditions, nonlinear):
        return np.ones(len(conditions.day))


class Crosstalk(BaseEffect):
    """All channels read a little of the sum of the inputs."""

    name, units, group = "crosstalk", {"gyro": "1", "accelerometer": "1"}, "misalignment"
    needs = frozenset({"rate", "specific_force"})

    def terms(self, sensor):
        return CHANNELS

    def regressors(self, sensor, conditions, nonlinear=None):
        u = conditions.rate if sensor == "gyro" else conditions.specific_force
        return u.sum(axis=1)[:, None, None] * np.eye(3)


def test_constants_and_slopes_are_told_by_the_effects_themselves(monkeypatch) -> None:
    every = dict(catalog.effects().items()) | {e.name: e for e in (Offset(), Crosstalk())}
    monkeypatch.setattr(catalog, "effects", lambda: every)
    assert np.array_equal(affine("gyro", "offset").constant, np.eye(3))
    assert np.array_equal(affine("gyro", "offset").slope, np.zeros((3, 3, 3)))
    diagonal = np.zeros((3, 3, 3))
    diagonal[range(3), range(3), range(3)] = 1.0
    assert np.array_equal(affine("gyro", "scale_factor").slope, diagonal)
    u = np.array([0.3, -0.2, 0.7])
    found = affine("accelerometer", "crosstalk")
    assert np.einsum("ijt,j->it", found.slope, u) == pytest.approx(u.sum() * np.eye(3))
    for name in ("g_sensitivity", "scale_factor_asymmetry", "warm_up", "bias_temperature"):
        assert affine("gyro", name) is None
