"""How to calibrate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from planner.campaign.estimate import Robust
from planner.nouns.calibration import Tables
from planner.protocols import Sensor

DECLARED = "declared_effects"
SINS_OUTPUTS = "sins_outputs"  # the same effects, readings out of a navigation log


@dataclass(frozen=True)
class FitOptions:
    """method: `declared_effects` fits the spec's effects, others are named in `methods`.

    robust: weights that resist outliers; latitude: of the bench, rad
    prior: an old calibration that the data renew; nodes: of smooth tables, None: every 5 K and four
        times between visits, 33 at most
    turn: rad, by which a cube was turned, None: by the multiple of 90 deg that is nearest to the reading
    """

    method: str = DECLARED
    robust: Robust = "no"
    latitude: float | None = None
    prior: Mapping[Sensor, Tables] | None = None
    nodes: int | None = None
    turn: float | None = None
