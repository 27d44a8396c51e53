"""One axis of the table: where it is at every moment, moved with limited rate and acceleration.

The motion is a chain of pieces of constant acceleration; angles are unwound (not modulo 360).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from typing import NamedTuple

from planner.control.kinematics import Leg, braking_way, change, legs


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
        self._order(now_s, position, rate, [change(rate, rate_dps, acceleration_dps2)])

    def to_position(self, now_s: float, target_deg: float, rate_dps: float, acceleration_dps2: float) -> None:
        """Go to an angle and stay: as fast as limits allow, from any rate."""
        position, rate = self.at(now_s)
        after = target_deg - position - braking_way(rate, acceleration_dps2)
        if self.travel is None:
            after = math.remainder(after, 360.0)
        self._order(now_s, position, rate, legs(rate, after, rate_dps, acceleration_dps2))

    def seize(self, now_s: float) -> None:
        """The axis sticks where it is; orders no longer move it."""
        self._order(now_s, self.at(now_s).position_deg, 0.0, [])
        self.stuck = True

    def _order(self, now_s: float, position: float, rate: float, course: list[Leg]) -> None:
        if self.stuck:
            return
        while self.pieces[-1].start_s >= now_s:
            self.pieces.pop()
        start = now_s
        for seconds, acceleration in [*course, (math.inf, 0.0)]:
            if seconds <= 0:
                continue
            piece = Piece(start, position, rate, acceleration)
            self.pieces.append(piece)
            if seconds < math.inf:
                start += seconds
                position, rate = piece.at(start)
        self._land()

    def _land(self) -> None:
        """The last piece holds exactly: rounding would let a held axis creep over hours."""
        last = self.pieces[-1]
        if abs(last.rate_dps) < 1e-9:
            self.pieces[-1] = Piece(last.start_s, last.position_deg, 0.0, 0.0)
