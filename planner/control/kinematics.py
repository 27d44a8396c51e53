"""How an axis moves at its limits of rate and acceleration: in legs of constant acceleration, in least time.

Angles in deg, rates in deg/s, accelerations in deg/s², times in s.
"""

from __future__ import annotations

import math

from planner.control.orders import AxisOrder
from planner.nouns.bench import BenchFacts

Leg = tuple[float, float]  # seconds, signed acceleration


def change(rate: float, wanted: float, acceleration: float) -> Leg:
    """From one rate to another."""
    return abs(wanted - rate) / acceleration, math.copysign(acceleration, wanted - rate)


def braking_way(rate: float, acceleration: float) -> float:
    """What the axis still turns while it comes to rest, v |v| / 2a."""
    return 0.5 * rate * abs(rate) / acceleration


def legs(rate: float, after: float, limit: float, acceleration: float) -> list[Leg]:
    """From `rate` to rest at an angle that is `after` deg beyond where the axis would stop if it braked now.

    Speed up to the peak v with v² = a·way·sign + rate²/2, at most the limit, cruise, brake.
    """
    way = after + braking_way(rate, acceleration)
    sign = 1.0 if after >= 0 else -1.0
    peak = min(math.sqrt(max(acceleration * way * sign + 0.5 * rate * rate, 0.0)), max(limit, 0.0))
    up = change(rate, sign * peak, acceleration)
    down = change(sign * peak, 0.0, acceleration)
    moved = 0.5 * (rate + sign * peak) * up[0] + 0.5 * sign * peak * down[0]
    cruise = (way - moved) * sign / peak if peak > 0 else 0.0
    return [up, (max(cruise, 0.0), 0.0), down]


def turn_s(way: float, bench: BenchFacts, acceleration: float) -> float:
    """Seconds from rest to rest over `way` deg."""
    return sum(seconds for seconds, _ in legs(0.0, way, bench.rate_dps or math.inf, acceleration))


def move_s(start: AxisOrder | None, order: AxisOrder, bench: BenchFacts, acceleration: float) -> float:
    """Seconds from what an axis was told to what it is told now; start: None where nobody knows, at rest.

    From an unknown place it is half a turn to a position, or all of its travel.
    """
    turning = start.value if start is not None and start.mode == "rate" else 0.0
    if order.mode == "rate":
        return change(turning, order.value, acceleration)[0]
    held = start.value if start is not None and start.mode == "position" else None
    return change(turning, 0.0, acceleration)[0] + turn_s(_way(held, order, bench), bench, acceleration)


def _way(held: float | None, order: AxisOrder, bench: BenchFacts) -> float:
    """Degrees to a position: straight between stops, else the shortest way."""
    if order.axis in bench.travel:
        least, most = bench.travel[order.axis]
        return most - least if held is None else abs(order.value - held)
    return 180.0 if held is None else abs(math.remainder(order.value - held, 360.0))
