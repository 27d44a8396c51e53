"""How to calibrate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Robust = Literal["no", "huber", "bisquare"]
DECLARED = "declared_effects"


@dataclass(frozen=True)
class FitOptions:
    """method: `declared_effects` fits the spec's effects, others are named in `methods`.

    robust: weights that resist outliers; latitude: of the bench, rad
    """

    method: str = DECLARED
    robust: Robust = "no"
    latitude: float | None = None
