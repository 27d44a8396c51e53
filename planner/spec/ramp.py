"""A test whose records are made while the chamber moves: `temperature: {ramp: 1 K/min}` (K 2.4.2).

A repeat is made at a temperature T all the same. The chamber goes down to T − h first; then for every motion
it rises through T to T + h, and falls through T to T − h, and a record is made in the middle of either way.
So every record has the mean temperature T, and the motions are recorded at the rates +r and −r alike:

    h = r (lead + record / 2)

`lead` is how long the ramp lasts before the record, and after it: the unit follows the air by then.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from pydantic import Field

from planner.quantities import KelvinPerSecond, Seconds
from planner.spec.part import SpecPart

WAYS = (1.0, -1.0)  # each motion while the temperature rises, and while it falls


class Ramp(SpecPart):
    """How fast the chamber moves during the records, both ways."""

    ramp: KelvinPerSecond = Field(description="how fast, up and down, e.g. 1 K/min")
    lead: Seconds = Field(120.0, description="ramp before each record, and after it, e.g. 2 min, the default")


class OnRamp(Protocol):
    """A test as far as its ramps go."""

    @property
    def record(self) -> float:
        """Seconds of a record."""
        ...

    @property
    def ramp(self) -> Ramp | None:
        """How its chamber moves; None: it is soaked."""
        ...


def lead_of(test: OnRamp) -> float:
    """Seconds of ramp before each record, and as many after it; 0 for a soaked test."""
    return 0.0 if test.ramp is None else test.ramp.lead


def half_way(test: OnRamp) -> float:
    """h: kelvins on either side of a test's temperature that its chamber goes; 0 for a soaked test."""
    return 0.0 if test.ramp is None else test.ramp.ramp * (test.ramp.lead + test.record / 2.0)


def rates_of(test: OnRamp, count: int) -> Iterator[float]:
    """K/s of the chamber during each of the `count` records of a repeat: up and down in turn."""
    speed = 0.0 if test.ramp is None else test.ramp.ramp
    return (speed * WAYS[k % len(WAYS)] for k in range(count))
