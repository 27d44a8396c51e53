"""The spec's choice of a flight."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planner.errors import InputError
from planner.nouns.trajectory import Trajectory
from planner.plan.spec_to_sensitivity import sensitivities
from planner.plan.spec_to_trajectory import flight_path, trajectory_of
from tests.specs import loaded, small
from tests.trajectories.flights import flight, table, write


def refusal(choice: Any, folder: Path) -> str:
    with pytest.raises(InputError) as caught:
        trajectory_of(choice, folder)
    return str(caught.value)


def test_a_name_is_the_flight_with_its_defaults(tmp_path: Path) -> None:
    assert trajectory_of("turn", tmp_path).velocity.tobytes() == flight("turn").velocity.tobytes()


def test_parameters_are_taken_over(tmp_path: Path) -> None:
    chosen = trajectory_of({"name": "level", "duration": "2 min", "speed": "100 m/s"}, tmp_path)
    assert chosen.time_s[-1] == 120.0
    assert (chosen.velocity[0] ** 2).sum() == pytest.approx(1e4)


def test_a_file_is_looked_for_beside_the_spec(tmp_path: Path) -> None:
    (tmp_path / "flights").mkdir()
    write(tmp_path / "flights" / "one.csv", table(flight("turn")))
    for choice in ({"file": "flights/one.csv"}, {"name": "file", "file": "flights/one.csv"}):
        assert trajectory_of(choice, tmp_path).name == "one"
    assert (
        trajectory_of({"file": str(tmp_path / "flights" / "one.csv"), "day": "3 day"}, Path("/")).day == 3.0
    )


@pytest.mark.parametrize(
    ("choice", "says"),
    [
        ("smal_uav_1", "unknown trajectory 'smal_uav_1'; did you mean 'small_uav_1'?"),
        ("", "unknown trajectory ''; expected one of"),
        ({"name": ["turn"]}, "unknown trajectory"),
        ({"speed": "3 m/s"}, "has no name; expected one of"),
        ({"name": "turn", "bnak": "3 deg"}, "trajectory.bnak: unknown parameter; did you mean 'bank'?"),
        ({"name": "turn", "bank": "85 deg"}, "trajectory.bank: 85 deg is not between -80 and 80 deg"),
        ({"name": "turn", "bank": "5 m"}, "trajectory.bank: "),
        ({"name": "turn", "temperature": "5"}, "trajectory.temperature: "),
        ({"name": "turn", "temperature": {"start": "5 degC"}}, "trajectory.temperature.end: is missing"),
        ({"name": "file"}, "trajectory.file: is missing"),
        ({"file": 7}, "trajectory.file"),
        ({"file": "none.csv"}, "no such file"),
        ({"file": "n" * 5000}, "cannot be"),
        ({"file": "a\0b"}, "cannot be"),
    ],
)
def test_what_cannot_be_flown_is_refused(choice: Any, says: str, tmp_path: Path) -> None:
    assert says in refusal(choice, tmp_path)


def test_all_wrong_parameters_are_said_at_once(tmp_path: Path) -> None:
    said = refusal({"name": "turn", "bank": "85 deg", "speed": "1 m/s", "wind": "3 m/s"}, tmp_path)
    assert all(f"trajectory.{key}: " in said for key in ("bank", "speed", "wind"))


def test_a_flight_ends_where_the_requirements_stop_looking() -> None:
    """What a requirement at 20 s needs is the same on the whole flight; one at the end needs all of it."""
    base = small(trajectory={"name": "turn", "duration": "60 s"}, sensitivities="simulated")

    def flown(*moments: str) -> Trajectory:
        wanted = [{"error": "position", "limit": "99 km", "rule": "rss", "at": at} for at in moments]
        return flight_path(loaded(base | {"requirement": wanted}).spec, Path())

    whole, short = flown("20 s", "end"), flown("20 s", "5 s")
    assert whole.time_s[-1] == 60.0
    assert short.time_s[-1] == pytest.approx(20.0)
    assert len(short.angle_increment) == len(short.time_s) - 1 == len(short.attitude) - 1
    errors = ["gyro.bias", "accelerometer.bias"]
    at_20 = sensitivities(whole, errors, instants=[20.0])
    there = int(np.argmin(abs(at_20.time_s - 20.0)))
    found, wanted = sensitivities(short, errors).position[-1], at_20.position[there]
    # the steps in which the error equations are integrated follow the length of the flight
    np.testing.assert_allclose(found, wanted, rtol=2e-6, atol=2e-6 * np.abs(wanted).max())
    with pytest.raises(InputError, match="after the end of the flight, 60 s"):
        flown("90 s")
