"""What flights take from the curve of one error, at the campaign's records and in flight."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.protocols import Sensor

Error = tuple[Sensor, str]
LOOKED_UP = 60_000  # values of curves at once: with their places they stay in the second cache


@dataclass(frozen=True)
class CurveWeights:
    """What d takes from the curve of one term of an error on a channel, at the campaign's records, in flight.

    places: (S, t) among the points; weights: (S, ρ, t)
    """

    error: Error
    places: NDArray[np.intp]
    weights: Array

    def second_moment(self, moment: Array) -> Array:
        """(S, ρ, ρ) for curves of moment (N, N)."""
        M = moment[self.places[:, :, None], self.places[:, None, :]]
        return np.asarray(self.weights @ M @ np.swapaxes(self.weights, 1, 2))

    def of_mean(self, mean: Array) -> Array:
        """(S, ρ) of a curve (N,) that all units have."""
        return np.asarray((self.weights @ mean[self.places][:, :, None])[..., 0])

    def times(self, factor: float) -> CurveWeights:
        """Of a multiple of d."""
        return CurveWeights(self.error, self.places, factor * self.weights)

    def of_rows(self, rows: slice) -> CurveWeights:
        """Of some rows of d."""
        return CurveWeights(self.error, self.places, self.weights[:, rows])

    def on(self, scenarios: NDArray[np.intp]) -> CurveWeights:
        """Of some of the flight's temperatures."""
        return CurveWeights(self.error, self.places[scenarios], self.weights[scenarios])

    def along(self, axes: Array) -> CurveWeights:
        """Of d along axes (S, ρ, ρ), the columns."""
        return CurveWeights(self.error, self.places, np.swapaxes(axes, 1, 2) @ self.weights)

    def add_to(
        self,
        d: NDArray[np.float32],
        curves: NDArray[np.float32],
        rows: NDArray[np.int32],
        sign: NDArray[np.float32],
    ) -> None:
        """Adds to flights d (S, ρ, n) the curves (N, m) of which each takes one of rows (S, n), with a sign.

        Temperature by temperature of the flight: one curve's values at one point stay in the nearest cache.
        """
        places, at = _distinct(self.places.tobytes(), self.places.shape)
        weights = np.zeros((*self.weights.shape[:2], places.shape[1]), dtype=np.float32)
        for record, place in enumerate(at):
            weights[:, :, place] += self.weights[:, :, record]
        values, starts = curves.ravel(), places[:, :, None] * curves.shape[1]
        at_once = max(LOOKED_UP // (places.shape[1] * rows.shape[1]), 1)
        for first in range(0, len(d), at_once):
            some = slice(first, first + at_once)
            seen = values.take(starts[some] + rows[some, None])
            d[some] += (weights[some] @ seen) * sign[some, None]


@lru_cache(maxsize=16)
def _distinct(places: bytes, shape: tuple[int, int]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """(S, t') the distinct columns of places (S, t), and (t,) which of them each is.

    Many power-ons have one temperature: its curve is looked up once. All errors have the same places.
    """
    found, at = np.unique(np.frombuffer(places, dtype=np.intp).reshape(shape), axis=1, return_inverse=True)
    return found, at.ravel()
