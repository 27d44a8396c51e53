"""A flight written to a CSV file and read again is the same flight, at any rate and rounding."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.nouns.array import Array
from planner.nouns.trajectory import Trajectory
from tests.trajectories.flights import HEADER, apart, flight, rph_deg, table, write
from tests.trajectories.test_return import returned

MOVING = ("helicopter", "small_uav_1", "small_uav_2", "turn")


def read(path: Path, **parameters: str) -> Trajectory:
    return flight("file", file=str(path), **parameters)


def worst(one: Array, other: Array) -> float:
    return float(np.abs(one - other).max())


@pytest.mark.parametrize("name", ["helicopter", "level", "small_uav_1", "small_uav_2", "static", "turn"])
def test_round_trip_at_100_hz(name: str, tmp_path: Path) -> None:
    true = flight(name)
    back = read(write(tmp_path / "flight.csv", table(true)))
    assert back.name == "flight"
    np.testing.assert_allclose(back.time_s, true.time_s, atol=1e-12)
    # ten decimals of a degree are 1e-5 m; five orders below a centimetre in the readings
    assert apart(back, true).max() < 1e-4
    assert worst(np.cumsum(back.angle_increment, 0), np.cumsum(true.angle_increment, 0)) < 1e-10
    assert worst(np.cumsum(back.velocity_increment, 0), np.cumsum(true.velocity_increment, 0)) < 1e-4
    assert returned(back) < 0.01


@pytest.mark.parametrize("name", MOVING)
def test_rounding_stays_out_of_the_accelerometers(name: str, tmp_path: Path) -> None:
    true, rows = flight(name), table(flight(name))
    for columns, decimals in ((slice(1, 3), 7), (slice(3, 4), 2), (slice(4, 10), 3)):
        rows[:, columns] = rows[:, columns].round(decimals)
    back = read(write(tmp_path / "flight.csv", rows))
    assert apart(back, true).max() < 0.01  # 1 cm is the last digit of the file
    force, expected = back.velocity_increment / 0.01, true.velocity_increment / 0.01
    # 1 mm/s in 10 ms is 0.1 m/s²; a position rounded to 1 cm, differentiated twice, would be 100 m/s²
    assert worst(force, expected) < 0.3


@pytest.mark.parametrize(("rate", "metres"), [(50, 1e-3), (20, 1e-3), (10, 0.02)])
@pytest.mark.parametrize("name", ["helicopter", "turn", "small_uav_2"])
def test_slower_files_are_filled_in(name: str, rate: int, metres: float, tmp_path: Path) -> None:
    true = flight(name)
    back = read(write(tmp_path / "flight.csv", table(true)[:: 100 // rate]))
    assert len(back.time_s) == len(true.time_s)
    assert apart(back, true).max() < metres
    assert returned(back) < 0.01


def test_one_row_a_second_follows_a_gentle_flight(tmp_path: Path) -> None:
    true = flight("turn", bank="15 deg", roll_in="20 s", duration="120 s")
    back = read(write(tmp_path / "flight.csv", table(true)[::100]))
    assert apart(back, true).max() < 0.01
    assert worst(np.cumsum(back.angle_increment, 0), np.cumsum(true.angle_increment, 0)) < 1e-3


@pytest.mark.parametrize("name", ["small_uav_2", "turn"])
def test_faster_files_lose_nothing(name: str, tmp_path: Path) -> None:
    fine, true = flight(name, sampling_rate="1000 Hz"), flight(name)
    back = read(write(tmp_path / "flight.csv", table(fine)))
    assert len(back.time_s) == len(true.time_s)
    assert apart(back, true).max() < 1e-4
    assert worst(np.cumsum(back.velocity_increment, 0), np.cumsum(true.velocity_increment, 0)) < 1e-4


def test_vibration_faster_than_the_grid_is_integrated_not_sampled(tmp_path: Path) -> None:
    rows = table(flight("level", sampling_rate="1000 Hz", duration="20 s"))
    wave = 2 * np.pi * 97.0
    rows[:, 6] += 0.05 * np.cos(wave * rows[:, 0])  # 3 g at 97 Hz, next to the grid's 100 Hz
    rows[:, 3] -= 0.05 / wave * np.sin(wave * rows[:, 0])
    back = read(write(tmp_path / "flight.csv", rows))
    still = flight("level", duration="20 s")
    gained = np.cumsum(back.velocity_increment - still.velocity_increment, 0)[:, 2]
    # the velocity itself, not an aliased acceleration summed up; 2 %: ten rows a wave make a cubic spline
    np.testing.assert_allclose(gained, 0.05 * (np.cos(wave * back.time_s[1:]) - 1.0), atol=0.002)


def test_time_may_start_anywhere_and_jitter(tmp_path: Path) -> None:
    fine = table(flight("helicopter", sampling_rate="1000 Hz"))
    rng = np.random.default_rng(1)
    kept = np.unique(np.clip(np.arange(0, 60_001, 10) + rng.integers(-2, 3, 6001), 0, 60_000))
    kept[[0, -1]] = 0, 60_000
    rows = fine[kept]
    rows[:, 0] += 4711.0
    back, true = read(write(tmp_path / "flight.csv", rows)), flight("helicopter")
    assert back.time_s[0] == 0.0
    assert apart(back, true).max() < 1e-3


def test_headings_and_longitudes_run_on_over_their_ends(tmp_path: Path) -> None:
    true = flight("turn", longitude="179.999 deg", heading="170 deg", bank="-45 deg", duration="60 s")
    rows = table(true)
    rows[:, 2] = (rows[:, 2] + 180.0) % 360.0 - 180.0
    assert np.ptp(rows[:, 2]) > 359.0
    assert np.ptp(rows[:, 9]) > 359.0
    back = read(write(tmp_path / "flight.csv", rows))
    assert apart(back, true).max() < 1e-4
    np.testing.assert_allclose(back.angle_increment, true.angle_increment, atol=1e-9)


def test_a_loop_through_the_vertical_is_no_obstacle(tmp_path: Path) -> None:
    t = np.arange(0.0, 20.001, 0.01)
    angle = np.radians(18.0) * t  # one loop at 60 m/s: the pitch passes ±90 deg
    north, down = 60 * np.cos(angle), -60 * np.sin(angle)
    way, height = 60 * np.sin(angle) / np.radians(18.0), 60 * (1 - np.cos(angle)) / np.radians(18.0)
    over = np.cos(angle) < 0
    pitch = np.degrees(np.arcsin(np.clip(np.sin(angle), -1, 1)))
    upside = np.where(over, 180.0, 0.0)
    latitude = np.degrees(way / (6335439.3273 + 3000.0))
    zero = np.zeros_like(t)
    rows = np.column_stack([t, latitude, zero, 3000 + height, north, zero, down, upside, pitch, upside])
    back = read(write(tmp_path / "flight.csv", rows))
    rate = np.degrees(back.angle_increment / 0.01)
    np.testing.assert_allclose(rate[:, 1], 18.0, atol=0.01)  # the loop, and 0.005 deg/s of the Earth
    assert np.abs(rate[:, [0, 2]]).max() < 0.01


def test_order_comments_blanks_and_line_ends_are_the_user_s(tmp_path: Path) -> None:
    true = flight("helicopter")
    rows, order = table(true), [9, 0, 3, 2, 1, 4, 5, 6, 8, 7]
    plain = read(write(tmp_path / "plain.csv", rows))
    path = write(
        tmp_path / "odd.csv", rows[:, order], names=[HEADER[i] for i in order], top="# made by\n\n# hand\n"
    )
    text = path.read_text().replace("\n", "\r\n").replace("time_s,", " time_s ,")
    path.write_bytes(b"\xef\xbb\xbf" + text.encode() + b"\r\n\r\n")
    odd = read(path)
    np.testing.assert_array_equal(odd.velocity_increment, plain.velocity_increment)


def test_temperature_comes_from_the_file_or_the_parameters(tmp_path: Path) -> None:
    rows = table(flight("level", duration="10 s"))
    warm = np.column_stack([rows, np.linspace(-10.0, 30.0, len(rows))])
    path = write(tmp_path / "warm.csv", warm, names=[*HEADER, "temp_degc"])
    np.testing.assert_allclose(read(path).temperature_degc, np.linspace(-10.0, 30.0, 1001), atol=1e-9)
    cold = read(write(tmp_path / "flight.csv", rows), temperature="-40 degC", time_on="5 min", day="2 week")
    assert (cold.temperature_degc[0], cold.time_on[0], cold.day) == (-40.0, 300.0, 14.0)


def test_a_last_line_without_its_end_may_be_whole(tmp_path: Path) -> None:
    path = write(tmp_path / "flight.csv", table(flight("turn")))
    path.write_bytes(path.read_bytes().rstrip(b"\n"))
    assert read(path).time_s[-1] == pytest.approx(60.0)


def test_agrees_with_python_ins_on_the_readings(tmp_path: Path) -> None:
    import pandas as pd
    from pyins import sim, util

    true = flight("turn")
    rows = table(true)
    _, imu = sim.generate_imu(rows[:, 0], rows[:, 1:4], rph_deg(true), rows[:, 4:7], "increment")
    back = read(write(tmp_path / "flight.csv", rows))
    assert isinstance(imu, pd.DataFrame)
    theirs = imu[util.GYRO_COLS + util.ACCEL_COLS].to_numpy()[1:]
    ours = np.hstack([back.angle_increment, back.velocity_increment])
    summed = np.abs(np.cumsum(ours - theirs, axis=0)).max(axis=0)
    # over a minute: 1e-8 rad and 1 mm/s, a millionth of what an error of a sensor would do
    assert summed[:3].max() < 1e-8
    assert summed[3:].max() < 1e-3


def test_twenty_minutes_at_100_hz_stay_within_bounds(tmp_path: Path) -> None:
    import tracemalloc

    path = tmp_path / "flight.csv"
    rows = (f"{k / 100:.2f},50,30,1000,0,0,0,0,0,45" for k in range(120_001))
    path.write_text("\n".join([",".join(HEADER), *rows]) + "\n")
    tracemalloc.start()
    back = read(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(back.time_s) == 120_001
    assert peak < 133e6  # the result alone is 23 MB


def test_a_flight_is_not_changed_by_being_written(tmp_path: Path) -> None:
    once = read(write(tmp_path / "a.csv", table(flight("small_uav_1"))))
    twice = read(write(tmp_path / "b.csv", table(once)))
    assert apart(once, twice).max() < 1e-4


@pytest.mark.parametrize("name", ["helicopter", "small_uav_1", "small_uav_2", "turn"])
@pytest.mark.parametrize("every", [1, 5])
def test_sensitivities_on_the_file_are_those_on_the_flight(name: str, every: int, tmp_path: Path) -> None:
    from planner.plan.spec_to_sensitivity import sensitivities

    errors = [
        f"{sensor}.{effect}" for sensor in ("gyro", "accelerometer") for effect in ("bias", "scale_factor")
    ]
    true, rows = flight(name), table(flight(name))[::every]
    for columns, decimals in ((slice(1, 3), 7), (slice(3, 4), 2), (slice(4, 7), 3), (slice(7, 10), 4)):
        rows[:, columns] = rows[:, columns].round(decimals)
    ours, theirs = (
        sensitivities(t, errors).position[-1] for t in (true, read(write(tmp_path / "flight.csv", rows)))
    )
    length = np.linalg.norm(ours, axis=0)
    matters = length > 1e-3 * length.reshape(-1, 3).max(axis=1).repeat(3)  # not an axis that nothing drives
    off = np.linalg.norm(theirs - ours, axis=0) / length
    assert off[matters].max() < 1e-3
