"""Accelerometers at 1 g with a cubic declared: the cubic is not told, and what stands beside it is right."""

from __future__ import annotations

import numpy as np
import pytest

from planner.calibrate.dwells_to_fit import fit_sensor
from planner.calibrate.fit_to_calibration import coefficients_of
from planner.dwells.table_rows import by_run
from planner.nouns.calibration import Coefficient
from tests.diagnose.hall import Noise, days, hidden, read
from tests.diagnose.worlds import DECLARED, spec

ASYMMETRY = 3e-4
ACC = Noise(1e-4, 3e-4)
EFFECTS = (*DECLARED, "scale_factor_nonlinearity", "scale_factor_asymmetry")


def _found(seed: int, axis: int) -> list[Coefficient]:
    hall = days(seed, 30)
    table = hidden(read(hall, seed, acc=ACC), "acc", axis, 0.5 * ASYMMETRY * np.abs(hall.up[:, axis]))
    (fit,) = fit_sensor(by_run(table)[0], "accelerometer", spec(), effects=EFFECTS, channels=[axis])
    return coefficients_of(fit, spec())


@pytest.mark.parametrize("seed", range(1, 7))
def test_a_cubic_that_no_record_tells_is_not_told_by_misalignments(seed: int) -> None:
    """Cubes of 0.005 g told it: 2738 +- 56 with leans of 40 deg, an asymmetry 8 sigma off beside it."""
    found = {(c.error.partition(".")[2], c.term): c for c in _found(seed, seed % 3)}
    bent = [c for (error, _), c in found.items() if error == "scale_factor_nonlinearity"]
    assert [c.status for c in bent] == ["undetermined"]
    lean = [abs(c.value) for (error, _), c in found.items() if error == "misalignment"]
    assert max(lean) < np.radians(1.0)
    (asymmetry,) = (c for (error, _), c in found.items() if error == "scale_factor_asymmetry")
    assert abs(asymmetry.value - ASYMMETRY) < 3.0 * asymmetry.standard_error
    assert asymmetry.standard_error < 1e-4
