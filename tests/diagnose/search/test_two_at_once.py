"""Two effects at once are told as surely as each by itself, and so is one beside a fault of the bench.

Campaigns of plain NumPy.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.nouns.diagnosis import UnitDiagnosis
from planner.pipelines.data import simulate
from planner.simulate.settings import settings_of
from tests.diagnose.hall import G, Hall, axes_apart, days, hidden, read
from tests.diagnose.labs.unit import campaign
from tests.specs import shipped

SPEC = shipped("small_uav").spec


def _named(found: UnitDiagnosis) -> set[tuple[str, str]]:
    return {(e.effect, c) for e in found.effects for c in e.channels}


@pytest.mark.parametrize("seed", [41])
@pytest.mark.further("seed", [42, 43])
def test_power_ons_that_another_effect_moves_agree_on_this_one(seed: int) -> None:
    """An asymmetry of 23 sigma "differed between the power-ons" by what a g-sensitivity makes of each."""
    table, _ = campaign(seed)
    conditions = table.conditions()
    rate, force = np.degrees(conditions.rate), conditions.specific_force / G
    share = np.array([2e-2, -3e-2, 4e-2]) / np.abs(rate).max()
    for axis in range(3):
        own = 6e-3 * force[:, (axis + 1) % 3] + share[axis] * np.abs(rate[:, axis])
        table = hidden(table, "gyro", axis, own)
    found = diagnose(table, SPEC)
    axes = ("gyro_x", "gyro_y", "gyro_z")
    assert _named(found) == {(e, c) for e in ("g_sensitivity", "scale_factor_asymmetry") for c in axes}
    assert not found.unknown
    assert not found.reference_suspects


@pytest.mark.parametrize("seed", [21, 22])
@pytest.mark.further("seed", [23, 24])
def test_what_another_sensor_lacks_hides_nothing_of_this_one(seed: int) -> None:
    """On an arm a gyro's cubic is nearly its scale factor over the load, which an accelerometer lacks."""
    table, _ = campaign(seed)
    conditions = table.conditions()
    rate, force = np.degrees(conditions.rate[:, 0]), conditions.specific_force[:, 2] / G
    table = hidden(table, "gyro", 0, 0.06 * (rate / np.abs(rate).max()) ** 3)
    table = hidden(table, "acc", 2, 1.5e-2 * np.abs(force) * force / np.abs(force).max() ** 2)
    gyro, acc = "scale_factor_nonlinearity", "scale_factor_acceleration"
    assert _named(diagnose(table, SPEC)) == {(gyro, "gyro_x"), (acc, "accelerometer_z")}


@pytest.mark.parametrize("share", [1.5e-3, -8e-4])
@pytest.mark.parametrize("seed", [31, 32])
@pytest.mark.further("seed", [33, 34])
def test_one_gyro_drifts_on_a_table_of_which_one_level_is_off(seed: int, share: float) -> None:
    """The drift was held for what the table's hypothesis misses, and the level was 1.4 times as far off."""
    hall = axes_apart(seed, 3, turns=(-300.0, -150.0, -75.0, 75.0, 150.0, 300.0))
    level = np.abs(np.linalg.norm(hall.turn, axis=1) - 150.0) < 1.0
    felt = replace(hall, turn=hall.turn * (1.0 + share * level[:, None]))
    table = hidden(read(hall, seed, felt=felt), "gyro", 1, 3e-2 * hall.time_on / 3600.0)
    found = diagnose(table, SPEC)
    assert _named(found) == {("drift", "gyro_y")}
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == "table_rate"
    assert suspect.low <= share <= suspect.high
    assert suspect.high - suspect.low < 0.2 * abs(share)


def _skew(hall: Hall) -> Hall:
    """The faster turns are about axes half way between two of the body's."""
    slow = np.abs(np.linalg.norm(hall.turn, axis=1) - 45.0) < 1.0
    between = (hall.up + np.roll(hall.up, 1, axis=1)) / np.sqrt(2.0)
    up = np.where((hall.turns & ~slow)[:, None], between, hall.up)
    north = np.cross(up, np.roll(up, 1, axis=1) + np.array([0.1, 0.2, 0.3]))
    turn = np.sum(hall.turn * hall.up, axis=1, keepdims=True) * up
    return replace(hall, up=up, north=north / np.linalg.norm(north, axis=1, keepdims=True), turn=turn)


@pytest.mark.parametrize("seed", [51])
@pytest.mark.further("seed", [52, 53])
def test_two_curves_over_one_force_are_no_products(seed: int) -> None:
    """|f| and |f| f were a cross-coupling of 47 sigma, of which three products had to agree."""
    hall = _skew(days(seed, 12))
    f = hall.up[:, 0]
    found = diagnose(hidden(read(hall, seed), "acc", 0, 4e-4 * np.abs(f) - 6e-4 * np.abs(f) * f), SPEC)
    assert "cross_coupling" not in {e.effect for e in found.effects}
    seen = {c for e in found.effects for c in e.channels} | {c for u in found.unknown for c in u.channels}
    assert seen == {"accelerometer_x"}


@pytest.mark.parametrize("seed", [51])
@pytest.mark.further("seed", [52, 53])
def test_products_of_which_several_are_there_keep_their_name(seed: int) -> None:
    hall = _skew(days(seed, 12))
    x, y, z = hall.up.T
    table = hidden(read(hall, seed), "acc", 0, 4e-4 * x**2 + 4e-4 * x * y - 3e-4 * y * z)
    assert _named(diagnose(table, SPEC)) == {("cross_coupling", "accelerometer_x")}


@pytest.mark.parametrize("seed", [3])
@pytest.mark.further("seed", [1, 4])
def test_names_of_all_channels_give_way_together(seed: int) -> None:
    """Each of three cross-couplings stood for an asymmetry, since the other two had one."""
    unit = shipped("small_uav")
    both = ("gyro.g_sensitivity=0.02 deg/s/g", "gyro.scale_factor_asymmetry=0.05 %")
    table, _ = simulate(unit, None, both, seed, settings_of(unit.spec))
    axes = ("gyro_x", "gyro_y", "gyro_z")
    expected = {(e, c) for e in ("g_sensitivity", "scale_factor_asymmetry") for c in axes}
    assert _named(diagnose(table, SPEC)) == expected
