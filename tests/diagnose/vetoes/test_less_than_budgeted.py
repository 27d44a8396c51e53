"""What drifts by less than the spec lets wander within a power-on, in records that do not wander."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.nouns.diagnosis import UnitDiagnosis
from tests.diagnose.hall import Noise, days, hidden, read
from tests.specs import shipped

SPEC = shipped("small_uav").spec  # whose accelerometers wander by 0.5 mg within a power-on
QUIET = Noise(1e-5, 6e-4)
SIZE = 4e-5  # g in 1000 s, four times the noise of a record


def diagnosed(seed: int, within: float, size: float) -> UnitDiagnosis:
    """Of nine power-ons at seven temperatures: they tell no spread, and the calibration takes the spec's."""
    hall = days(seed, 9)
    hall = replace(hall, temperature=hall.temperature % 0.5 + 18.0 * (hall.run % 7) - 50.0)
    table = read(hall, seed, acc=replace(QUIET, within=within))
    table = hidden(table, "accelerometer", seed % 3, size * hall.time_on / 1000.0)
    return diagnose(replace(table, gyro=None), SPEC)


@pytest.mark.parametrize("seed", [97101, 97102])
@pytest.mark.further("seed", [97104])
def test_a_drift_that_the_records_tell_keeps_its_name(seed: int) -> None:
    """Refused at 15 sigma: the fit counts the budget as noise of every record, "each interval holds zero"."""
    found = diagnosed(seed, 0.0, SIZE)
    (effect,) = found.effects
    assert (effect.effect, effect.channels) == ("drift", (f"accelerometer_{'xyz'[seed % 3]}",))
    (term,) = effect.terms
    assert term.low < 9.80665 * SIZE / 1000.0 < term.high
    assert any("more drift within a power-on" in note for note in found.notes)


@pytest.mark.parametrize("seed", [97111, 97112])
def test_records_that_wander_name_no_drift(seed: int) -> None:
    assert not diagnosed(seed, 1e-4, 0.0).effects
