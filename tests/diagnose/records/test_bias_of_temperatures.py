"""Gyros whose bias is of the size of the rates, and another one at each temperature: no label is turned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.records.not_as_said import screened
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
