"""What the requirements leave to every sensor error, and what it is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal


@dataclass(frozen=True)
class ErrorModel:
    """What the spec says of one error `<sensor>.<effect>`, in SI.

    run_to_run: (temperature_degc, one sigma) pairs, one pair with NaN temperature when it is constant
    whole_variation: what remains without any temperature table (systematic size or largest residual)
    calibrated: whether the spec declares the effect and a test serves it; in_run_time: of in_run, s
    within: test -> sigma that the records of one repeat add to run_to_run; infinite: undetermined
    """

    name: str
    unit: str
    systematic: float
    run_to_run: tuple[tuple[float, float], ...]
    in_run: float
    storage: float
    whole_variation: float
    calibrated: bool
    within: Mapping[str, float] = field(default_factory=dict)
    in_run_time: float = 600.0

    @property
    def largest_run_to_run(self) -> float:
        """The run-to-run sigma at the temperature where it is worst: the flight may be there."""
        return max(sigma for _, sigma in self.run_to_run)


@dataclass(frozen=True)
class FlownTerm:
    """One term of an error in flight; unit: of its error."""

    error: str
    axis: str
    unit: str


@dataclass(frozen=True)
class FlownCovariance:
    """What is left of all terms together in flight. matrix: (F, F) in their units, mean over temperatures

    requirement: at whose flights' temperatures, under the family of curves that binds it
    """

    requirement: int
    terms: tuple[FlownTerm, ...]
    matrix: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Allowance:
    """The allowed size of one error and its parts, in SI. worst_case: parts add; otherwise their squares.

    An error that nobody calibrates has its whole systematic size as its estimate's error.
    """

    error: str
    unit: str
    allowed: float
    run_to_run: float
    in_run: float
    storage: float
    temperature: float
    estimate: float
    calibrated: bool = True

    @property
    def parts(self) -> dict[str, float]:
        """The five parts by their names in plan.json."""
        return {
            "run_to_run": self.run_to_run,
            "in_run": self.in_run,
            "storage": self.storage,
            "temperature": self.temperature,
            "estimate": self.estimate,
        }


@dataclass(frozen=True)
class Corner:
    """The allowance vector in which one error is as large as it can be (or all are equally relaxed).

    genetic, exact: error name -> SI allowance; gap: (exact − genetic) / exact of the corner's own error
    """

    name: str
    genetic: Mapping[str, float]
    exact: Mapping[str, float]
    gap: float


@dataclass(frozen=True)
class GeneticHistory:
    """One run of the genetic algorithm: best and mean fitness per generation, for the convergence figure."""

    best: tuple[float, ...]
    mean: tuple[float, ...]
    generations: int
    evaluations: int
    stopped: Literal["converged", "generations", "time"]


@dataclass(frozen=True)
class AllowedErrors:
    """Answer of the allowance stage: the region of sensor errors that the requirements leave.

    smallest, largest: error name -> SI bounds of the genes (best that the bench can reach; uncalibrated)
    front: allowance vectors on the limit that the genetic algorithm kept (Pareto set), in order of `errors`
    tightness: requirement index -> share of the limit used when every error is at its smallest
    """

    errors: tuple[str, ...]
    units: Mapping[str, str]
    smallest: Mapping[str, float]
    largest: Mapping[str, float]
    front: tuple[tuple[float, ...], ...]
    corners: tuple[Corner, ...]
    history: GeneticHistory
    tightness: Mapping[int, float]
