"""Which files a calibration leaves, and where."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from planner.export.binary_image import binary_image
from planner.export.c_header import c_header
from planner.export.calibration import calibration_text, random_text
from planner.nouns.calibration import Calibration


def calibration_files(calibrations: Sequence[Calibration], folder: Path) -> dict[Path, str | bytes]:
    """File -> content: calibration.json first, then random.json, the C header and the binary image.

    Several units have a folder each, of their name.
    """
    found: dict[Path, str | bytes] = {}
    places = unit_folders(folder, [c.unit for c in calibrations])
    for calibration, place in zip(calibrations, places, strict=True):
        found[place / "calibration.json"] = calibration_text(calibration)
        found[place / "random.json"] = random_text(calibration)
        if calibration.sensors:
            found[place / "calibration.h"] = c_header(calibration)
            found[place / "calibration.bin"] = binary_image(calibration)
    return found


def unit_folders(folder: Path, units: Sequence[str]) -> list[Path]:
    """The folder itself for one unit; for several a folder of its name for each."""
    return [folder] if len(units) == 1 else [folder / folder_name(unit) for unit in units]


def folder_name(unit: str) -> str:
    """A unit's name as a folder's."""
    return re.sub(r"[^\w.-]", "_", unit).strip(".") or "unit"
