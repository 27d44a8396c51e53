"""White noise above `unit.noise` is a finding, in metres; within it, or where nothing tells it, none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from planner.diagnose.budget_to_navigation import in_flight, with_noise
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.nouns.array import Rule
from planner.nouns.diagnosed_spreads import BudgetExceeded
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.nouns.sensitivities import Constraint
from planner.plan.spec_to_trajectory import trajectory_of
from planner.solvers.distributions import normal_quantile
from planner.spec.model import Spec
from planner.spec.sensor_alone import sensor_spec_from_bytes
from planner.units import STANDARD_GRAVITY_MPS2 as G
from tests.diagnose.hall import Noise, days, read

NG, NA = np.radians(0.003), 1.5e-3  # rad/s and m/s² per √Hz


def spec(share: float) -> Spec:
    """With that share of the noise that the unit has; none: 0. Within its power-ons nothing else changes."""
    errors = ("bias", "scale_factor", "misalignment")
    gyro = {
        e: {"systematic": size} for e, size in zip(errors, ("0.03 deg/s", "0.5 %", "0.5 deg"), strict=True)
    }
    acc = {e: {"systematic": size} for e, size in zip(errors, ("20 mg", "0.5 %", "0.5 deg"), strict=True)}
    gyro["bias"]["run_to_run"], acc["bias"]["run_to_run"] = "0.002 deg/s", "1 mg"
    unit: dict[str, Any] = {"gyro": gyro, "accelerometer": acc}
    if share:
        g = 1e6 * share * NA / G
        noise = {"gyro": f"{share * 0.003} deg/s/sqrt(Hz)", "accelerometer": f"{g} micro-g/sqrt(Hz)"}
        unit["noise"] = noise
    text = yaml.safe_dump({"planner": 1, "name": "one", "unit": unit, "effects": list(errors)})
    return sensor_spec_from_bytes(text.encode(), Path("one.yaml")).spec


def table(seed: int, lasts: tuple[float, float] = (15.0, 240.0)) -> DwellTable:
    """Twelve power-ons, records of two lengths: white noise, and beside it what averaging does not lower."""
    hall, rng = days(seed, 12), np.random.default_rng([seed, 21])
    read_ = read(hall, seed, Noise(0.0, 1e-3, 0.0), Noise(0.0, 6e-4, 0.0))
    assert read_.gyro is not None
    assert read_.acc is not None
    n = len(hall.run)
    duration = np.where(rng.random(n) < 0.5, *lasts)
    white, stays = 1.0 / np.sqrt(duration)[:, None], 0.05 * rng.normal(size=(2, n, 3))
    gyro = read_.gyro + NG * (white * rng.normal(size=(n, 3)) + stays[0])
    acc = read_.acc + NA * (white * rng.normal(size=(n, 3)) + stays[1])
    return replace(read_, duration=duration, gyro=gyro, acc=acc)


def louder(found: UnitDiagnosis) -> set[str]:
    return {b.error for b in found.budget_exceeded if b.part == "white_of_1_s"}


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [3, 2, *range(4, 10)])
def test_a_unit_noisier_than_its_spec_says_is_said_and_one_within_it_is_not(seed: int) -> None:
    found = diagnose(table(seed), spec(0.5))
    assert louder(found) == {"gyro.noise", "accelerometer.noise"}
    for size, sensor in ((NG, "gyro"), (NA, "accelerometer")):
        (one,) = (b for b in found.budget_exceeded if b.error == f"{sensor}.noise")
        assert one.budget == pytest.approx(0.5 * size, rel=1e-3)
        (common,) = (a for a in found.assumptions if a.error == f"{sensor}.noise" and not a.channel)
        assert one.measured >= 0.999 * common.measured
        assert common.measured == pytest.approx(size, rel=0.15)  # three standard errors
    assert not louder(diagnose(table(seed), spec(1.0)))


def test_records_of_one_length_do_not_tell_white_noise_from_what_stays() -> None:
    found = diagnose(table(1, (60.0, 60.0)), spec(0.5))
    assert not [a for a in found.assumptions if a.error.endswith(".noise")]


def test_a_spec_without_noise_has_no_budget_of_it() -> None:
    found = diagnose(table(1), spec(0.0))
    assert not [a for a in found.assumptions if a.error.endswith(".noise")]


def asks(error: str, rule: Rule, at: float) -> Constraint:
    return Constraint(0, error, "deg", rule, 1.0, at, {})


@pytest.mark.parametrize("rule", ["rss", "worst_case"])
def test_in_flight_noise_is_a_random_walk(rule: Rule) -> None:
    """The attitude's error of a minute on the ground by white noise of three gyros: N √t on each axis."""
    flight = trajectory_of({"name": "static", "duration": "60 s"}, Path())
    end = float(flight.time_s[-1])
    exceeded = BudgetExceeded("gyro.noise", "white_of_1_s", 2.0 * NG, NG, 3.0 * NG, NG, "deg/s")
    (told,) = in_flight([exceeded], with_noise([asks("attitude", rule, end)], flight), 0.95)
    assert told.flight is not None
    z = float(normal_quantile(0.975))
    walk = z * NG * np.sqrt(3.0 * (end - float(flight.time_s[0])))
    assert told.flight.budgeted == pytest.approx(walk, rel=0.01)
    assert told.flight.measured == pytest.approx(2.0 * told.flight.budgeted)
