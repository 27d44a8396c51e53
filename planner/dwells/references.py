"""What stands in for references that a table does not have: rest for the rate, |f| = g for the force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.nouns.dwell_table import DwellTable


def referenced(table: DwellTable, latitude: float | None) -> tuple[DwellTable, list[str]]:
    """The table with a rate reference, and what was assumed, in words.

    Without `ref_rate` the unit was at rest. With `ref_acc` (or without) the Earth's rate along the vertical,
    Ω sin φ, is known from the direction of gravity when the latitude (rad) is; its horizontal part needs a
    heading that nobody measured, and stays in the bias: up to 15 deg/h cos φ.
    """
    from planner.physics.earth import EARTH_RATE_RADPS

    notes: list[str] = []
    if table.ref_rate is None and table.gyro is not None:
        rate = np.zeros((len(table), 3))
        if latitude is not None and table.ref_acc is not None:
            size = np.linalg.norm(table.ref_acc, axis=1, keepdims=True)
            up = table.ref_acc / np.where(size > 0, size, 1.0)
            rate = EARTH_RATE_RADPS * np.sin(latitude) * up
            notes.append("no ref_rate: taken as at rest, with the vertical part of the Earth's rate")
        else:
            notes.append(
                "no ref_rate: taken as at rest; the Earth's rate, up to 0.0042 deg/s, is in the bias"
            )
        table = replace(table, ref_rate=rate)
    return table, notes
