"""Rules for `unit.noise`: where it is left out, records are long enough for what stands in to be small."""

from __future__ import annotations

import math
from itertools import groupby

from planner import catalog
from planner.nouns.sensor import ErrorName
from planner.protocols import SENSORS
from planner.spec.noise_density import USUAL
from planner.spec.review import Review
from planner.units import unit_factor

NOTABLE = 0.25  # of the square of a run-to-run spread; an estimate's sigma is then off by an eighth


def noise(sheet: Review) -> None:
    """Records that scatter by a noise of which the spec says nothing."""
    if not sheet.whole("unit"):
        return
    for name, test in sheet.spec.tests.items():
        if not sheet.whole("tests", name):
            continue
        near = sorted(e for e in map(_named, test.calibrates) if e and _comes_near(sheet, e, test.record))
        for sensor, errors in groupby(near, key=lambda e: e.sensor):
            density, unit = USUAL[sensor]
            sheet.warn(
                "P332",
                ("tests", name, "record"),
                f"is short, and unit.noise says nothing of the {sensor}. With the {density:g} "
                f"{unit}/sqrt(Hz) that records have then, one scatters by "
                f"{density / math.sqrt(test.record):.2g} {unit} beside the run-to-run of {', '.join(errors)}",
            )


def _named(text: str) -> ErrorName | None:
    """The error of this name, where there can be one."""
    sensor, _, effect = text.partition(".")
    known = catalog.effects()
    return (
        ErrorName(text) if sensor in SENSORS and effect in known and sensor in known[effect].sensors else None
    )


def _comes_near(sheet: Review, error: ErrorName, record_s: float) -> bool:
    """Whether untold noise comes near the run-to-run of an error in the sensor's own unit."""
    budget = sheet.budget(error)
    if (
        budget is None
        or not budget.has_run_to_run
        or getattr(sheet.spec.unit.noise, error.sensor) is not None
    ):
        return False
    density, unit = USUAL[error.sensor]
    if catalog.effects()[error.effect].units[error.sensor] != unit:
        return False
    table = budget.run_to_run_table
    spread = min(table.values()) if table else budget.run_to_run_largest
    return spread > 0.0 and (density * unit_factor(unit)[0]) ** 2 / record_s > NOTABLE * spread**2
