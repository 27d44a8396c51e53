"""What every method is asked: series as they were until today → their distribution some days later."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from planner.fleet.forecast._states import States
from planner.nouns.array import Array

DAYS_A_WEEK = 7.0


@dataclass(frozen=True)
class Past:
    """A series to forecast. day, value, sigma: (n,) in order of days, sigma NaN where unknown; SI.

    kind: what it is (`gyro.bias`): series of one kind may teach each other; storage: what the spec says that
    60 days do, NaN if it says nothing; fresh: days on which the level starts anew; doubtful: the last of
    these may be an outlier as well
    """

    kind: str
    day: Array
    value: Array
    sigma: Array
    storage: float = np.nan
    fresh: tuple[float, ...] = ()
    doubtful: bool = False

    def __len__(self) -> int:
        return len(self.day)

    @property
    def weights(self) -> Array:
        """(n,) variance of each value relative to the usual one; 1 where it is unknown."""
        known = np.isfinite(self.sigma)
        if not known.any():
            return np.ones(len(self))
        usual = float(np.median(self.sigma[known] ** 2))
        return np.where(known, np.where(known, self.sigma, 1.0) ** 2 / usual, 1.0)


@dataclass(frozen=True)
class Forecast:
    """(value − mean) / scale ~ Student's t with `freedom`, all (h,) but noise; SI.

    scale: of the true value; noise: one sigma that a measurement of it adds; states: where it may stand, of
    methods that know it
    """

    mean: Array
    scale: Array
    noise: float
    freedom: float | Array
    states: States | None = None

    def half_width(self, confidence: float, *, measured: bool = True) -> Array:
        """(h,) half of the two-sided prediction interval, of a measurement or of the true value."""
        sigma = np.hypot(self.scale, self.noise) if measured else self.scale
        return np.asarray(two_sided(confidence, self.freedom) * sigma)

    def widened(self, factor: float) -> Forecast:
        """The same with wider intervals."""
        return Forecast(self.mean, self.scale * factor, self.noise * factor, self.freedom)


@runtime_checkable
class Method(Protocol):
    """A method of forecasting. least: points that it needs; slow: validated on a sample of a large fleet.

    needs: the package of the extra `forecast` without which it cannot work, none: it is of planner alone
    """

    name: str
    least: int
    slow: bool
    needs: str

    def forecast(self, series: Sequence[Past], ahead: Sequence[Array]) -> list[Forecast | str]:
        """One per series, ahead (h,) days after its last; a sentence says why there is none."""
        ...


def two_sided(confidence: float, freedom: float | Array) -> Array:
    """The quantile of Student's t, the normal one for infinite freedom."""
    from scipy.special import ndtri, stdtrit

    level = 0.5 * (1 + confidence)
    known = np.isfinite(freedom)
    return np.asarray(np.where(known, stdtrit(np.where(known, freedom, 1.0), level), ndtri(level)))


def too_short(method: Method, one: Past) -> str | None:
    """Why a method cannot forecast a series of that length, if so."""
    if len(one) >= method.least:
        return None
    return f"{method.name} needs {method.least} points, there {'is' if len(one) == 1 else 'are'} {len(one)}"


def alike(series: Sequence[Past], ahead: Sequence[Array]) -> list[list[int]]:
    """Places of series that share days, weights and times ahead, so that one factorisation serves them."""
    found: Mapping[tuple[bytes, ...], list[int]] = {}
    groups = dict(found)
    for i, (one, times) in enumerate(zip(series, ahead, strict=True)):
        key = ((one.day - one.day[0]).tobytes(), one.weights.tobytes(), np.asarray(times).tobytes())
        groups.setdefault(key, []).append(i)
    return list(groups.values())
