"""What a spec may not say of its flight and of given sensitivities."""

from __future__ import annotations

from pathlib import Path

import pytest

from planner.export.flight import flight_template
from tests.spec.example import changed, faults, loaded


def test_given_sensitivities_in_the_published_form() -> None:
    given = (
        "{given: {gyro.bias: 578.5 m/(deg/s), accelerometer.bias: 311.25 m/g, gyro.scale_factor: 3.4 m/%}}"
    )
    assert loaded(changed(("simulated", given)))
    per_ten_thousandth = given.replace("3.4 m/%", "0.034 m/(0.01 %)")
    (fault,) = faults(changed(("simulated", per_ten_thousandth)))
    assert fault.path == "sensitivities.given.gyro.scale_factor"


def test_given_sensitivities_hold_at_the_end_only() -> None:
    given = (
        "{given: {gyro.bias: 578.5 m/(deg/s), accelerometer.bias: 311.25 m/g, gyro.scale_factor: 3.4 m/%}}"
    )
    (fault,) = faults(changed(("simulated", given), ("worst_case}", "worst_case, at: any}")))
    assert fault.path == "requirement[0].at"


@pytest.mark.parametrize("name", ['"a\\0b.csv"', "a" * 300, "' '", ".", "[x]", "5", "{}"])
def test_names_that_no_flight_file_has(name: str) -> None:
    (fault,) = faults(changed(("small_uav_1", f"{{file: {name}}}")))
    assert fault.path == "trajectory.file"


@pytest.mark.parametrize("name", ["[x]", "{}", "5", "true"])
def test_names_that_no_trajectory_has(name: str) -> None:
    (fault,) = faults(changed(("small_uav_1", f"{{name: {name}}}")))
    assert fault.path == "trajectory.name"


def test_a_flight_file_lies_beside_the_spec(tmp_path: Path) -> None:
    (tmp_path / "flight.csv").write_text(flight_template(), encoding="utf-8")
    assert loaded(changed(("small_uav_1", "{file: flight.csv}")), tmp_path / "campaign.yaml")
