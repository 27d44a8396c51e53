"""Columns that tell power-ons apart are no explanation of their spread where few power-ons are left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import catalog
from planner.diagnose.channels.channel import channel
from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.candidates import library_blocks
from planner.diagnose.hypotheses.found import Found
from planner.diagnose.noise.channel_noise import Readings, plain_readings
from planner.diagnose.search.borne_by_triad import borne_by_triad
from planner.diagnose.search.hidden_columns import with_what_hides
from planner.diagnose.search.sensor import begin, diagnose_sensor
from planner.diagnose.shapes.generic import variable_of
from planner.dwells.table_rows import rows_of
from tests.diagnose.hall import Noise, days, hidden, read
from tests.diagnose.search.test_leans_at_rest_and_loaded import UNIT, rests_and_loads
from tests.diagnose.worlds import DECLARED


@pytest.mark.parametrize("seed", [371, 372, 373])
@pytest.mark.further("seed", [374, 375, 376])
def test_the_spread_of_thirteen_power_ons_is_judged_no_smaller_than_it_may_be(seed: int) -> None:
    """Waves, days and benches took all of it, and noise was said to go with the days at 7 to 15 sigma."""
    level = 3e-3
    table = replace(read(days(seed, 13), seed, Noise(4e-4, level)), acc=None)
    for w in begin(prepared(table), "gyro", DECLARED).pool.state.values():
        at = w.noise.components.index("run_to_run_bias")
        assert np.degrees(np.sqrt(w.noise.variances.theta[at])) > 0.4 * level


@pytest.mark.parametrize("seed", [387, 388, 389])
@pytest.mark.further("seed", [381, 382, 392])
def test_what_changes_within_power_ons_is_told_however_few_of_them_there_are(seed: int) -> None:
    """Half of each is on a ramp: what lies between power-ons was asked to tell all that half says."""
    hall = days(seed, 13)
    place = np.arange(len(hall.run)) - np.searchsorted(hall.run, hall.run)
    hall = replace(hall, ramp=np.where(place < 9, np.array([2.0, -2.0, 0.0])[hall.run % 3], 0.0))
    data = prepared(hidden(read(hall, seed), "gyro", 0, 1.5e-4 * hall.ramp))
    table = data.table
    assert table.gyro is not None
    c = channel("gyro", 0, table.conditions(), table.gyro[:, 0], DECLARED, ())
    ramp = [b for b in library_blocks([c], table, DECLARED, "gyro") if b.name == "temperature_rate"]
    nothing = Readings(c, data.starts, table.duration, (), np.ones(len(c.r)))
    assert with_what_hides(nothing, ramp)[0].candidates.shape[1] == 1


@pytest.mark.parametrize("seed", [2, 5])
@pytest.mark.further("seed", [1, 3, 4])
def test_what_hides_in_a_spread_that_has_a_budget_is_told_by_four_power_ons(seed: int) -> None:
    """Two either way on an arm: an asymmetry of thirteen sigma was a scale factor that scatters."""
    found = _under_load(seed, asymmetry=1e-4)
    (b,) = found.library
    assert (found.pool.blocks[b].name, found.axes(b)) == ("scale_factor_asymmetry", {2})


@pytest.mark.parametrize("seed", [11, 12])
@pytest.mark.further("seed", range(13, 23))
def test_a_unit_that_draws_three_budgets_has_no_effect_by_them(seed: int) -> None:
    assert not _under_load(seed, times=3.0).all


def _under_load(seed: int, asymmetry: float = 0.0, times: float = 0.0) -> Found:
    """What is found on accelerometers: six power-ons at rest, twelve on an arm, of which four load each axis.

    times: the budget, by which their scale factors are drawn as well
    """
    table = rests_and_loads(seed)
    table = rows_of(table, table.run >= 34)
    assert table.acc is not None
    assert table.ref_acc is not None
    acc = table.acc.copy()
    acc[:, 2] += asymmetry * np.abs(table.ref_acc[:, 2])
    budget = UNIT.accelerometer["scale_factor"].run_to_run_largest
    drawn = np.random.default_rng([seed, 9]).normal(size=(table.run.max() + 1, 3))
    acc += times * budget * drawn[table.run] * table.ref_acc
    return diagnose_sensor(prepared(replace(table, acc=acc), UNIT), "accelerometer", DECLARED, 1).found


def test_a_triad_of_one_kind_of_noise_has_no_more_columns_to_bear() -> None:
    """Where another channel leans or wanders, one with nothing hidden is judged anew: twice, and alike."""
    data = prepared(read(days(387, 13), 387))
    table = data.table
    assert table.gyro is not None
    ones = np.ones(len(table))
    mine = [channel("gyro", a, table.conditions(), table.gyro[:, a], DECLARED, ()) for a in range(3)]
    before, after = ([plain_readings(c, data.starts, table.duration, ones) for c in mine] for _ in range(2))
    found = borne_by_triad(before, after)
    assert all(r is b or r is a for r, b, a in zip(found, before, after, strict=True))


@pytest.mark.parametrize(("sensor", "variable"), [("gyro", "rate"), ("accelerometer", "specific_force")])
def test_products_of_inputs_go_with_the_input_of_their_sensor(sensor, variable) -> None:
    """What a gyro's coupling leaves was asked along the load: a rest over the rate stood beside it."""
    assert variable_of(catalog.effects()["cross_coupling"], sensor) == variable
