"""What thermometers that err do to curves that nobody knows.

    θ̂ − θ ∋ δ_b G_b f'(T_k),   δ_b ~ N(0, σ_b²):   Σ_b σ_b² G_b E[f' f'ᵀ] G_bᵀ

Records that a chamber reads too warm see an unknown curve f a little further on: by δ_b K, one and the same
for all records on a bench (benches.*.accuracy.temperature). What tables know of the curve is corrected for,
but before a calibration they know nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

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
    """

    offsets: Array
    slopes: Mapping[str, Moments]

    def under(self, family: str, name: str) -> Misread:
        """One family alone, by another name."""
        return Misread(self.offsets, {name: self.slopes[family]})

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
    return Misread(offsets, _slopes(curves, kinds.degc, np.where(sigma > 0.0, sigma, 1.0)))


def _sigma(spec: Spec, bench: str) -> float:
    accuracy = spec.benches[bench].accuracy if bench in spec.benches else None
    return 0.0 if accuracy is None else float(accuracy.temperature)


def _slopes(curves: Curves, degc: Array, around: Array) -> dict[str, dict[tuple[Sensor, str], Array]]:
    """family -> error -> (g, g) of mean slopes between `around` (g,) K below and above temperatures (g,).

    Over what a thermometer may be off: a rough curve is steeper over a kelvin than over several.
    """
    below, above = np.round(degc - around, 6), np.round(degc + around, 6)
    points = np.unique(np.concatenate([below, above]))
    low, high = (np.eye(len(points))[np.searchsorted(points, end)] for end in (below, above))
    slope = (high - low) / (2.0 * around[:, None])
    return {
        name: {error: slope @ moment @ slope.T for error, moment in each.items()}
        for name, each in curves.moments(points).items()
    }
