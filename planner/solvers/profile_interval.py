"""Intervals of a parameter that does not enter linearly, and of the sizes that go with it, by the profile.

    y = X β + g(p) k + e,    S(p) = min over β, k of (y − X β − g k)ᵀ V⁻¹ (y − X β − g k)
    p:  every p with S(p) − S(p̂) ≤ t²
    k:  every k with min over p of [S(p) − S(p̂) + ((k − k̂(p)) / σ_k(p))²] ≤ t²

k̂(p) and σ_k(p) are those of least squares with p held. From records that begin at two time constants after
power-on the size at power-on is known by its logarithm only: an interval of k̂ ± t σ by slopes at p̂ is as
long to either side, held 90 of 100 truths, and ended below zero where the size was sure.
Sources: Bates, Watts, Nonlinear Regression Analysis, 1988, 6.1; Venzon, Moolgavkar, Applied Statistics 37
(1988) 87.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planner.nouns.array import Array

CLOSE = 0.01  # of t, or of a half-width by slopes, to which an end is found
STEPS = 60  # at most, outwards or inwards
LEAST_SHARE = 0.1  # of a bracket that a step inwards leaves on either side
ACROSS = 8  # places to either side at which the sizes are asked, alike in angle on an ellipse of p and k
SLACK = 0.05  # of t², to which a place found for p is an end of a size as well
LEAST = 1e-10  # of a column's square that must be left beside the others


@dataclass(frozen=True)
class Held:
    """With p held: what g(p) explains, k̂ (m,), σ_k (m,)."""

    explained: float
    size: Array
    error: Array


@dataclass(frozen=True)
class ProfileIntervals:
    """low, high: of p; lows, highs: (m,) of the sizes k."""

    low: float
    high: float
    lows: Array
    highs: Array


def held_of(gram: Array, h: Array, whole: Array) -> Held | None:
    """From gram GᵀG (m, m) and h = Gᵀz (m,) of columns clear of all others; None where one of them vanishes.

    whole: (m,) their squares before they were cleared
    """
    if not np.all(np.diag(gram) > LEAST * whole):
        return None
    inverse = np.asarray(np.linalg.pinv(gram, rcond=LEAST, hermitian=True), dtype=float)
    return Held(float(h @ inverse @ h), inverse @ h, np.sqrt(np.maximum(np.diag(inverse), 0.0)))


def profile_intervals(
    held: Callable[[float], Held | None],
    here: float,
    half: float,
    ends: tuple[float, float],
    reach: float,
    reaches: Array,
) -> ProfileIntervals | None:
    """The intervals about the best p, `here`; None where g(p) vanishes there, or nothing is known of t.

    half: of the interval by slopes, a scale of steps; ends: of the range of p
    reach, reaches (m,): t of p and of each size, what estimated variances add to their errors included
    """
    best = held(here)
    if best is None or not half > 0.0 or not np.all(np.isfinite([half, reach, *reaches])):
        return None

    def lost(p: float) -> float:
        one = held(p)
        return np.inf if one is None else max(best.explained - one.explained, 0.0)

    most = max(reach, float(np.max(reaches, initial=0.0)))
    low, high = (
        _end(lost, here, sign * half, end, reach**2) for sign, end in zip((-1, 1), ends, strict=True)
    )
    lows, highs = best.size - reaches * best.error, best.size + reaches * best.error
    for turn in np.linspace(-0.5, 0.5, 2 * ACROSS + 1) * np.pi:
        side = (low if turn < 0.0 else high) - here
        p = float(np.clip(here + most / reach * side * abs(np.sin(turn)), *ends))
        one = held(p)
        if one is None:
            continue
        left = reaches**2 - max(best.explained - one.explained, 0.0)
        arm = np.where(left >= -SLACK * reaches**2, one.error * np.sqrt(np.maximum(left, 0.0)), np.nan)
        lows, highs = np.fmin(lows, one.size - arm), np.fmax(highs, one.size + arm)
    return ProfileIntervals(low, high, lows, highs)


def _end(lost: Callable[[float], float], here: float, half: float, end: float, level: float) -> float:
    """Where S has risen by the level on one side; the end of the range where it never does.

    √(S(p) − S(p̂)) is a straight line in p where slopes say all: on it the place is sought.
    """
    t = float(np.sqrt(level))

    def root(p: float) -> float:
        return float(np.sqrt(lost(p)))

    inside, within, step = here, 0.0, half
    outside, beyond = here, 0.0
    for _ in range(STEPS):
        outside = end if (inside + step - end) * half >= 0.0 else inside + step
        beyond = root(outside)
        if beyond > t:
            break
        if outside == end:
            return end
        inside, within, step = outside, beyond, 2.0 * step
    for _ in range(STEPS):
        share = (t - within) / (beyond - within) if np.isfinite(beyond) else 0.5
        place = inside + float(np.clip(share, LEAST_SHARE, 1.0 - LEAST_SHARE)) * (outside - inside)
        there = root(place)
        if abs(there - t) <= CLOSE * t or abs(outside - inside) <= CLOSE * abs(half):
            return place
        if there > t:
            outside, beyond = place, there
        else:
            inside, within = place, there
    return inside
