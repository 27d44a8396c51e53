"""What a plan may choose, what it chose, and why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array, Placement


@dataclass(frozen=True)
class TemperaturePoints:
    """One way to spread the calibration temperatures of an error, and the residual that it leaves.

    placement: `even`, `optimal` (dynamic programming on a measured curve), `joining` (rides along with the
    points of another error), `fixed` or `room`
    """

    temperatures_degc: tuple[float, ...]
    residual: float
    placement: Placement


@dataclass(frozen=True)
class PointMenu:
    """The temperature points that one error may choose in one test."""

    error: str
    test: str
    points: tuple[TemperaturePoints, ...]


@dataclass(frozen=True)
class RepeatLevels:
    """For one set of temperature points: repeats (L, T) that bring d to half_width (L,) at every point.

    Ordered from the fewest repeats to the most; half_width is the largest d over the points.
    """

    half_width: Array
    repeats: NDArray[np.int64]


@dataclass(frozen=True)
class ErrorMenu:
    """Everything one error may choose in one test: temperature points and, for each, the repeat levels."""

    error: str
    test: str
    points: tuple[TemperaturePoints, ...]
    levels: tuple[RepeatLevels, ...]


@dataclass(frozen=True)
class ErrorChoice:
    """What one error was given: its test, its points, and the half-width d that its repeats reach."""

    error: str
    test: str
    points: TemperaturePoints
    needed_repeats: tuple[int, ...]
    needed_half_width: float
    half_width: float


@dataclass(frozen=True)
class TestVisits:
    """The temperatures at which a test is made and the repeats at each; the union of what its errors need."""

    __test__ = False  # not a pytest class

    test: str
    temperatures_degc: tuple[float, ...]
    repeats: tuple[int, ...]


@dataclass(frozen=True)
class Campaign:
    """The chosen temperatures, repeats and allowances, with the proof that no choice costs less.

    objective: weighted cost in seconds of the work of one batch; bound: proved lower bound of it
    total_bound: that of the weighted total with waiting and batches; None: the work's own; by_total: whether
    another campaign takes less work, but longer with them; added: only to tell errors apart, not proved
    """

    visits: tuple[TestVisits, ...]
    choices: tuple[ErrorChoice, ...]
    objective: float
    bound: float
    proved: bool
    total_bound: float | None = None
    by_total: bool = False
    added: tuple[str, ...] = ()

    @property
    def gap(self) -> float:
        """(objective − bound) / objective."""
        return max(0.0, self.objective - self.bound) / self.objective if self.objective > 0 else 0.0


@dataclass(frozen=True)
class RepeatReason:
    """Why this number: the repeats of one error at one temperature, in SI; spread: sigma of one repeat."""

    error: str
    test: str
    temperature_degc: float
    spread: float
    confidence: float
    quantile_name: str
    quantile: float
    repeats: int
    half_width: float
    needed_half_width: float
    bound_by: Literal["accuracy", "least", "shared", "fixed", "promise"]
