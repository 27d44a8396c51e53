"""A table that is wrong in one sense of turning is no asymmetry of three gyros; plain NumPy campaigns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.references.rate_of_each_level import sense
from planner.diagnose.references.rate_of_table import ONE_WAY
from tests.diagnose.hall import G, axes_apart, days, hidden, read
from tests.diagnose.worlds import whole


@pytest.mark.parametrize(("seed", "off"), [(11, 1e-3), (12, -2e-3)])
@pytest.mark.further(("seed", "off"), [(13, 4e-4)])
def test_a_table_that_is_fast_one_way(seed: int, off: float) -> None:
    hall = days(seed)
    wrong = (np.sum(hall.turn, axis=1) > 0.0)[:, None]
    table = read(hall, seed, felt=replace(hall, turn=hall.turn * (1.0 + off * wrong)))
    found = whole(table)
    assert [s.hypothesis for s in found.reference_suspects] == ["table_rate"]
    assert abs(found.reference_suspects[0].value) == pytest.approx(abs(off), rel=0.1)
    assert not found.effects
    assert not found.unknown


@pytest.mark.parametrize("seed", [31])
@pytest.mark.further("seed", [32, 33])
@pytest.mark.parametrize("wrong_way", [1.0, -1.0])
def test_an_arm_tells_which_way_the_table_is_wrong(seed: int, wrong_way: float) -> None:
    """Beside an arm that turns one way, a table wrong the other way was the asymmetry of three gyros."""
    hall = days(seed, 16)
    arm = (hall.run > 13) & hall.turns
    hall = replace(hall, turn=np.where(arm[:, None], 4.0 * np.abs(hall.turn), hall.turn))
    wrong = (np.sum(hall.turn, axis=1) * wrong_way > 0.0) & ~arm
    table = read(hall, seed, felt=replace(hall, turn=hall.turn * (1.0 + 1e-3 * wrong[:, None])))
    loaded = G * (hall.up + 20.0 * arm[:, None] * np.roll(hall.up, 1, axis=1))
    found = whole(replace(table, ref_acc=loaded, acc=None))
    assert [s.hypothesis for s in found.reference_suspects] == ["table_rate"]
    assert found.reference_suspects[0].value == pytest.approx(1e-3, rel=0.05)
    assert (found.effects, found.unknown) == ((), ())


def test_three_channels_that_say_alike_are_the_table_at_a_thousand_sigma() -> None:
    """Its columns are linear; three coefficients of their own take up the thousandth that they miss."""
    hall = axes_apart(100, 3)
    wrong = (np.sum(hall.turn, axis=1) > 0.0)[:, None]
    found = whole(read(hall, 100, felt=replace(hall, turn=hall.turn * (1.0 + 2e-3 * wrong))))
    assert [s.hypothesis for s in found.reference_suspects] == ["table_rate"]
    assert not found.effects


@pytest.mark.parametrize("seed", [14])
@pytest.mark.further("seed", [15])
def test_the_asymmetry_of_one_gyro_stays_its_own(seed: int) -> None:
    hall = axes_apart(seed, 4)
    found = whole(hidden(read(hall, seed), "gyro", 1, 1e-4 * np.abs(hall.rate[:, 1])))
    assert [(e.effect, e.channels) for e in found.effects] == [("scale_factor_asymmetry", ("gyro_y",))]
    assert not found.reference_suspects


def test_the_sense_is_the_table_s() -> None:
    """About up where the axis stands, whichever face of the unit that is; nothing at rest."""
    hall = axes_apart(16)
    table = read(hall, 16)
    upside = replace(table, ref_acc=-table.ref_acc) if table.ref_acc is not None else table
    here = sense(table.conditions())
    assert np.array_equal(here, np.sign(np.sum(hall.turn, axis=1)))
    assert np.array_equal(sense(upside.conditions()), -here)
    assert ONE_WAY < 0.0  # no threshold of a rate


@pytest.mark.parametrize(("seed", "off"), [(17, 3e-4), (18, -5e-4), (19, 2e-4)])
def test_a_table_that_is_off_by_a_share_that_grows_with_the_rate(seed: int, off: float) -> None:
    """Three gyros that say alike were three nonlinearities of their own."""
    hall = axes_apart(seed, 3, (-300.0, -150.0, -60.0, 60.0, 150.0, 300.0))
    share = off * np.linalg.norm(hall.turn, axis=1, keepdims=True) / 300.0
    found = whole(read(hall, seed, felt=replace(hall, turn=hall.turn * (1.0 + share))))
    (table,) = found.reference_suspects
    assert table.hypothesis == "table_rate"
    assert table.value == pytest.approx(off, rel=0.03)
    assert not found.effects
    assert not found.unknown


@pytest.mark.parametrize(("seed", "dps"), [(20, 0.02), (21, -0.03), (22, 0.01)])
def test_a_servo_that_is_off_by_as_much_at_every_rate(seed: int, dps: float) -> None:
    """What varies with the rate on three channels alike had no name; its size is the share of the slowest."""
    hall = axes_apart(seed, 3, (-300.0, -150.0, -60.0, 60.0, 150.0, 300.0))
    found = whole(read(hall, seed, felt=replace(hall, turn=hall.turn + dps * np.sign(hall.turn))))
    (table,) = found.reference_suspects
    assert table.hypothesis == "table_rate"
    assert table.value == pytest.approx(dps / 60.0, rel=0.1)
    assert not found.effects
    assert not found.unknown


@pytest.mark.parametrize("seed", [23])
@pytest.mark.further("seed", [24])
def test_the_cubic_of_one_gyro_stays_its_own(seed: int) -> None:
    hall = axes_apart(seed, 4, (-300.0, -150.0, -60.0, 60.0, 150.0, 300.0))
    found = whole(hidden(read(hall, seed), "gyro", 0, 0.03 * (hall.rate[:, 0] / 300.0) ** 3))
    assert [(e.effect, e.channels) for e in found.effects] == [("scale_factor_nonlinearity", ("gyro_x",))]
    assert not found.reference_suspects


@pytest.mark.parametrize(("seed", "off"), [(25, 2e-4), (26, -3e-4), (27, 1.5e-4)])
def test_a_drive_that_is_off_above_a_rate_turns_the_arm_as_well(seed: int, off: float) -> None:
    """Turns under load were no table's: three gyros had shapes of their own beside a table off by less."""
    hall = axes_apart(seed, 4, (-300.0, -150.0, -60.0, 60.0, 150.0, 300.0))
    wrong = np.linalg.norm(hall.turn, axis=1, keepdims=True) > 100.0
    table = replace(read(hall, seed, felt=replace(hall, turn=hall.turn * (1.0 + off * wrong))), acc=None)
    on_the_arm = (hall.day > np.median(hall.day))[:, None]
    assert table.ref_acc is not None
    inwards = np.roll(np.radians(hall.turn) ** 2, 1, axis=1) * on_the_arm  # at an arm of 1 m
    found = whole(replace(table, ref_acc=table.ref_acc + inwards))
    (drive,) = found.reference_suspects
    assert drive.hypothesis == "table_rate"
    assert drive.value == pytest.approx(off, rel=0.15)
    assert not found.effects
    assert not found.unknown
