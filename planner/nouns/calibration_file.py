"""The one way into a calibration.json: its tree, or what is wrong with the file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from planner.errors import InputError, unusable_file
from planner.nouns.given_files import CALIBRATION


def calibration_tree(path: Path) -> tuple[Path, Any]:
    """The file, in a folder where that was given, and its tree. Raises InputError for what holds no JSON."""
    file = path / "calibration.json" if path.is_dir() else path
    try:
        data = file.read_bytes()
    except OSError as error:
        raise unusable_file(file, error, CALIBRATION) from error
    try:
        return file, json.loads(data)
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise unusable_file(file, "is no calibration.json" if data else "is empty", CALIBRATION) from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file} is no calibration.json of planner: {error!r}") from error
