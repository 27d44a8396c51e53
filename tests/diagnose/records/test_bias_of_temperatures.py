"""Gyros whose bias is of the size of the rates, and another one at each temperature: no label is turned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.records.not_as_said import screened
from planner.nouns.dwell_table import DwellTable
from planner.simulate.campaign import Settings, prepared, simulate
from tests.simulate.benches import campaign_of

CONSUMER = "from_datasheets/consumer.yaml"  # 20 deg/s of bias, 20 deg/s over temperature, 50 deg/s of rate


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4, 5])
def test_a_cheap_unit_s_own_campaign_is_as_it_says(seed: int) -> None:
    """Of two of its own campaigns "face −y were +y" was said of three rows, "reads 54.85" of thirty-five."""
    spec, made = campaign_of(4, 2, CONSUMER)
    table, _ = simulate(made, prepared(spec), seed, settings=Settings())
    assert table.gyro is not None
    assert np.ptp(np.degrees(np.median(table.gyro, axis=0))) > 5.0  # else the test would say nothing
    seen = screened(table)
    assert seen.kept.all()
    assert not seen.suspects


@pytest.mark.parametrize("seed", [1, 2])
def test_what_is_wrong_beside_it_is_still_seen(seed: int) -> None:
    """Two axes swapped in one power-on of turns, and a sign that one channel lost in some rows of another."""
    spec, made = campaign_of(4, 2, CONSUMER)
    table, _ = simulate(made, prepared(spec), seed, settings=Settings())
    assert table.gyro is not None
    assert table.ref_rate is not None
    turns = [r for r in np.unique(table.run) if np.abs(table.ref_rate[table.run == r]).max() > 1.0]
    fast = np.linalg.norm(table.ref_rate, axis=1) > np.radians(100.0)
    gyro = table.gyro.copy()
    swapped = (table.run == turns[1]) & fast
    gyro[swapped] = gyro[swapped][:, [1, 0, 2]]
    lost = (table.run == turns[3]) & fast & (np.abs(table.ref_rate[:, 2]) > 1.0)
    gyro[lost, 2] *= -1.0
    seen = screened(replace(table, gyro=gyro))
    along = swapped & (np.abs(table.ref_rate[:, 2]) < 0.1)
    assert not seen.kept[along].any()
    assert not seen.kept[lost].any()
    assert seen.suspects


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_cheap_unit_on_ramps_is_as_it_says(seed: int) -> None:
    """Rows between two nodes of a ramp were left at no bias: 123 of 534 clean ones "read 13 for 10"."""
    table = _ramps(seed)
    seen = screened(table)
    assert seen.kept.all()
    assert not seen.suspects


@pytest.mark.parametrize("seed", [4, 5])
def test_a_reading_that_is_wrong_on_a_ramp_is_still_seen(seed: int) -> None:
    """Four turns of one ramp of which one channel says nothing."""
    table = _ramps(seed)
    assert table.gyro is not None
    assert table.ref_rate is not None
    about = np.abs(table.ref_rate[:, 1]) > np.radians(50.0)
    lost = np.flatnonzero((table.run == 2) & about)[:4]
    gyro = table.gyro.copy()
    gyro[lost, 1] -= table.ref_rate[lost, 1]
    seen = screened(replace(table, gyro=gyro))
    assert np.array_equal(np.flatnonzero(~seen.kept), lost)


def _ramps(seed: int, ramps: int = 4) -> DwellTable:
    """Gyros of 20 deg/s that change by as much from -40 to 60 degC; faces, and turns at 10 and 60 deg/s."""
    rng = np.random.default_rng([seed, 31])
    faces = np.vstack([np.eye(3), -np.eye(3)])
    steps = [(face, 0.0) for face in faces]
    steps += [(face, speed) for speed in (10.0, 60.0) for face in faces]
    minutes = np.arange(1.0, 66.0)
    n = len(minutes)
    parts: list[tuple[np.ndarray, ...]] = []
    for k in range(ramps):
        up, rate = (np.array([steps[(i + k) % len(steps)][j] for i in range(n)]) for j in (0, 1))
        T = 10.0 + (-1.0) ** k * (1.5 * minutes - 50.0)
        parts.append((np.full(n, k + 1), minutes * 60.0, T, np.abs(up), up * rate[:, None]))
    run, time_on, T, force, turn = (np.concatenate(x) for x in zip(*parts, strict=True))
    bias = rng.uniform(-20.0, 20.0, 3) + np.array([0.2, -0.2, 0.15]) * (T[:, None] - 20.0)
    gyro = 1.02 * turn + bias + 0.01 * rng.normal(size=(len(T), 3))
    return DwellTable(
        unit=np.full(len(T), "U"), run=run, day=run.astype(float), time_on=time_on,
        duration=np.full(len(T), 20.0), temperature_degc=T,
        temperature_rate=np.where(run % 2, 1.5, -1.5) / 60.0,
        ref_rate=np.radians(turn), ref_acc=9.80665 * force, gyro=np.radians(gyro), acc=None,
    )  # fmt: skip
