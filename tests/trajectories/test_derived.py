"""What a flight file leaves out is derived where it can be, refused where not, and `check` says which."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.errors import InputError
from planner.export.flight import flight_template
from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from planner.plan.spec_to_sensitivity import sensitivities
from planner.spec.starter import starter_text
from planner.trajectories._table import ATTITUDE, VELOCITY
from planner.trajectories.file import flight_table
from tests.outcome import Run
from tests.trajectories.flights import HEADER, apart, flight, rph_deg, table, write

EVERY = 10  # of the rows at 100 Hz


@pytest.fixture(scope="module")
def turn() -> Array:
    return table(flight("turn"))[::EVERY]


def without(path: Path, rows: Array, *names: str, form: str = "%.9f") -> Path:
    kept = [i for i, name in enumerate(HEADER) if name not in names]
    return write(path, rows[:, kept], names=[HEADER[i] for i in kept], form=form)


def metres(trajectory: Trajectory) -> Array:
    return sensitivities(trajectory, ["gyro.bias", "accelerometer.bias"]).position[-1]


@pytest.mark.parametrize(
    ("left_out", "decimals", "off_m"),
    [((*VELOCITY,), 9, 0.01), ((*ATTITUDE,), 9, 0.01), ((*VELOCITY, *ATTITUDE), 7, 0.05)],
)
def test_a_coordinated_turn_is_the_same_flight_without_its_columns(
    turn: Array, tmp_path: Path, left_out: tuple[str, ...], decimals: int, off_m: float
) -> None:
    """1e-7 deg are a centimetre; the metres per error follow from where the nose points."""
    whole = flight("file", file=str(write(tmp_path / "whole.csv", turn)))
    path = without(tmp_path / "part.csv", turn, *left_out, form=f"%.{decimals}f")
    derived = flight("file", file=str(path))
    assert apart(whole, derived).max() < off_m
    turned = (rph_deg(derived) - rph_deg(whole) + 180.0) % 360.0 - 180.0
    assert np.abs(turned).max() < 2.0  # where the turn begins and ends
    np.testing.assert_allclose(metres(derived), metres(whole), atol=0.005 * np.abs(metres(whole)).max())
    assert flight_table(path).derived == left_out


def test_a_helicopter_must_say_where_its_nose_points(tmp_path: Path) -> None:
    rows = table(flight("helicopter", duration="60 s"))[::EVERY]
    with pytest.raises(InputError) as refused:
        flight("file", file=str(without(tmp_path / "hover.csv", rows, *ATTITUDE)))
    assert {f.path for f in refused.value.faults} == set(ATTITUDE)
    assert "there is no course" in refused.value.faults[0].message


def test_a_launch_that_a_smooth_curve_cannot_follow_is_refused_with_what_to_add(tmp_path: Path) -> None:
    rows = table(flight("small_uav_2"))[:: 10 * EVERY]
    with pytest.raises(InputError) as refused:
        flight("file", file=str(without(tmp_path / "shot.csv", rows, *VELOCITY, form="%.7f")))
    assert "was derived and does not suit: add its columns" in refused.value.faults[0].message


def spec_of(folder: Path, name: str) -> Path:
    text = starter_text().splitlines()
    lines = [f"trajectory: {{file: {name}}}" if line.startswith("trajectory:") else line for line in text]
    path = folder / "spec.yaml"
    path.write_text("\n".join(lines))
    return path


def test_check_lists_every_missing_and_foreign_column_at_once(run: Run, turn: Array, tmp_path: Path) -> None:
    kept = [i for i, name in enumerate(HEADER) if name != "alt_m"]
    names = ["gust" if HEADER[i] == "v_east_mps" else HEADER[i] for i in kept]
    write(tmp_path / "flight.csv", turn[:, kept], names=names)
    found = run("check", spec_of(tmp_path, "flight.csv"))
    assert found.code == 2
    for said in (
        "alt_m: this column is missing",
        "v_east_mps: this column is missing",
        "gust: unknown column",
    ):
        assert said in found.err


def test_check_flies_the_file_and_says_what_was_derived(run: Run, turn: Array, tmp_path: Path) -> None:
    without(tmp_path / "flight.csv", turn, *VELOCITY)
    found = run("check", spec_of(tmp_path, "flight.csv"))
    assert (found.code, "velocity derived" in found.err) == (0, True)
    rows = turn.copy()
    rows[100:, 1] += 0.01  # a kilometre north
    write(tmp_path / "flight.csv", rows)
    found = run("check", spec_of(tmp_path, "flight.csv"))
    assert (found.code, "P615" in found.err) == (2, True)


def test_the_template_flies_and_checks_without_a_fault(run: Run, tmp_path: Path) -> None:
    assert run("init", "--flight", tmp_path / "flight.csv").code == 0
    assert (tmp_path / "flight.csv").read_text() == flight_template()
    assert not (tmp_path / "spec.yaml").exists()
    found = run("check", spec_of(tmp_path, "flight.csv"))
    assert (found.code, found.err) == (0, "")
    assert run("init", "--flight", tmp_path / "flight.csv").code == 2  # not over what is there
