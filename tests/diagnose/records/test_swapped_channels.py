"""Two channels of a sensor that were swapped, or one that lost its sign, in a whole power-on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.records.not_as_said import screened
from planner.errors import InputError
from tests.diagnose.hall import axes_apart, days, read
from tests.diagnose.worlds import spec


@pytest.mark.parametrize("sensor", ["gyro", "acc"])
@pytest.mark.parametrize("how", ["swapped", "sign"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_every_row_of_the_power_on_goes(seed: int, how: str, sensor: str) -> None:
    """Faces of the third axis stayed, with the bias and the leans of another channel in them.

    Rectification of two accelerometers was said of them.
    """
    hall, run = days(seed), 7 + seed
    table = read(hall, seed)
    y = getattr(table, sensor)
    there = (table.run == run)[:, None]
    turned = y[:, [2, 1, 0]] if how == "swapped" else y * [1.0, -1.0, 1.0]
    seen = screened(replace(table, **{sensor: np.where(there, turned, y)}))
    np.testing.assert_array_equal(seen.kept, table.run != run)
    assert [s.hypothesis for s in seen.suspects] == ["wrong_label"]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_one_label_that_is_wrong_takes_no_power_on_with_it(seed: int) -> None:
    hall = days(seed)
    table = read(hall, seed)
    assert table.ref_acc is not None
    i = int(np.flatnonzero(~hall.turns)[5 * seed])
    turned = table.ref_acc.copy()
    turned[i] *= -1.0
    seen = screened(replace(table, ref_acc=turned))
    np.testing.assert_array_equal(np.flatnonzero(~seen.kept), [i])


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_power_ons_between_them_that_do_not_tell_go_too(seed: int) -> None:
    """Rests do not turn: gyros that stayed swapped in them were a step of the bias of 290 sigma."""
    hall = axes_apart(seed)
    runs = np.unique(hall.run)
    table, turns = read(hall, seed), np.isin(runs, hall.run[hall.turns])
    assert table.gyro is not None
    first = int(runs[12])
    there = (table.run >= first)[:, None]
    seen = screened(replace(table, gyro=np.where(there, table.gyro[:, [1, 0, 2]], table.gyro)))
    np.testing.assert_array_equal(seen.kept[table.run < first - 1], True)
    rests = np.isin(table.run, runs[~turns])
    assert not seen.kept[rests & (table.run >= first)].any()
    assert {s.hypothesis for s in seen.suspects} == {"wrong_label"}


def test_a_table_of_which_nothing_is_left_is_refused_in_words() -> None:
    """It ended in an internal error."""
    table = read(days(1), 1)
    assert table.ref_acc is not None
    with pytest.raises(InputError, match="too few for a diagnosis"):
        diagnose(replace(table, ref_acc=table.ref_acc[:, [1, 2, 0]]), spec())
