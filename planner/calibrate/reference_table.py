"""A dwell table with the references that it lacks: |f| = g for the accelerometers, rest for the gyros."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.calibrate.correction import true_input
from planner.calibrate.rest_methods import accelerometers_by_free_orientations
from planner.dwells.references import referenced
from planner.nouns.calibration import SensorCalibration
from planner.nouns.dwell_table import DwellTable
from planner.units import STANDARD_GRAVITY_MPS2


def with_references(table: DwellTable) -> DwellTable:
    """The table with `ref_acc` and `ref_rate`, those of the file where it has them.

    Missing ref_acc: the direction of the calibrated accelerometers with the length of g; missing ref_rate:
    at rest. Raises InputError when the accelerometers read no gravity.
    """
    if table.ref_acc is None and table.acc is not None:
        table, _ = with_gravity(table)
    return referenced(table, None)[0]


def with_gravity(table: DwellTable) -> tuple[DwellTable, SensorCalibration]:
    """The table with `ref_acc`: the direction of its accelerometers as calibrated by |f| = g, and these."""
    assert table.acc is not None  # asked by the caller
    free = accelerometers_by_free_orientations(table)
    f = true_input(table.acc, free.tables, "accelerometer", table.conditions())
    size = np.linalg.norm(f, axis=1, keepdims=True)
    return replace(table, ref_acc=f * STANDARD_GRAVITY_MPS2 / np.where(size > 0, size, 1.0)), free
