"""When something has arrived, how long that may take, and what makes a record void."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerances:
    """Position in deg, rate as deg/s plus a share, temperature in K, times in s.

    arrival_s, settling_s: deadlines beside what the plan and the limits ask for; settled_s: how long the air
    must stay within temperature_k before it counts; drift_k: how far it may stray later; frozen_s: how long
    its reading may stand still on the way
    beyond_k: how far beyond the chamber's range a reading can be; jump_k: how far it can go at once, beside
    ten times what the chamber can do
    overtime_s: how long after a shift a step of people's may end
    overlong_s, overlong_share: how much longer than planned a record may last; voids: how often one may be
    made in vain; reconnect_s: how long a connection that dropped is looked for
    """

    position_deg: float = 0.01
    rate_dps: float = 0.01
    rate_share: float = 1e-4
    arrival_s: float = 60.0
    temperature_k: float = 0.5
    settled_s: float = 30.0
    settling_s: float = 4 * 3600.0
    drift_k: float = 2.0
    frozen_s: float = 1200.0
    beyond_k: float = 30.0
    jump_k: float = 5.0
    overtime_s: float = 600.0
    overlong_s: float = 10.0
    overlong_share: float = 0.02
    voids: int = 5
    reconnect_s: float = 600.0
