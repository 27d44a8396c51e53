"""Records that are off by themselves, and ramps beyond the last soaked point, are no missing effect.

Campaigns of plain NumPy (tests/diagnose/labs). On these seeds claims had stood: at 16 sigma a table over the
rate of temperature that followed two struck records of ramps, at 42 a thermometer's lag that was the unit's
own curve eight kelvins beyond the table's end.
"""

from __future__ import annotations

import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import SensorFound, diagnose_sensor
from planner.diagnose.vetoes.few_records import a_few_records_explain
from tests.diagnose.labs.shapes import Hidden
from tests.diagnose.labs.unit import campaign
from tests.diagnose.worlds import DECLARED


def _claims(found: SensorFound) -> list[str]:
    return [found.found.pool.blocks[b].name for b in found.found.all]


def test_two_struck_records_of_ramps_are_no_table() -> None:
    table, _ = campaign(15018, struck=0.007)
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, 1)
    assert _claims(found) == []
    (veto,) = found.refused
    assert veto.run >= 0  # both are of one power-on
    found.found.library = [veto.block]
    assert a_few_records_explain(found.found, veto.block)


@pytest.mark.parametrize(("seed", "false"), [(15044, "thermometer_lag"), (25008, "drift_curve_temperature")])
def test_ramps_beyond_the_last_soaked_point_show_nothing(seed: int, false: str) -> None:
    table, _ = campaign(seed)
    assert false not in _claims(diagnose_sensor(prepared(table), "accelerometer", DECLARED, 1))


def test_an_effect_of_the_ramps_is_no_accident_of_records() -> None:
    """|dT/dt| at 25 sigma, in every record of every ramp: no six records hold it."""
    table, _ = campaign(25004, Hidden("ramp size", "gyro_z", 25.0))
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, 1)
    (block,) = found.found.all
    assert found.found.pool.blocks[block].columns.keys() == {2}
    assert not a_few_records_explain(found.found, block)


def test_one_face_at_rest_is_no_table_of_the_scale_factor() -> None:
    """Off at rest with one face down, at 25 sigma: a table over the input follows its −1 g."""
    table, _ = campaign(25009, Hidden("one face", "acc_z", 25.0))
    found = diagnose_sensor(prepared(table), "accelerometer", DECLARED, 1)
    assert [
        (found.found.pool.blocks[b].name, *found.found.pool.blocks[b].columns) for b in found.found.all
    ] == [("orientation", 2)]
