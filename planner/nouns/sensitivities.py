"""Navigation error per unit of every sensor error, and what a requirement asks of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from planner.nouns.array import Array, Rule


@dataclass(frozen=True)
class SensitivityColumn:
    """Identity of one column of the linear combination.

    error: `gyro.bias`; axis: `x`, `y`, `z`, a term's name such as `xy`, or `all` for published coefficients
    unit: the display unit of the coefficient, `deg/s`, `g`, `1`, …
    """

    error: str
    axis: str
    unit: str


@dataclass(frozen=True)
class Sensitivities:
    """Navigation error per SI unit of every sensor error, error = computed − true.

    time_s: (m,) instants, the last one is the end of the flight
    position: (m, 3, p) north, east, up in metres per SI unit of column p
    velocity: (m, 3, p) north, east, up in m/s; attitude: (m, 3, p) roll, pitch, heading in rad
    """

    time_s: Array
    columns: tuple[SensitivityColumn, ...]
    position: Array
    velocity: Array
    attitude: Array


@dataclass(frozen=True)
class Constraint:
    """One requirement at one instant: how long the error vector may be, and what every error adds to it.

    requirement: index into the spec's requirements; time_s: the instant it holds at
    limit: SI; percentile: probability for rule `percentile`, else None
    vectors: error name -> (terms, k): components that the requirement asks for, per SI unit of each term
    """

    requirement: int
    error: str
    unit: str
    rule: Rule
    limit: float
    time_s: float
    vectors: Mapping[str, Array]
    percentile: float | None = None

    @property
    def probability(self) -> float:
        """Of a constraint whose rule is `percentile`. Raises ValueError for one without."""
        if self.percentile is None:
            raise ValueError(f"constraint on {self.error} has rule percentile but no probability")
        return self.percentile
