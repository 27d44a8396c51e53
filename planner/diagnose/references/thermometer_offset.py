"""A thermometer that is off by a constant: no record of one table tells it.

    y = b(T_unit) = b(T_read − δ),   which the declared curves fit for every δ

They are tables, or coefficients about a temperature of their own, fitted to the very readings that are off; a
flight whose thermometer is another one meets them δ away. A lag shows on ramps, an offset nowhere.
"""

from __future__ import annotations

from planner import catalog
from planner.nouns.diagnosis import Untestable
from planner.spec.model import Spec

NAME = "thermometer_offset"
RECORD = "the same records beside a second thermometer at the unit's own place"
WHY = (
    "a thermometer that reads a constant too much looks like declared curves that lie so much further along "
    f"the temperature; {RECORD} would tell"
)


def untold_offset(spec: Spec) -> list[Untestable]:
    """That these records do not tell such an offset, where anything declared goes with temperature."""
    known = catalog.effects()
    curved = any("temperature_degc" in known[name].needs for name in spec.effects if name in known)
    return [Untestable(NAME, None, WHY)] if curved else []
