"""At which temperatures flights start: as the flight itself, anywhere in the range, in shares, at one.

The flight's profile is shifted along and clipped to the range of use.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from planner.nouns.array import Array
from planner.spec.flight_temperature import TemperatureShares
from planner.spec.model import Requirement, Spec

Word = Literal["flight", "range", "worst", "distribution"]
GRID = 48  # temperatures that stand for a range: what straight lines leave has a bend at each of 20 nodes


@dataclass(frozen=True)
class Starts:
    """word: as the spec has it; degc: (k,) where, of `range` its ends; shares: (k,) of the flights.

    Of `flight` there are none. within: the range, to which a profile is clipped
    """

    word: Word
    within: tuple[float, float]
    degc: Array
    shares: Array

    @property
    def key(self) -> tuple[object, ...]:
        """The same for the same starts."""
        return self.word, *self.within, *self.degc.tolist(), *self.shares.tolist()

    def drawn(self, profile: Array, flights: int, rng: np.random.Generator) -> Array:
        """(flights, K) temperatures along a profile (K,) for flights that start as this says; or (K,)."""
        if self.word == "flight":
            return profile
        if self.word == "range":
            return self.along(profile, rng.uniform(*self.within, size=flights))
        return self.along(profile, rng.choice(self.degc, size=flights, p=self.shares))

    def along(self, profile: Array, start: Array) -> Array:
        """(s, K) temperatures along a profile (K,) from starts (s,)."""
        return np.asarray(np.clip(start[:, None] + profile - profile[0], *self.within))

    def grid(self, profile: Array) -> tuple[Array, Array]:
        """Temperatures (s, K) along a profile and their shares (s,), which stand for all flights."""
        if self.word == "flight":
            return profile[None, :], np.ones(1)
        if self.word != "range":
            return self.along(profile, self.degc), self.shares
        low, high = self.within
        middles = low + (high - low) * (np.arange(GRID) + 0.5) / GRID
        return self.along(profile, middles), np.full(GRID, 1.0 / GRID)

    @property
    def words(self) -> str:
        """In a sentence about flights."""
        if self.word == "flight":
            return "as warm as the flight is"
        if self.word == "range":
            return "at any temperature of the range"
        if len(self.degc) == 1:
            return f"from {self.degc[0]:.3g} degC on" + (", the worst" if self.word == "worst" else "")
        shares = zip(self.degc.tolist(), self.shares.tolist(), strict=True)
        return "from " + ", ".join(f"{t:.3g} degC ({100 * share:.3g} %)" for t, share in shares) + " on"


def as_flown(spec: Spec) -> Starts:
    """The flight's own temperatures."""
    return Starts("flight", spec.plan.temperatures.range, np.zeros(0), np.zeros(0))


def anywhere(spec: Spec) -> Starts:
    """Evenly over the range of use."""
    low, high = spec.plan.temperatures.range
    return Starts("range", (low, high), np.array([low, high]), np.array([0.5, 0.5]))


def at_one(spec: Spec, degc: float) -> Starts:
    """All from one temperature, found to be the worst."""
    return Starts("worst", spec.plan.temperatures.range, np.array([degc]), np.ones(1))


def starts_of(wanted: Requirement, spec: Spec) -> Starts | None:
    """Of a requirement; None for the worst temperature, which must be looked for.

    A worst case is held by K's sums whatever the temperature: it is flown as the flight has it.
    """
    if wanted.rule == "worst_case" or wanted.temperature == "flight":
        return as_flown(spec)
    if isinstance(wanted.temperature, TemperatureShares):
        t = wanted.temperature
        return Starts("distribution", spec.plan.temperatures.range, t.temperatures_degc, t.shares)
    return anywhere(spec) if wanted.temperature == "range" else None
