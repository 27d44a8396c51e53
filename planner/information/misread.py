"""What thermometers that err do to curves that nobody knows.

    θ̂ − θ ∋ δ_b G_b f'(T_k),   δ_b ~ N(0, σ_b²):   Σ_b σ_b² G_b E[f' f'ᵀ] G_bᵀ

Records that a chamber reads too warm see an unknown curve f a little further on: by δ_b K, one and the same
for all records on a bench (benches.*.accuracy.temperature). What tables know of the curve is corrected for,
but before a calibration they know nothing. Of curves that were measured on several units the mean slopes are
those of every error and channel of a unit at once, as δ_b is: what they make of d adds up, not its squares.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from planner.information.curves import Curves
from planner.information.kinds import Kinds
from planner.information.smooth import Moments
from planner.nouns.array import Array
from planner.protocols import Sensor
from planner.spec.model import Spec


@dataclass(frozen=True)
class Misread:
    """offsets: (g, g) K², covariance of what the thermometers of two kinds are off.

    slopes: family -> (sensor, effect) -> (g, g) second moment of the curve's slopes at the kinds, SI²/K²
    means: (sensor, effect) -> (thermometers, g) sigma of what each makes of the mean of its curves, SI
    """

    offsets: Array
    slopes: Mapping[str, Moments]
    means: Mapping[tuple[Sensor, str], Array] = field(default_factory=dict)

    def under(self, family: str, name: str) -> Misread:
        """One family alone, by another name."""
        return Misread(self.offsets, {name: self.slopes[family]}, self.means)

    def among(self, families: Sequence[str]) -> Misread:
        """Some of the families."""
        return Misread(self.offsets, {name: self.slopes[name] for name in families}, self.means)

    def of(self, error: tuple[Sensor, str]) -> list[Array | float]:
        """(g, g) or 0 per family: second moment of what the curve is off at the kinds' records, SI²."""
        return [self.offsets * family.get(error, 0.0) for family in self.slopes.values()]


def misread_of(spec: Spec, kinds: Kinds, curves: Curves) -> Misread | None:
    """None where every thermometer of the kinds' benches is right."""
    sigma = np.array([_sigma(spec, k.bench) for k in kinds.kinds])
    if not sigma.any():
        return None
    bench = np.array([k.bench for k in kinds.kinds])
    offsets = np.where(bench[:, None] == bench, np.outer(sigma, sigma), 0.0)
    slope, points = _slope(kinds.degc, np.where(sigma > 0.0, sigma, 1.0))
    moments = {
        name: {error: slope @ moment @ slope.T for error, moment in each.items()}
        for name, each in curves.moments(points).items()
    }
    erring = np.unique(bench[sigma > 0.0])[:, None] == bench
    means = {error: erring * sigma * (slope @ mean) for error, mean in curves.means(points).items()}
    return Misread(offsets, moments, means)


def _sigma(spec: Spec, bench: str) -> float:
    accuracy = spec.benches[bench].accuracy if bench in spec.benches else None
    return 0.0 if accuracy is None else float(accuracy.temperature)


def _slope(degc: Array, around: Array) -> tuple[Array, Array]:
    """(g, N) mean slopes between `around` (g,) K below and above temperatures (g,), of values at (N,) degC.

    Over what a thermometer may be off: a rough curve is steeper over a kelvin than over several.
    """
    below, above = np.round(degc - around, 6), np.round(degc + around, 6)
    points = np.unique(np.concatenate([below, above]))
    low, high = (np.eye(len(points))[np.searchsorted(points, end)] for end in (below, above))
    return (high - low) / (2.0 * around[:, None]), points
