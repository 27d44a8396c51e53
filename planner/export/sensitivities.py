"""`planner sensitivity`: signed navigation errors (interfaces, section 3), also over the flight as CSV."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, astuple, fields
from typing import Any

import numpy as np

from planner.export.csv_text import csv_text
from planner.nouns.sensitivities import Sensitivities
from planner.plan.flights_side_by_side import FlightBeside
from planner.plan.spec_to_sensitivity import SensitivityRow, sensitivity_rows
from planner.units import unit_factor

_MOST_INSTANTS = 600  # of sensitivities.csv: every second of ten minutes


def sensitivity_document(
    rows: Sequence[SensitivityRow], flights: Sequence[FlightBeside] = ()
) -> dict[str, Any]:
    """`columns`: one entry a coefficient, per one display unit of it; error = computed − true.

    `flights`, where several were flown: position error in m per display unit, all axes together, and ratio
    to the first flight's (null where the first has none).
    """
    found: dict[str, Any] = {"columns": [asdict(row) for row in rows]}
    if flights:
        found["flights"] = [_flight(f) for f in flights]
    return found


def _flight(flight: FlightBeside) -> dict[str, Any]:
    return {
        "trajectory": flight.name,
        "time_s": flight.time_s,
        "errors": [
            {
                "error": error,
                "per": flight.unit[error],
                "position_m": value * unit_factor(flight.unit[error])[0],
                "ratio": flight.ratio[error] if np.isfinite(flight.ratio[error]) else None,
            }
            for error, value in flight.per_unit.items()
        ],
    }


def over_flight_text(found: Sensitivities) -> str:
    """sensitivities.csv: the columns of `planner sensitivity --json` over the flight, instant by instant.

    At most 600 instants, evenly spread, the end among them.
    """
    last = len(found.time_s) - 1
    rows = (
        [f"{x:.9g}" if isinstance(x, float) else x for x in astuple(row)]
        for k in np.unique(np.linspace(0, last, min(last + 1, _MOST_INSTANTS)).astype(int))
        for row in sensitivity_rows(found, float(found.time_s[k]))
    )
    return csv_text([f.name for f in fields(SensitivityRow)], rows)
