"""What a reading can be: temperatures that a chamber can have come to, angles that follow their rate."""

from __future__ import annotations

import math

from planner.bench_run.tolerances import Tolerances
from planner.nouns.bench import ChamberFacts

SLOWEST_K_PER_MIN = 2.0  # where the plan knows no speed of the chamber
LEAST_WAY_DEG = 5.0  # how far an axis should turn between two looks that compare its angle with its rate
SHORTEST_S, LONGEST_S = 0.2, 10.0


class Air:
    """What the chamber's air has read so far, and what it can read next."""

    def __init__(self, facts: ChamberFacts, room_degc: float, tolerances: Tolerances) -> None:
        self._facts, self._room, self._within = facts, room_degc, tolerances
        self._last: tuple[float, float] | None = None

    def accepted(self, now: float, degc: float) -> float:
        """The reading. Raises ValueError for one that the air cannot have at this time."""
        low = min(self._facts.coldest_degc, self._room) - self._within.beyond_k
        high = max(self._facts.hottest_degc, self._room) + self._within.beyond_k
        if not low <= degc <= high:  # NaN too
            raise ValueError(f"{degc:g} degC is beyond what the chamber can have")
        if self._last is not None:
            then, before = self._last
            if abs(degc - before) > self._within.jump_k + 10 * self._speed() * max(now - then, 0.0):
                raise ValueError(f"from {before:g} to {degc:g} degC in {now - then:.0f} s is a jump")
        self._last = now, degc
        return degc

    def forget(self) -> None:
        """What was read last is not believed: the next reading cannot be a jump from it."""
        self._last = None

    def _speed(self) -> float:
        """K/s. Ten times of it are allowed: a plan may be careful about its chamber."""
        known = self._facts.heating_k_per_min or 0.0, self._facts.cooling_k_per_min or 0.0
        return max(*known, SLOWEST_K_PER_MIN) / 60.0


def comparing_s(rate_dps: float) -> float:
    """How long to wait between two looks at the angle of an axis that turns."""
    return min(max(LEAST_WAY_DEG / abs(rate_dps), SHORTEST_S), LONGEST_S)


def contradiction(
    first_deg: float, second_deg: float, rate_dps: float, seconds: float, unsure_s: float
) -> str:
    """What two looks at an angle say against its rate; empty when they fit, or cannot tell.

    seconds: between the looks; unsure_s: how long they took themselves
    """
    way = rate_dps * seconds
    allowed = 0.05 + 0.2 * abs(way) + abs(rate_dps) * unsure_s
    if abs(math.remainder(second_deg - first_deg - way, 360.0)) <= allowed:
        return ""
    if allowed >= 180.0:
        return ""
    if first_deg == second_deg:
        return f"its angle stays at {first_deg:g} deg: a frozen reading"
    return f"its angle went from {first_deg:g} to {second_deg:g} deg in {seconds:.2f} s"
