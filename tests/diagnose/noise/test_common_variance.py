"""What three gyros have in common and what each has by itself are judged by one variance.

Campaigns of plain NumPy: a table turns each axis at a slow rate and a fast one, either way, and its servo is
off at the fast one. With two rates that is a cubic of each gyro too, but for the chance that three agree.
"""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.references.references import REFERENCES
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.worlds import DECLARED

RUNS, REPEATS, G = 8, 1, 9.80665
RATES_DPS = (3.0, -3.0, 400.0, -400.0)
OFF = np.full(3, -2.6e-3)


def turns(seed: int, off: np.ndarray) -> DwellTable:
    """Eight power-ons with a turn at each rate about each axis, a twentieth of the readings with long tails.

    off: (3,) share of the fast rate by which each gyro reads more than the table says
    """
    rng = np.random.default_rng([seed, 83])
    axis, rate = np.repeat(np.arange(3), len(RATES_DPS)), np.tile(RATES_DPS, 3)
    order = np.concatenate([rng.permutation(np.tile(np.arange(len(rate)), REPEATS)) for _ in range(RUNS)])
    axis, rate = axis[order], rate[order]
    n, records = len(order), len(order) // RUNS
    run = np.repeat(np.arange(RUNS), records)
    set_rate = np.eye(3)[axis] * np.radians(rate)[:, None]
    tails = np.where(rng.random((n, 3)) < 0.05, 3.0, 1.0)
    noise = np.radians(2e-4) * tails * rng.normal(size=(n, 3))
    levels = np.radians(1e-3) * rng.normal(size=(RUNS, 3))[run]
    lean = np.eye(3) + 2e-3 * rng.normal(size=(3, 3))
    fast = np.abs(rate)[:, None] > 100.0
    return DwellTable(
        unit=np.full(n, "1"),
        run=run + 1,
        day=1.3 * run,
        time_on=np.tile(120.0 + 20.0 * np.arange(records), RUNS),
        duration=np.full(n, 5.0),
        temperature_degc=22.0 + 0.1 * rng.normal(size=RUNS)[run],
        temperature_rate=np.zeros(n),
        ref_rate=set_rate,
        ref_acc=G * np.eye(3)[axis],
        gyro=(set_rate * (1.0 + off * fast)) @ lean.T + levels + noise,
        acc=None,
        source="turns",
    )


def names(seed: int, off: np.ndarray) -> set[str]:
    """What the diagnosis calls all that it believes."""
    found = diagnose_sensor(prepared(turns(seed, off)), "gyro", DECLARED, 1).found
    mine = {found.pool.blocks[b].name for b in found.all}
    return {REFERENCES[name].said or name if name in REFERENCES else name for name in mine}


@pytest.mark.parametrize("seed", [8, 10, 13, 14, 22])
@pytest.mark.further("seed", [*range(8), 9, 11, 12, *range(15, 22), 23])
def test_a_servo_that_all_gyros_see_alike_is_the_table(seed: int) -> None:
    assert names(seed, OFF) == {"table_rate"}


@pytest.mark.parametrize("seed", [0])
@pytest.mark.further("seed", [1, 2, 3])
def test_cubics_that_differ_are_the_gyros_own(seed: int) -> None:
    assert names(seed, OFF * [1.0, 1.4, 0.7]) == {"scale_factor_nonlinearity"}
