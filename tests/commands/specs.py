"""Specs that the commands are tried on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from tests.specs import small, with_limit


def written(path: Path, spec: dict[str, Any]) -> Path:
    path.write_text(yaml.safe_dump(spec, sort_keys=False), encoding="utf-8")
    return path


def flown() -> dict[str, Any]:
    """The small spec on a simulated flight."""
    flight = {"trajectory": {"name": "level", "duration": "20 s"}, "sensitivities": "simulated"}
    return with_limit(small(), "500 m") | flight
