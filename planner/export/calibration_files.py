"""Which files a calibration leaves, and where."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from planner.calibration import Calibration
from planner.export.binary_image import binary_image
from planner.export.c_header import c_header
from planner.export.calibration import calibration_text, random_text


def calibration_files(calibrations: Sequence[Calibration], folder: Path) -> dict[Path, str | bytes]:
    """File -> content: calibration.json first, then random.json, the C header and the binary image.

    Several units have a folder each, of their name.
    """
    found: dict[Path, str | bytes] = {}
    for calibration in calibrations:
        place = folder if len(calibrations) == 1 else folder / folder_name(calibration.unit)
        found[place / "calibration.json"] = calibration_text(calibration)
        found[place / "random.json"] = random_text(calibration)
        if calibration.sensors:
            found[place / "calibration.h"] = c_header(calibration)
            found[place / "calibration.bin"] = binary_image(calibration)
    return found


def folder_name(unit: str) -> str:
    """A unit's name as a folder's."""
    return re.sub(r"[^\w.-]", "_", unit).strip(".") or "unit"
