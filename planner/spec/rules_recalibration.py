"""Rules for `recalibration`: what cannot be done by hand, and what would carry nothing."""

from __future__ import annotations

from planner.quantities import DAY_S
from planner.spec.review import Review

FASTEST_TURN_DPS = 360.0  # nobody turns a unit by hand faster and stops at a mark
COARSEST_DEG = 5.0


def recalibration(sheet: Review) -> None:
    """All rules for `recalibration`."""
    asked = sheet.spec.recalibration
    if asked is None:
        return
    if 360.0 / asked.turn > FASTEST_TURN_DPS:
        sheet.fault("P371", ("recalibration", "turn"), "is faster than a hand turns a unit; write e.g. 20 s")
    if asked.period < DAY_S:
        sheet.fault("P372", ("recalibration", "period"), "is shorter than a day; write e.g. 365 d")
    if not 600.0 <= asked.working_day <= DAY_S:
        sheet.fault("P373", ("recalibration", "working_day"), "is no working day; write e.g. 8 h")
    for key, angle in (("level", asked.level), ("angle_error", asked.angle_error)):
        if angle > COARSEST_DEG * 0.017453292519943295:
            sheet.fault(
                "P374",
                ("recalibration", key),
                f"is more than {COARSEST_DEG:g} deg; nothing could be renewed so",
            )
    stored = [b for _, _, _, b in sheet.budgets() if b.storage_sigma > 0]
    if not stored:
        message = "no error of the unit has 'storage', so without a history nothing ever needs it"
        sheet.warn("P375", ("recalibration",), message, key=True)
