"""When something has arrived, and how long that may take."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerances:
    """Position in deg, rate as deg/s plus a share, temperature in K.

    arrival_s, settling_s: deadlines beside what the plan and the limits ask for; settled_s: how long the air
    must stay within temperature_k before it counts; drift_k: how far it may stray later
    overtime_s: how long after a shift a step of people's may end
    """

    position_deg: float = 0.01
    rate_dps: float = 0.01
    rate_share: float = 1e-4
    arrival_s: float = 60.0
    temperature_k: float = 0.5
    settled_s: float = 30.0
    settling_s: float = 4 * 3600.0
    drift_k: float = 2.0
    overtime_s: float = 600.0
