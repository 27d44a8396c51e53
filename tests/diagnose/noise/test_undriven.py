"""Where gyros only rest, the budgets say how large scale factors and leans can be that no input drives.

Free at every temperature they took up a g-sensitivity, all but what a few power-ons of other headings told.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.channel import declared_columns
from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import begin, diagnose_sensor
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import axes_apart, hidden, read
from tests.diagnose.hypotheses.test_rests_alone import G, rests
from tests.diagnose.worlds import DECLARED, named, unnamed
from tests.specs import shipped

UNIT = shipped("small_uav").spec.unit
SCALE, LEAN = 0.005, float(np.radians(0.5))  # that unit's budgets of its gyros


def _found(table: DwellTable) -> tuple[set[tuple[str, str]], set[tuple[str, str]]]:
    found = diagnose_sensor(prepared(table, UNIT), "gyro", DECLARED, 1).found
    return named(found), unnamed(found)


def _over_temperature(seed: int) -> DwellTable:
    """Rests with a sensitivity of gyro y to its own force, of 3e-4 deg/s/g from 20 to 45 degC."""
    table = rests(seed, 0.0)
    assert table.ref_acc is not None
    return hidden(table, "gyro", 1, 3e-4 * table.ref_acc[:, 1] / G * (table.temperature_degc - 20.0) / 25.0)


@pytest.mark.parametrize("seed", [1, 3, 4])
def test_a_sensitivity_that_declared_scale_factors_took_up(seed: int) -> None:
    assert _found(_over_temperature(seed)) == ({("g_sensitivity_temperature", "y")}, set())


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4, 5, 6])
def test_scale_factors_and_leans_as_large_as_budgeted_are_no_effect(seed: int) -> None:
    table, rng = rests(seed, 0.0), np.random.default_rng([seed, 53])
    assert table.gyro is not None
    assert table.ref_rate is not None
    M = np.diag(rng.uniform(-SCALE, SCALE, 3)) + rng.uniform(-LEAN, LEAN, (3, 3)) * (1.0 - np.eye(3))
    assert _found(replace(table, gyro=table.gyro + table.ref_rate @ M.T)) == (set(), set())


def test_only_where_nothing_turns_and_only_what_has_a_budget() -> None:
    at_rest, turns = rests(1, 0.0), read(axes_apart(1), 1)
    for table, unit, bounded in ((at_rest, UNIT, True), (at_rest, None, False), (turns, UNIT, False)):
        w = begin(prepared(table, unit), "gyro", DECLARED).pool.state[0]
        c = w.channel
        effects = np.array([c.model.columns()[i].effect for i in declared_columns(c.model, c.found)])
        of_the_bias = np.isin(effects, ("bias", "bias_temperature"))
        assert (w.noise.known is not None) == bounded
        assert np.all((c.most[: len(effects)] == 0.0) == (~of_the_bias if bounded else False))
