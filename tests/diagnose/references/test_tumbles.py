"""The Earth's rate that the reference of a tumble lacks: the bench's, and no g-sensitivity of every gyro."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.references.tumbles import tumbling_axis, without_north
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import axes_apart, hidden, read, tumbles
from tests.diagnose.worlds import whole


def _without_earth(seed: int, azimuth: float = 0.4) -> DwellTable:
    """Felt as it is, and a reference that knows the table's turns alone."""
    hall = tumbles(seed, azimuth=azimuth)
    return replace(read(hall, seed), ref_rate=np.radians(hall.turn))


def _resting(seed: int) -> DwellTable:
    """A world that does not turn: neither the unit nor its reference has anything of the Earth's rate."""
    hall = tumbles(seed)
    table = read(hall, seed)
    assert table.ref_rate is not None
    assert table.gyro is not None
    earth = table.ref_rate - np.radians(hall.turn)
    return replace(table, ref_rate=table.ref_rate - earth, gyro=table.gyro - earth)


@pytest.mark.parametrize(("seed", "azimuth"), [(1, 0.4), (3, -1.3), (5, 1.57)])
@pytest.mark.further(("seed", "azimuth"), [(2, 2.0), (4, 0.0)])
def test_the_earth_s_rate_that_tumbles_lack_is_named_with_its_size(seed: int, azimuth: float) -> None:
    """It was a g-sensitivity of all three gyros, which no calibration of another bench would have again."""
    found = whole(_without_earth(seed, azimuth))
    assert not found.effects
    assert not found.unknown
    (suspect,) = found.reference_suspects
    assert suspect.hypothesis == "earth_rate"
    assert suspect.low < 15.04 < suspect.high
    assert suspect.unit == "deg/h"


@pytest.mark.parametrize("seed", [11])
@pytest.mark.further("seed", [12, 13])
def test_g_sensitivities_in_tumbles_are_the_gyros(seed: int) -> None:
    table, rng = _resting(seed), np.random.default_rng(seed)
    assert table.ref_acc is not None
    up = table.ref_acc / 9.80665
    for axis in range(3):
        table = hidden(table, "gyro", axis, 2.5e-3 * up @ rng.normal(size=3))
    found = whole(table)
    assert not found.reference_suspects
    assert {e.effect for e in found.effects} == {"g_sensitivity"}
    assert {c for e in found.effects for c in e.channels} == {"gyro_x", "gyro_y", "gyro_z"}


@pytest.mark.parametrize("seed", [21])
@pytest.mark.further("seed", [22])
def test_nothing_is_missing_where_no_earth_is_felt(seed: int) -> None:
    found = whole(_resting(seed))
    assert not found.effects
    assert not found.reference_suspects


def test_a_tumble_is_known_by_its_plane() -> None:
    around, cubes = tumbles(1), axes_apart(1)
    table = _without_earth(1)
    axis = tumbling_axis(table.conditions(), table.run)
    rests = ~around.turns
    np.testing.assert_allclose(np.abs(axis[rests]).max(axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(np.sum(axis * around.up, axis=1)[rests], 0.0, atol=1e-12)
    assert not axis[~rests].any()
    faces = replace(read(cubes, 1), ref_rate=np.radians(cubes.turn))
    assert not tumbling_axis(faces.conditions(), faces.run).any()
    assert without_north(table)
    assert not without_north(faces)
    assert not without_north(read(around, 1))  # whose reference has north
