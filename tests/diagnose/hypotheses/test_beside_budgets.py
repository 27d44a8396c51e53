"""What other budgets let differ from power-on to power-on is no spread of a bias or of a scale factor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.hypotheses.beside_budgets import like_in_run, like_level, like_scale_factor
from planner.diagnose.hypotheses.prepared import prepared
from planner.diagnose.hypotheses.sensor import SensorFound, diagnose_sensor
from planner.dwells.table_rows import rows_of
from tests.diagnose.hypotheses.hall import ACC, G, Noise, days, hidden, read
from tests.diagnose.hypotheses.test_small_campaigns import claims
from tests.diagnose.hypotheses.worlds import DECLARED
from tests.specs import shipped

UNIT = shipped("small_uav").spec.unit


def faces(seed: int, power_ons: int, acc: Noise) -> SensorFound:
    """The accelerometers in six attitudes and turns, 18 records a power-on."""
    hall = days(seed, power_ons)
    return diagnose_sensor(prepared(read(hall, seed, acc=acc)), "accelerometer", DECLARED, 1)


def test_misalignments_of_every_power_on_look_like_noise_at_six_faces() -> None:
    """Two inputs of ±1 g in four of six records, in the others none: σ √(2/3) g of .003 deg."""
    hall = days(3, 9)
    rests = rows_of(read(hall, 3), np.flatnonzero(~hall.turns))
    found = diagnose_sensor(prepared(rests), "accelerometer", DECLARED, 1)
    budgets = {"misalignment": UNIT.accelerometer["misalignment"]}
    c = found.channels[0]
    starts = found.found.pool.state[0].noise.starts
    expected = np.radians(0.003) * G * np.sqrt(2.0 / 3.0)
    assert like_in_run(c, starts, budgets) == pytest.approx(expected, rel=0.02)
    assert like_scale_factor(c, starts, budgets) < 0.1 * np.radians(0.003)  # faces tell them apart
    scale = UNIT.accelerometer["scale_factor"]
    expected = np.hypot(scale.in_run_sigma, scale.run_to_run_largest) * G / np.sqrt(3.0)
    assert like_in_run(c, starts, {"scale_factor": scale}) == pytest.approx(expected, rel=0.02)


def test_what_wanders_within_a_power_on_has_a_mean_there() -> None:
    """The variance of the mean of a drawn first-order process; of one record, and of far ones."""
    bias, rng = UNIT.gyro["bias"], np.random.default_rng(97)
    times, starts = np.array([*np.arange(0.0, 900.0, 30.0), 5.0, 65.0]), np.array([0, 30])
    wanders = []
    for t in np.split(times, starts[1:]):
        cov = bias.in_run_sigma**2 * np.exp(-np.abs(t[:, None] - t) / bias.in_run_time)
        wanders.append(np.mean(rng.multivariate_normal(np.zeros(len(t)), cov, 40_000).mean(axis=1) ** 2))
    assert like_level(times, starts, bias) == pytest.approx(np.sqrt(np.mean(wanders)), rel=0.02)
    assert like_level(np.array([3.0]), np.array([0]), bias) == pytest.approx(bias.in_run_sigma)
    far = 1e3 * bias.in_run_time * np.arange(16.0)
    assert like_level(far, np.array([0]), bias) == pytest.approx(bias.in_run_sigma / 4.0)


@pytest.mark.parametrize("seed", [97051, 97052])
@pytest.mark.further("seed", range(97053, 97059))
def test_what_wanders_in_six_power_ons_is_noise(seed: int) -> None:
    """And a drift of as few is none, as the next test has it."""
    found = faces(seed, 6, replace(ACC, within=4.0 * ACC.white))
    assert claims(found) == []


@pytest.mark.parametrize("seed", [97061, 97062])
@pytest.mark.further("seed", range(97063, 97067))
def test_a_drift_of_six_power_ons_keeps_its_name(seed: int) -> None:
    hall = days(seed, 6)
    table = hidden(read(hall, seed), "acc", seed % 3, 20.0 * ACC.white * hall.time_on / hall.time_on.max())
    found = diagnose_sensor(prepared(table), "accelerometer", DECLARED, 1)
    assert [name for name, _ in claims(found)] in (["drift"], ["ageing"])
