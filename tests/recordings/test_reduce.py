"""Raw recordings to dwell tables: the truth of generated recordings comes out, every sample is told of."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.dwells.dwell_files import read_dwells, write_dwells
from planner.recordings.column_map import ColumnMap
from planner.recordings.plan_records import PlannedRecord
from planner.recordings.raw_to_dwells import reduce_recordings
from planner.recordings.reduction import Reduction
from planner.units import from_si
from tests.documents import keeps
from tests.outcome import Run
from tests.recordings.recordings import ACC_BIAS, GYRO_BIAS, HEADER, Recorded, save, tumbled

RECORDED = tumbled()
# tactical to consumer: 0.002 … 0.5 deg/s and 0.1 … 20 mg in one sample at 200 Hz
NOISES = [(0.002, 1e-4), (0.05, 2e-3), (0.5, 2e-2)]


def reduced(
    path: Path, recorded: Recorded, noise: tuple[float, float] = NOISES[1], seed: int = 1
) -> Reduction:
    return reduce_recordings([save(path / "unit7.csv", recorded.readings(*noise, seed))])


def samples_told(found: Reduction) -> int:
    """Samples in rows, left out of rows, and in stretches without a row."""
    rows = sum(row.n_samples + sum(row.left_out.values()) for row in found.rows)
    return rows + sum(part.samples for part in found.left_out)


# ---------------------------------------------------------------- rests and means


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rests_are_found_on_quiet_and_on_noisy_units(tmp_path, noise, seed):
    found = reduced(tmp_path, RECORDED, noise, seed)
    assert len(found.rows) == len(RECORDED.rests)
    for row, (start, end) in zip(found.rows, RECORDED.rests, strict=True):
        # within a fifth of a second: a turn begins with (t/T)^3, so its first tenths are under the noise
        assert start - 0.2 <= row.start <= start + 0.2
        assert end - 0.2 <= row.end <= end + 0.2


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_means_are_the_truth_within_their_noise(tmp_path, noise, seed):
    table = reduced(tmp_path, RECORDED, noise, seed).table
    gyro, acc = np.degrees(table.gyro), table.acc / 9.80665
    # 5 sigma of a mean of about 1150 samples: 36 numbers, false alarm 2e-5; the turn's ends add 1e-3 of it
    assert np.abs(gyro - GYRO_BIAS).max() < 5 * noise[0] / np.sqrt(1100) + 2e-3 * noise[0]
    assert np.abs(acc - RECORDED.up - ACC_BIAS).max() < 5 * noise[1] / np.sqrt(1100) + 2e-3 * noise[1]


@pytest.mark.parametrize("noise", NOISES)
def test_the_spread_within_a_record_is_the_noise(tmp_path, noise):
    table = reduced(tmp_path, RECORDED, noise).table
    # the spread of 1100 samples is known to 1/sqrt(2200) = 2 %; 5 sigma
    np.testing.assert_allclose(np.degrees(table.gyro_std), noise[0], rtol=0.11)
    np.testing.assert_allclose(table.acc_std / 9.80665, noise[1], rtol=0.11)


@settings(deadline=None, max_examples=15)
@given(
    rate=st.sampled_from([50.0, 100.0, 333.0]),
    size=st.floats(1e-3, 0.5),
    rest=st.floats(3.0, 8.0),
    seed=st.integers(0, 99),
)
def test_every_sample_is_told_of(tmp_path_factory, rate, size, rest, seed):
    recorded = tumbled(rate=rate, rest=rest, turns=(0, 1, 2))
    found = reduced(tmp_path_factory.mktemp("r"), recorded, (size, size / 30), seed)
    assert samples_told(found) == len(recorded.time)
    assert len(found.rows) == 4


def test_scaling_the_readings_scales_the_rows(tmp_path):
    values = RECORDED.readings(*NOISES[1], 1)
    plain = reduce_recordings([save(tmp_path / "a.csv", values, fmt="%.17g")]).table
    doubled = values * [1, 2, 2, 2, 1, 1, 1, 1]
    twice = reduce_recordings([save(tmp_path / "b.csv", doubled, fmt="%.17g")]).table
    # a factor of two is exact in binary, the same windows are quiet
    np.testing.assert_allclose(twice.gyro, 2 * plain.gyro, rtol=1e-12)
    np.testing.assert_allclose(twice.acc, plain.acc, rtol=1e-12)


def test_a_unit_that_never_moves_gives_rows_all_along(tmp_path):
    recorded = tumbled(turns=(), rest=60.0)
    found = reduced(tmp_path, recorded)
    assert samples_told(found) == 12000
    assert sum(row.n_samples for row in found.rows) > 0.98 * 12000


def test_a_long_rest_is_cut_into_records(tmp_path):
    path = save(tmp_path / "a.csv", tumbled(turns=(), rest=90.0).readings(*NOISES[1], 1))
    columns = ColumnMap.model_validate(standard() | {"record": "30 s"})
    assert len(reduce_recordings([path], columns).rows) == 3


def standard() -> dict[str, object]:
    gyro = {axis: f"gyro_{axis}_dps" for axis in "xyz"} | {"unit": "deg/s"}
    acc = {axis: f"acc_{axis}_g" for axis in "xyz"} | {"unit": "g"}
    return {"time": {"column": "time_s", "unit": "s"}, "gyro": gyro, "acc": acc}


# ---------------------------------------------------------------- steps and turns


def test_steps_of_a_column_are_the_records(tmp_path):
    values = RECORDED.readings(*NOISES[1], 1)
    names = np.full(len(values), "", dtype="U40")
    names[200:800], names[1500:2300] = "table/20/static/r01/m1", "table/20/static/r01/m2"
    lines = [",".join(map(str, row)) + f",{name}" for row, name in zip(values.tolist(), names, strict=True)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join([HEADER + ",step", *lines]) + "\n")
    found = reduce_recordings([path])
    assert [row.step for row in found.rows] == ["table/20/static/r01/m1", "table/20/static/r01/m2"]
    assert [row.n_samples for row in found.rows] == [600, 800]
    np.testing.assert_allclose(found.table.gyro[0], np.radians(values[200:800, 1:4].mean(axis=0)), rtol=1e-9)
    assert samples_told(found) == len(values)


def test_steps_of_the_plan_are_laid_over_by_time(tmp_path):
    values = RECORDED.readings(*NOISES[1], 1)
    records = [PlannedRecord("a/m1", 101.0, 104.0), PlannedRecord("a/m2", 108.0, 112.0)]
    path = save(tmp_path / "a.csv", values)
    columns = ColumnMap.model_validate(standard() | {"plan_time": "100 s"})
    found = reduce_recordings([path], columns, records)
    assert [row.step for row in found.rows] == ["a/m1", "a/m2"]
    assert found.rows[0].start == pytest.approx(1.0, abs=0.051)  # whole windows of 50 ms
    assert found.rows[1].end == pytest.approx(12.0, abs=0.051)


def test_a_steady_turn_is_a_row_where_its_rate_is_known(tmp_path):
    rng = np.random.default_rng(1)
    time = np.arange(8000) / 200
    rate = np.where((time >= 10) & (time < 25), 50.0, 0.0)
    gyro = (
        np.column_stack([np.zeros_like(rate), np.zeros_like(rate), 1.01 * rate])
        + rng.normal(size=(8000, 3)) * 0.05
    )
    acc = [0, 0, 1] + rng.normal(size=(8000, 3)) * 0.002
    reference = np.column_stack([np.zeros_like(rate), np.zeros_like(rate), rate])
    names = HEADER + ",ref_rate_x_dps,ref_rate_y_dps,ref_rate_z_dps"
    values = np.column_stack([time, gyro, acc, np.full(8000, 20.0)])
    told = reduce_recordings([save(tmp_path / "a.csv", np.column_stack([values, reference]), names)])
    assert [round(float(np.degrees(r))) for r in told.table.ref_rate[:, 2]] == [0, 50, 0]
    assert np.degrees(told.table.gyro[1, 2]) == pytest.approx(50.5, abs=0.005)  # 5 sigma / sqrt(3000)
    unsaid = reduce_recordings([save(tmp_path / "b.csv", values)])
    assert len(unsaid.rows) == 2
    assert any("turns steadily" in part.reason for part in unsaid.left_out)


# ---------------------------------------------------------------- temperature


@pytest.mark.parametrize("kelvin_per_min", [-3.0, 0.0, 0.5, 4.0])
def test_the_temperature_rate_is_that_of_the_record(tmp_path, kelvin_per_min):
    recorded = tumbled(kelvin_per_s=kelvin_per_min / 60, rest=12.0, turns=(0, 1))
    values = recorded.readings(*NOISES[1], 1)
    values[:, 7] += 0.05 * np.random.default_rng(2).normal(size=len(values))
    table = reduce_recordings([save(tmp_path / "a.csv", values)]).table
    # 0.05 K over 12 s at 200 Hz: sigma of the slope 0.05·sqrt(12)/(12·sqrt(2400)) = 3e-4 K/s; 5 sigma
    np.testing.assert_allclose(table.temperature_rate, kelvin_per_min / 60, atol=1.5e-3)
    middle = [np.mean(rest) for rest in recorded.rests]
    np.testing.assert_allclose(table.temperature_degc, 20 + np.array(middle) * kelvin_per_min / 60, atol=0.02)


def test_time_since_power_on_counts_from_what_the_map_says(tmp_path):
    path = save(tmp_path / "a.csv", RECORDED.readings(*NOISES[1], 1))
    columns = ColumnMap.model_validate(standard() | {"time_on": "120 s", "run": 4, "day": 2, "unit": "u9"})
    table = reduce_recordings([path], columns).table
    np.testing.assert_allclose(table.time_on, 120 + np.mean(RECORDED.rests, axis=1), atol=0.2)
    assert set(table.run.tolist()) == {4}
    assert set(table.day.tolist()) == {2.0}
    assert set(table.unit.tolist()) == {"u9"}


# ---------------------------------------------------------------- disturbances


def test_spikes_of_two_milliseconds_change_nothing(tmp_path):
    recorded = tumbled(rate=1000.0, rest=4.0, turns=(0, 1))
    clean = recorded.readings(*NOISES[1], 1)
    spiked = clean.copy()
    places = np.arange(150, len(clean) - 10, 401)
    for k, place in enumerate(places):  # to zero, to full scale, one or two samples, any channel
        spiked[place : place + 1 + k % 2, 1 + k % 6] = (0.0, 300.0, -300.0)[k % 3] if k % 6 < 3 else 16.0
    before = reduce_recordings([save(tmp_path / "a.csv", clean)])
    after = reduce_recordings([save(tmp_path / "b.csv", spiked)])
    # what is left out is noise: the means move by a few of 3700 samples' noise
    assert np.abs(np.degrees(after.table.gyro - before.table.gyro)).max() < 0.05 * 0.05
    assert np.abs(after.table.acc - before.table.acc).max() / 9.80665 < 0.05 * 0.002
    assert sum(row.left_out.get("spike", 0) for row in after.rows) > 20
    assert samples_told(after) == len(spiked)


def test_no_spike_is_found_in_plain_noise(tmp_path):
    for seed in (1, 2, 3):
        found = reduced(tmp_path, tumbled(turns=(), rest=100.0), NOISES[1], seed)
        assert sum(row.left_out.get("spike", 0) for row in found.rows) == 0


def test_a_hand_that_turns_a_unit_makes_no_spikes(tmp_path):
    """Coarse digits, 100 Hz, a jerky turn: what changes from sample to sample by itself is no spike."""
    rng = np.random.default_rng(1)
    values = tumbled(rate=100.0, rest=5.0, turn=2.0).readings(0.05, 0.002, 1)
    moving = (values[:, 0] % 7.0) >= 5.0
    jerk = np.convolve(rng.normal(size=len(values)), np.ones(4) / 4, "same") * 20.0
    values[moving, 1:4] += jerk[moving, None]
    values[:, 1:4] = np.round(values[:, 1:4] / 0.061) * 0.061
    found = reduce_recordings([save(tmp_path / "a.csv", values)])
    assert sum(row.left_out.get("spike", 0) for row in found.rows) == 0
    steps = np.where(moving, "turn", "rest")
    lines = [",".join(map(str, row)) + f",{name}" for row, name in zip(values.tolist(), steps, strict=True)]
    (tmp_path / "b.csv").write_text("\n".join([HEADER + ",step", *lines]) + "\n")
    whole = reduce_recordings([tmp_path / "b.csv"])
    # of 1000 moving samples a few at the beginning of a turn may look odd
    assert sum(row.left_out.get("spike", 0) for row in whole.rows) <= 10


def test_a_burst_of_a_tenth_of_a_second_splits_no_rest(tmp_path):
    recorded = tumbled(rate=1000.0, rest=6.0, turns=(0,))
    values = recorded.readings(*NOISES[1], 1)
    burst = slice(3000, 3100)
    shake = 0.3 * np.sin(2 * np.pi * 80 * recorded.time[burst])
    values[burst, 4:7] += shake[:, None]
    found = reduce_recordings([save(tmp_path / "a.csv", values)])
    assert len(found.rows) == 2
    # the windows of 50 ms that the burst touches, and the two at the ends of the rest
    assert 200 <= found.rows[0].left_out["edge_or_burst"] <= 350
    assert np.abs(found.table.acc[0] / 9.80665 - [0, 0, 1] - ACC_BIAS).max() < 5 * 0.002 / np.sqrt(5000)


def test_a_bias_jump_is_told_and_splits_the_record(tmp_path):
    recorded = tumbled(turns=(), rest=60.0)
    values = recorded.readings(*NOISES[1], 1)
    values[6000:, 2] += 0.5  # ten times the noise of a sample
    found = reduce_recordings([save(tmp_path / "a.csv", values)])
    assert len(found.rows) == 2
    np.testing.assert_allclose(
        np.degrees(found.table.gyro[:, 1]), GYRO_BIAS[1] + np.array([0, 0.5]), atol=5 * 0.05 / np.sqrt(5000)
    )
    (note,) = [note for note in found.table.notes if "jumps" in note]
    assert "gyro_y jumps by 0.5" in note
    assert "30.0" in note or "29.9" in note


def test_a_dead_temperature_sensor_is_marked(tmp_path):
    recorded = tumbled(rest=15.0, kelvin_per_s=0.02)
    values = recorded.readings(*NOISES[1], 1)
    dead = (recorded.time > 15.5) & (recorded.time < 35.5)
    values[dead, 7] = -273.15
    found = reduce_recordings([save(tmp_path / "a.csv", values)])
    assert np.abs(found.table.temperature_degc - 20 - 0.02 * found.table.time_on).max() < 0.2
    assert any("temperature sensor is dead for 20" in note for note in found.table.notes)
    assert any(part.reason == "the temperature sensor is dead" for part in found.left_out)
    assert samples_told(found) == len(values)


def test_a_temperature_sensor_that_is_dead_throughout_leaves_no_column(tmp_path):
    values = RECORDED.readings(*NOISES[1], 1)
    values[:, 7] = np.nan
    found = reduce_recordings([save(tmp_path / "a.csv", values)])
    assert "temp_degc" in found.table.absent
    assert any("dead throughout" in note for note in found.table.notes)


def test_a_gap_in_time_ends_a_record(tmp_path):
    values = tumbled(turns=(), rest=60.0).readings(*NOISES[1], 1)
    values[6000:, 0] += 300.0
    found = reduce_recordings([save(tmp_path / "a.csv", values)])
    assert len(found.rows) == 2
    assert found.table.duration.sum() == pytest.approx(60.0, abs=0.5)


def test_a_few_lost_samples_do_not_end_a_record(tmp_path):
    values = tumbled(turns=(), rest=60.0).readings(*NOISES[1], 1)
    kept = np.delete(values, np.arange(500, 11000, 97), axis=0)
    found = reduce_recordings([save(tmp_path / "a.csv", kept)])
    assert len(found.rows) == 1
    assert samples_told(found) == len(kept)


# ---------------------------------------------------------------- files and command


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".h5"])
def test_the_table_reads_back(tmp_path, suffix):
    table = reduced(tmp_path, RECORDED).table
    write_dwells(table, tmp_path / f"data{suffix}")
    back = read_dwells(tmp_path / f"data{suffix}")
    # 15 digits are written
    np.testing.assert_allclose(back.gyro, table.gyro, rtol=1e-13)
    np.testing.assert_allclose(back.acc_std, table.acc_std, rtol=1e-13)
    assert back.step.tolist() == table.step.tolist()
    assert set(table.notes) <= set(back.notes)


def test_the_command_writes_the_table_and_the_account(tmp_path, run: Run):
    save(tmp_path / "unit7.csv", RECORDED.readings(*NOISES[1], 1))
    outcome = run("reduce", "unit7.csv", "-o", "data.csv", "--json")
    assert outcome.code == 0, outcome.err
    assert outcome.json["written"] == ["data.csv", "data.account.json"]
    account = json.loads((tmp_path / "data.account.json").read_text())
    assert {key: outcome.json[key] for key in account} == account
    keeps(account, "account")
    told = sum(row["samples"] + sum(row["left_out"].values()) for row in account["rows"])
    told += sum(part["samples"] for part in account["stretches_left_out"])
    assert told == len(RECORDED.time) == account["files"]["unit7.csv"]["samples"]["read"]
    assert all(part["reason"] for part in account["stretches_left_out"])
    table = read_dwells(tmp_path / "data.csv")
    assert len(table) == len(account["rows"]) == 6


def test_the_same_recording_gives_the_same_bytes(tmp_path, run: Run):
    save(tmp_path / "unit7.csv", RECORDED.readings(*NOISES[1], 1))
    for name in ("a", "b"):
        assert run("reduce", "unit7.csv", "-o", f"{name}.csv").code == 0
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert (tmp_path / "a.account.json").read_bytes() == (tmp_path / "b.account.json").read_bytes()


def test_the_recommended_record_is_a_line_that_the_spec_takes(tmp_path, run: Run):
    rng = np.random.default_rng(1)
    n = 120_000
    walk = np.cumsum(rng.normal(size=(n, 3)), axis=0) * 0.0005
    values = tumbled(turns=(), rest=600.0).readings(0.05, 0.002, 1)
    values[:, 1:4] += walk
    save(tmp_path / "a.csv", values)
    outcome = run("reduce", "a.csv", "-o", "data.csv", "--json")
    snippet = outcome.json["spec_snippet"]
    assert not outcome.json["record_is_lower_bound"]
    assert run("init", "spec.yaml").code == 0
    text = (tmp_path / "spec.yaml").read_text()
    line = next(
        line for line in text.splitlines() if "record:" in line and "#" not in line.split("record:")[0]
    )
    value = line.split("record:")[1].split(",")[0].split("}")[0].split("#")[0].strip()
    (tmp_path / "spec.yaml").write_text(text.replace(line, line.replace(f"record: {value}", snippet)))
    checked = run("check", "spec.yaml")
    assert checked.code == 0, checked.err
    # white N = 0.05/sqrt(200), walk K = 0.0005·sqrt(200): the least lies at sqrt(3)·N/K = 0.87 s, under 10 s
    assert snippet == "record: 10 s"
    best = min(one["best_time_s"] for one in outcome.json["allan"] if one["channel"].startswith("gyro"))
    assert best == pytest.approx(np.sqrt(3) * 0.05 / 0.0005 / 200, rel=0.2)  # K is known to a tenth


def test_display_units_of_the_account(tmp_path, run: Run):
    save(tmp_path / "a.csv", tumbled(turns=(), rest=60.0).readings(0.05, 0.002, 1))
    outcome = run("reduce", "a.csv", "-o", "data.csv", "--json")
    gyro = outcome.json["allan"][0]
    assert gyro["unit"] == "deg/s"
    assert gyro["deviation"][0] == pytest.approx(0.05, rel=0.05)  # σ(τ0) of white noise is its spread
    white = next(term for term in gyro["terms"] if term["name"] == "white_noise")
    assert white["ci95"][0] <= 0.05 / np.sqrt(200) <= white["ci95"][1]
    assert from_si(np.radians(1.0), "deg/s") == pytest.approx(1.0)
