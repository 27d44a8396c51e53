"""No empty success: a calibration that determined nothing is an answer, and it is no."""

from __future__ import annotations

from collections.abc import Sequence

from planner.calibrate.methods import needs_of
from planner.errors import NothingFound
from planner.nouns.calibration import Calibration

MOST_REASONS = 6


def refuse_nothing(found: Sequence[Calibration], method: str, source: str) -> None:
    """Raises NothingFound when no unit has a coefficient that its data determine, with what is needed."""
    statuses = {c.status for one in found for sensor in one.sensors for c in sensor.coefficients}
    if statuses - {"undetermined"}:
        return
    notes = [note for one in found for note in (*one.notes, *(n for s in one.sensors for n in s.notes))]
    said = [n for n in dict.fromkeys(notes) if "not calibrated" in n or "cannot tell" in n or "would" in n]
    reasons = "".join(f"\n  {note}" for note in said[:MOST_REASONS])
    raise NothingFound(
        f"{source}: --method {method} determines nothing; it needs {needs_of(method)}{reasons}"
    )
