"""What one gyro shows at rest: north, and no azimuth of the fixture; a share of the load over temperature."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import Hall, axes_apart, days, hidden, read
from tests.diagnose.worlds import whole


def _any_north(seed: int) -> Hall:
    """The hall's rests, each with another heading of the fixture."""
    hall = axes_apart(seed, 4)
    rng = np.random.default_rng([seed, 5])
    angle = rng.uniform(0.0, 2.0 * np.pi, size=(len(hall.run), 1))
    east = np.cross(hall.north, hall.up)
    return replace(hall, north=np.cos(angle) * hall.north + np.sin(angle) * east)


def _said(found: UnitDiagnosis) -> set[str]:
    return {s.hypothesis for s in found.reference_suspects} | {e.effect for e in found.effects}


@pytest.mark.parametrize("seed", [41])
@pytest.mark.further("seed", [45, 58, 60])
def test_north_that_one_gyro_sees_is_no_azimuth(seed: int) -> None:
    """It was an azimuth of all three, and a scale factor that changes after power-on by its rests alone."""
    hall = _any_north(seed)
    still = ~hall.turns
    found = whole(hidden(read(hall, seed), "gyro", seed % 3, 1.2e-3 * still * hall.north[:, seed % 3]))
    assert not _said(found)
    assert {u.varies_with for u in found.unknown} == {"orientation"}


@pytest.mark.parametrize("seed", [46, 47])
@pytest.mark.further("seed", [48])
def test_an_azimuth_that_all_three_see_stays_one(seed: int) -> None:
    hall = _any_north(seed)
    east = np.cross(hall.north, hall.up)
    off = np.cos(1.0) * hall.north + np.sin(1.0) * east
    found = whole(read(hall, seed, felt=replace(hall, north=off)))
    assert _said(found) == {"azimuth"}


def _growing(seed: int, size: float, power: int) -> DwellTable:
    hall = days(seed)
    x = (hall.temperature - 5.0) / 50.0
    return hidden(read(hall, seed), "gyro", 1, size * hall.up[:, 2] * x**power)


@pytest.mark.parametrize("seed", [47])
@pytest.mark.further("seed", [48, 53, 54, 59])
def test_a_faint_load_s_share_may_go_with_temperature_squared(seed: int) -> None:
    """It was a g-sensitivity of one size, of 6 to 9 sigma, whose rivals did not have the temperature."""
    found = whole(_growing(seed, 3e-4, 2))
    said = {r.effect for e in found.effects for r in e.rivals} | {u.varies_with for u in found.unknown}
    assert "temperature" in said


@pytest.mark.parametrize("seed", [51])
@pytest.mark.further("seed", [52, 53, 54])
def test_a_strong_load_s_share_is_one_at_every_temperature(seed: int) -> None:
    found = whole(_growing(seed, 1.5e-3, 0))
    (effect,) = found.effects
    assert effect.effect == "g_sensitivity"
    assert "temperature" not in {r.effect for r in effect.rivals}
