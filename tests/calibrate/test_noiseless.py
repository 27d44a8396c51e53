"""Records without any noise, as another program's simulator may write them: fitted, and said to be so."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planner.calibrate.dwells_to_fit import calibrate
from planner.calibrate.fit_options import FitOptions
from tests.calibrate.test_load_tables import DEG, RATES_DPS, any_spec, coefficients, turns


@pytest.mark.parametrize("jump", [0.0, 0.01])
def test_readings_that_are_exact_give_exact_coefficients_and_a_note(jump: float) -> None:
    """jump: deg/s from power-on to power-on, which leaves the records of one without noise."""
    plain = turns(3, RATES_DPS)
    assert plain.ref_rate is not None
    offset = 0.02 + jump * (plain.run - 1.0)[:, None]
    data = replace(plain, gyro=1.001 * plain.ref_rate + offset * DEG)
    (found,) = calibrate(data, any_spec(), FitOptions("nonlinearity_polynomial"))
    for c in coefficients(found, "gyro.scale_factor"):
        assert c.value == pytest.approx(0.001, abs=1e-7)
    for c in coefficients(found, "gyro.bias"):
        assert c.value == pytest.approx(0.02 * DEG, abs=1e-6 * DEG)
    notes = [note for s in found.sensors if s.sensor == "gyro" for note in s.notes]
    assert any("no noise at all" in note for note in notes)
    assert not any("no noise at all" in note for s in found.sensors[1:] for note in s.notes)
