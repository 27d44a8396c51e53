"""A rest between the loads of a power-on is the level from which theirs count: it tells no scale factor."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.hardly_driven import hardly_driven
from planner.diagnose.search.sensor import begin, diagnose_sensor
from planner.dwells.table_rows import rows_of
from planner.effects.scale_factor_acceleration_squared import EFFECT
from planner.nouns.dwell_table import DwellTable
from planner.units import STANDARD_GRAVITY_MPS2
from tests.diagnose.hall import FACES, Hall, Log, Noise, hidden, read
from tests.diagnose.worlds import DECLARED, named, unnamed

NAME = "scale_factor_acceleration_squared"
LOADS = (6.0, 15.0, 20.0)  # g
RADIUS = 1.7  # m
GYRO = Noise(5e-5, 1e-3, 3e-5, within=3e-4)  # what wanders in a power-on is more than a record's own noise


def _arm_and_table(seed: int) -> Hall:
    """Rests and turns on a table, then power-ons on an arm, three loads twice and a rest behind them."""
    rng, log = np.random.default_rng([seed, 31]), Log()
    for degc in (-20.0, 20.0, 55.0):
        for _ in range(2):
            log.on(rng.uniform(8.0, 50.0))
            log.on_the_table(rng, degc)
            log.day += 0.1
        for axis, sign in FACES:
            log.on(rng.uniform(8.0, 50.0))
            sense = rng.choice([-1.0, 1.0])
            for load in rng.permutation(np.repeat(LOADS, 2)):
                turn = sense * float(np.degrees(np.sqrt(load * STANDARD_GRAVITY_MPS2 / RADIUS)))
                log.record((axis + 1) % 3, 1.0, degc, turn=turn)
                log.rows[-1][5 + axis] += sign * load  # the force, of which one g is up
            log.record((axis + 1) % 3, 1.0, degc)
            log.day += 0.1
        log.day += 2.0
    return log.hall()


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4, 5])
def test_a_scale_factor_over_the_square_of_loads_has_its_name(seed: int) -> None:
    """Most of what tells it was the rest of every power-on, row by row, and its name was not asked."""
    table = read(_arm_and_table(seed), seed, gyro=GYRO)
    added = EFFECT.regressors("gyro", table.conditions())[:, 0, 0]
    table = hidden(table, "gyro", 0, 3e-8 * np.degrees(added) / STANDARD_GRAVITY_MPS2**2)
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, seed).found
    assert named(found) == {(NAME, "x")}
    assert not unnamed(found)


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3])
def test_only_where_something_turns_is_a_scale_factor_told(seed: int) -> None:
    """At rest the Earth's rate alone shows an asymmetry, and so does a wrong reference."""
    table = read(_arm_and_table(seed), seed, gyro=GYRO)
    assert table.ref_rate is not None
    at_rest = rows_of(table, np.linalg.norm(table.ref_rate, axis=1) < 1e-3)
    assert not _hardly(table, NAME)
    assert _hardly(at_rest, "scale_factor_asymmetry")


def _hardly(table: DwellTable, name: str) -> bool:
    """Whether the records hardly drive an effect on each gyro; the same on all of them."""
    b = begin(prepared(table), "gyro", DECLARED)
    mine = {i for i in range(b.library) if b.pool.blocks[i].name == name}
    found = hardly_driven(b.pool, mine)
    assert mine
    assert found in (set(), mine)
    return bool(found)
