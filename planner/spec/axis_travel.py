"""Axes with stops: the same attitude between them, and turning that would run into them.

An axis without stops turns on and on and takes the shortest way to a position, so it is nowhere limited. An
axis with stops goes straight from where it stands; a rate takes it from there by rate · time and the way of
braking, rate²/(2 acceleration). Angles in deg, rates in deg/s; times in s.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol, TypeVar

Stops = tuple[float, float]

STOPPING = ("move", "install", "remove", "power_off")  # steps before which whatever turns is brought to rest


class Moving(Protocol):
    """What is asked of a step: planner.nouns.Step, or the step of plan.json."""

    @property
    def action(self) -> str:
        """What is done."""
        ...

    @property
    def start_s(self) -> float:
        """When it begins."""
        ...

    @property
    def end_s(self) -> float:
        """When it ends."""
        ...

    @property
    def motion(self) -> Mapping[str, float] | None:
        """Axis -> deg, deg/s or g."""
        ...


StepKind = TypeVar("StepKind", bound=Moving)


def same_attitude(angle: float, stops: Stops) -> float | None:
    """The angle, else one that differs by whole turns and lies between the stops, else None."""
    least, most = stops
    if least <= angle <= most:
        return angle
    same = angle + 360.0 * math.ceil((least - angle) / 360.0 - 1e-12)
    return same if same <= most else None


def reduced(angle: float) -> float:
    """What an axis without stops is told: beyond one turn the same attitude within it."""
    return angle if abs(angle) <= 360.0 else math.fmod(angle, 360.0) + 0.0


def travel_faults(
    steps: Sequence[StepKind], travel: Mapping[int, Stops], acceleration: float | None
) -> Iterator[tuple[StepKind, str]]:
    """(step, what is wrong) of one bench's steps, in the order of time, against the stops of its axes.

    acceleration: deg/s², None: braking takes no way
    """
    path = _Path(travel, acceleration)
    for step in steps if travel else ():
        if step.action in STOPPING:
            yield from path.rest(step.start_s)
        if step.action in ("move", "record"):
            yield from path.follow(step)
    if steps:
        yield from path.rest(steps[-1].end_s)


class _Path:
    """Where axes with stops are (None: nobody knows) and which turn: rate, since when, by which step."""

    def __init__(self, travel: Mapping[int, Stops], acceleration: float | None) -> None:
        self.travel, self.acceleration = travel, acceleration
        self.at: dict[int, float | None] = dict.fromkeys(travel)
        self.turning: dict[int, tuple[float, float, Moving]] = {}

    def follow(self, step: StepKind) -> Iterator[tuple[StepKind, str]]:
        """A motion begins."""
        for key, value in (step.motion or {}).items():
            quantity, axis = quantity_and_axis(key)
            if axis not in self.travel or axis in self.turning:
                continue
            if quantity == "position":
                yield from self._hold(step, axis, value)
            elif value:
                yield from self._turn(step, axis, value)

    def _hold(self, step: StepKind, axis: int, angle: float) -> Iterator[tuple[StepKind, str]]:
        self.at[axis] = same_attitude(angle, self.travel[axis])
        if self.at[axis] is None:
            yield step, outside(angle, axis, self.travel[axis])

    def _turn(self, step: StepKind, axis: int, rate: float) -> Iterator[tuple[StepKind, str]]:
        if self.at[axis] is None:
            yield (
                step,
                f"axis {axis} has stops, {_said(self.travel[axis])}, and turns from an unknown place; "
                "hold it at a position first",
            )
        else:
            self.turning[axis] = (rate, step.start_s, step)

    def rest(self, now: float) -> Iterator[tuple[StepKind, str]]:
        """Whatever turns is brought to rest."""
        for axis, (rate, since, step) in self.turning.items():
            start = self.at[axis] or 0.0
            braking = rate * abs(rate) / (2 * self.acceleration) if self.acceleration else 0.0
            end = start + rate * (now - since) + braking
            least, most = self.travel[axis]
            self.at[axis] = end if least <= end <= most else None
            if self.at[axis] is None:
                yield (
                    step,  # type: ignore[misc]  # every step in `turning` came in by `follow`
                    f"{rate:g} deg/s for {now - since:g} s takes axis {axis} from {start:g} to {end:g} deg, "
                    f"beyond its stops, {_said(self.travel[axis])}",
                )
        self.turning = {}


def quantity_and_axis(key: str) -> tuple[str, int]:
    """`position_1_deg` -> `position` and 1; axis 0 where a motion names none."""
    quantity, _, rest = key.partition("_")
    return quantity, int(rest[0]) if rest[:1].isdigit() else 0


def outside(angle: float, axis: int, stops: Stops) -> str:
    """What is wrong with an angle in deg that an axis has not."""
    return f"{angle:g} deg is outside the stops of axis {axis}, {_said(stops)}"


def _said(stops: Stops) -> str:
    return f"{stops[0]:g} .. {stops[1]:g} deg"
