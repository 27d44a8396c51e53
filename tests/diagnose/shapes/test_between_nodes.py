"""What a sweep shows between the nodes of a table; a reference is wrong for more than one channel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.agreement import of_one_channel
from planner.diagnose.hypotheses.pool import pool_of
from planner.diagnose.hypotheses.scores import score
from planner.diagnose.search.sensor import begin
from planner.diagnose.shapes.between_nodes import between_nodes
from planner.temperature_table import hats, temperature_nodes
from tests.diagnose.hall import Noise, hidden, read, sweeps
from tests.diagnose.worlds import DECLARED, whole

QUIET = Noise(2e-4, 6e-4)


@pytest.mark.parametrize("seed", [31])
@pytest.mark.further("seed", [32, 33])
def test_a_wave_over_temperature_that_no_table_follows(seed: int) -> None:
    hall = sweeps(seed)
    wave = 2.5e-3 * np.sin(2.0 * np.pi * hall.temperature / 17.0)
    found = whole(hidden(read(hall, seed, gyro=QUIET), "gyro", 1, wave))
    assert [(u.channels, u.varies_with) for u in found.unknown] == [(("gyro_y",), "temperature")]
    assert not found.effects
    assert not found.reference_suspects


@pytest.mark.parametrize("seed", [34])
@pytest.mark.further("seed", [35, 36])
def test_smooth_curves_leave_nothing_to_find(seed: int) -> None:
    found = whole(read(sweeps(seed), seed, gyro=QUIET))
    assert found.verdict == "clean"


def test_columns_are_clear_of_the_table_and_of_smooth_curves() -> None:
    t = np.linspace(-50.0, 66.0, 700)
    nodes = temperature_nodes(t)
    smooth = np.column_stack([hats(t, nodes, 0.0), (t / 60.0) ** 3, (t / 60.0) ** 5])
    found = list(between_nodes(t, nodes))
    assert [C.shape[1] for C in found] == [len(nodes) - 1, 2 * (len(nodes) - 1)]
    assert all(np.abs(C.T @ smooth).max() < 1e-9 * np.linalg.norm(smooth) for C in found)


def test_soaked_points_have_nothing_between_them() -> None:
    t = np.repeat([-40.0, -10.0, 20.0, 50.0], 40) + np.tile([-0.1, 0.1], 80)
    assert not list(between_nodes(t, temperature_nodes(t)))


@pytest.mark.parametrize("seed", [37])
@pytest.mark.further("seed", [38])
def test_what_one_channel_shows_is_no_lag_of_the_thermometer(seed: int) -> None:
    """Of a lag the other two would see several sigma."""
    hall = sweeps(seed)
    table = read(hall, seed, gyro=QUIET, felt=replace(hall, temperature=hall.temperature - 4.0 * hall.ramp))
    begun = begin(prepared(table), "gyro", DECLARED)
    lags = [i for i, b in enumerate(begun.pool.blocks) if b.name == "thermometer_lag"]
    lag = max(lags, key=lambda i: score(begun.pool, [i]).criterion)
    assert not of_one_channel(begun.pool, lag)
    alone = {a: w if a == 1 else replace(w, z=0.0 * w.z) for a, w in begun.pool.state.items()}
    pool = pool_of(alone, begun.pool.blocks, begun.cuts)
    assert of_one_channel(pool, lag)
