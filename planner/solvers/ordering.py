"""In which order to visit points on a line, starting and ending at one place."""

from __future__ import annotations

from collections.abc import Sequence


def sweep(points: Sequence[float]) -> tuple[float, ...]:
    """The order that takes least travel from a home through all points and back, exactly, for every home.

    A closed tour crosses every stretch between the lowest and the highest place (home included) at least once
    upwards and once downwards, whatever the two speeds are. Going to the lowest point first and then upwards
    crosses each exactly once each way, so it is optimal. Among the optimal orders this one visits the points
    in one direction only, which also keeps temperature hysteresis out of the records.
    """
    return tuple(sorted(points))


def travel_time(order: Sequence[float], home: float, up: float | None, down: float | None) -> float:
    """Time of home → order → home at speeds `up` and `down` (None: no time), in units of 1/speed."""
    places = [home, *order, home]
    total = 0.0
    for a, b in zip(places, places[1:], strict=False):
        speed = up if b > a else down
        total += abs(b - a) / speed if speed else 0.0
    return total
