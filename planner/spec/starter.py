"""The spec that `planner init` writes."""

from __future__ import annotations

from importlib.resources import files


def starter_text() -> str:
    """A commented spec that plans as it stands: a small UAV, one rate table with a chamber."""
    return files("planner.spec").joinpath("starter.yaml").read_text(encoding="utf-8")
