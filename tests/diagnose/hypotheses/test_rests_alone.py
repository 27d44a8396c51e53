"""At rest the Earth's rate alone drives a gyro: its scale factors and leans are not told, nor their products.

Campaigns of plain NumPy: power-ons of a few faces each, that differ from power-on to power-on, as when
warm-ups are recorded on whatever face the unit lies.
"""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.channel import channel
from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.worlds import DECLARED

FACES = np.concatenate([np.eye(3), -np.eye(3)])
RUNS, RECORDS, G = 10, 24, 9.80665
EARTH, LATITUDE = np.radians(15.041 / 3600.0), np.radians(52.0)


def rests(seed: int, step_dps: float) -> DwellTable:
    """Ten power-ons at two temperatures, every other on two faces, others on six; gyro x steps after five."""
    rng = np.random.default_rng([seed, 31])
    run = np.repeat(np.arange(RUNS), RECORDS)
    lies = [rng.permutation(6)[: 2 if k % 2 else 6] for k in range(RUNS)]
    face = np.concatenate([np.resize(f, RECORDS) for f in lies])
    up, north = FACES[face], FACES[(face + 1) % 6]
    rate = EARTH * (np.sin(LATITUDE) * up + np.cos(LATITUDE) * north)
    room = np.array([20.0, 45.0])[rng.permutation(RUNS) % 2][run]
    time_on = np.tile(np.geomspace(60.0, 4000.0, RECORDS), RUNS)
    levels = np.repeat(rng.normal(size=(2, RUNS, 3)), RECORDS, axis=1)
    noise = rng.normal(size=(2, len(run), 3))
    gyro = rate + np.radians(2e-3) * levels[0] + np.radians(3e-4) * noise[0]
    gyro[:, 0] += np.radians(step_dps) * (run >= RUNS // 2)
    return DwellTable(
        unit=np.full(len(run), "1"),
        run=run + 1,
        day=1.5 * run,
        time_on=time_on,
        duration=np.full(len(run), 20.0),
        temperature_degc=room + 0.02 * rng.normal(size=len(run)),
        temperature_rate=np.zeros(len(run)),
        ref_rate=rate,
        ref_acc=G * up,
        gyro=gyro,
        acc=G * (up + 3e-4 * levels[1] + 2e-5 * noise[1]),
        source="rests",
    )


@pytest.mark.parametrize("seed", [1, 3, 4, 5])
@pytest.mark.further("seed", [2, *range(6, 13)])
def test_a_step_between_power_ons_of_unlike_faces_is_no_g_sensitivity(seed: int) -> None:
    """The step went into scale factors of some hundred per cent at each temperature, and these into leans."""
    found = diagnose_sensor(prepared(rests(seed, 0.06)), "gyro", DECLARED, 1).found
    assert [found.pool.blocks[b].name for b in found.all] == ["bias_step"]


def test_what_no_record_tells_stays_out_of_the_products() -> None:
    table = prepared(rests(1, 0.06)).table
    assert table.gyro is not None
    c = channel("gyro", 0, table.conditions(), table.gyro[:, 0], DECLARED)
    assert np.allclose(c.lean, 1.0)
    assert c.J.shape[1] >= 4
