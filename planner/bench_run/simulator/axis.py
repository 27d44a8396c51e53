"""One axis of the table: where it is at every moment, moved with limited rate and acceleration.

The motion is a chain of pieces of constant acceleration; angles are unwound (not modulo 360).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from typing import NamedTuple


class State(NamedTuple):
    """Angle in deg (unwound) and rate in deg/s."""

    position_deg: float
    rate_dps: float


@dataclass(frozen=True)
class Piece:
    """From `start_s` on: p + v·t + a·t²/2."""

    start_s: float
    position_deg: float
    rate_dps: float
    acceleration_dps2: float

    def at(self, time_s: float) -> State:
        """Position and rate at a time."""
        t = time_s - self.start_s
        return State(
            self.position_deg + self.rate_dps * t + 0.5 * self.acceleration_dps2 * t * t,
            self.rate_dps + self.acceleration_dps2 * t,
        )


class Axis:
    """The history of one axis; orders are given in the order of time.

    travel: (least, most) deg of an axis with stops; None: continuous, goes the shortest way.
    """

    def __init__(self, travel: tuple[float, float] | None = None) -> None:
        self.travel = travel
        self.stuck = False
        self.pieces = [Piece(-math.inf, 0.0, 0.0, 0.0)]

    def at(self, time_s: float) -> State:
        """Where the axis was, is, or will be if nothing new is ordered."""
        found = self.pieces[bisect_right(self.pieces, time_s, key=lambda piece: piece.start_s) - 1]
        return State(found.position_deg, 0.0) if found.start_s == -math.inf else found.at(time_s)

    def to_rate(self, now_s: float, rate_dps: float, acceleration_dps2: float) -> None:
        """Go over to a rate."""
        position, rate = self.at(now_s)
        self._order(now_s, position, rate, [_change(rate, rate_dps, acceleration_dps2)])

    def to_position(self, now_s: float, target_deg: float, rate_dps: float, acceleration_dps2: float) -> None:
        """Go to an angle and stay: as fast as limits allow, from any rate."""
        position, rate = self.at(now_s)
        braking = 0.5 * rate * abs(rate) / acceleration_dps2
        way = target_deg - position - braking  # what is left when the axis has braked
        if self.travel is None:
            way = math.remainder(way, 360.0)
        self._order(now_s, position, rate, _legs(rate, way + braking, way, rate_dps, acceleration_dps2))

    def seize(self, now_s: float) -> None:
        """The axis sticks where it is; orders no longer move it."""
        self._order(now_s, self.at(now_s).position_deg, 0.0, [])
        self.stuck = True

    def _order(self, now_s: float, position: float, rate: float, legs: list[tuple[float, float]]) -> None:
        if self.stuck:
            return
        while self.pieces[-1].start_s >= now_s:
            self.pieces.pop()
        start = now_s
        for seconds, acceleration in [*legs, (math.inf, 0.0)]:
            if seconds <= 0:
                continue
            piece = Piece(start, position, rate, acceleration)
            self.pieces.append(piece)
            if seconds < math.inf:
                start += seconds
                position, rate = piece.at(start)
        self._land(legs)

    def _land(self, legs: list[tuple[float, float]]) -> None:
        """The last piece holds exactly: rounding would let a held axis creep over hours."""
        last = self.pieces[-1]
        if abs(last.rate_dps) < 1e-9:
            self.pieces[-1] = Piece(last.start_s, last.position_deg, 0.0, 0.0)


def _change(rate: float, wanted: float, acceleration: float) -> tuple[float, float]:
    """Seconds and signed acceleration from one rate to another."""
    return abs(wanted - rate) / acceleration, math.copysign(acceleration, wanted - rate)


def _legs(rate: float, way: float, after: float, limit: float, a: float) -> list[tuple[float, float]]:
    """Time-optimal legs over `way` deg from `rate` to rest; `after` is what is left once braked.

    Speed up to the peak v with v² = a·way·sign + rate²/2, at most the limit, cruise, brake.
    """
    sign = 1.0 if after >= 0 else -1.0
    peak = min(math.sqrt(max(a * way * sign + 0.5 * rate * rate, 0.0)), max(limit, 0.0))
    up = _change(rate, sign * peak, a)
    down = _change(sign * peak, 0.0, a)
    moved = 0.5 * (rate + sign * peak) * up[0] + 0.5 * sign * peak * down[0]
    cruise = (way - moved) * sign / peak if peak > 0 else 0.0
    return [up, (max(cruise, 0.0), 0.0), down]
