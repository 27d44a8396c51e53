"""Whether a recording's readings can be meant: gravity at rest, turns seen by both kinds of sensor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from planner.recordings.rests import Segment, mean_of, pause
from planner.recordings.samples import CHANNELS
from planner.recordings.turns import neighbours
from planner.recordings.windows import Windows
from planner.units import STANDARD_GRAVITY_MPS2 as G
from planner.units import ZERO_CELSIUS_K

LARGEST_RATE = np.radians(20_000.0)  # rad/s: five times the fastest gyro on the market
LEAST_TURN = np.radians(30.0)
LEAST_SATURATED = 2  # windows that stand at the extreme from their first sample to their last
KELVIN = (200.0, 400.0)


def suspicious(windows: Windows, rests: Sequence[Segment]) -> str:
    """A sentence that guesses the mix-up of units, or nothing."""
    return _warmth(windows) or _gravity(windows, rests) or _rates(windows) or _turns(windows, rests)


def _warmth(windows: Windows) -> str:
    """Kelvin named degC, or degC named K."""
    known = windows.temperature_degc[np.isfinite(windows.temperature_degc)]
    if not len(known):
        return ""
    middle = float(np.median(known))
    if KELVIN[0] < middle < KELVIN[1]:
        return (
            f"the temperature is {middle:.1f} degC: it looks like kelvin named degC; write unit: K in the map"
        )
    if KELVIN[0] < middle + 2 * ZERO_CELSIUS_K < KELVIN[1] and known.max() < -ZERO_CELSIUS_K + KELVIN[0]:
        return (
            f"the temperature is {middle:.1f} degC: it looks like degC named K; write unit: degC in the map"
        )
    return ""


def _gravity(windows: Windows, rests: Sequence[Segment]) -> str:
    """At rest |f| is 9.8 m/s^2 within what an uncalibrated accelerometer may be off."""
    lengths = np.array([np.linalg.norm(mean_of(windows, s)[3:]) for s in rests]) / G
    lengths = lengths[np.isfinite(lengths)]
    if not len(lengths):
        return ""
    middle = float(np.median(lengths))
    if 0.7 < middle < 1.4:
        return ""
    for factor, said in ((G, "they look like m/s^2 named g"), (1 / G, "they look like g named m/s^2")):
        if abs(middle / factor - 1) < 0.3:
            return f"at rest the accelerometers read {middle:.3g} g: {said}"
    if abs(middle / 1000 - 1) < 0.3:
        return f"at rest the accelerometers read {middle:.3g} g: they look like milli-g named g"
    return f"at rest the accelerometers read {middle:.3g} g; check their unit and scale in the map"


def _rates(windows: Windows) -> str:
    fastest = float(np.nanmax(np.abs(windows.mean[:, :3]), initial=0.0))
    if fastest > LARGEST_RATE:
        return f"the gyros read up to {np.degrees(fastest):.4g} deg/s: do they give deg/s, named rad/s?"
    return ""


def _turns(windows: Windows, rests: Sequence[Segment]) -> str:
    """Where gravity turned by over 30° between two rests the gyros must have turned at least as far."""
    ratios = [seen / turned for turned, seen in _pairs(windows, rests) if turned > LEAST_TURN]
    if len(ratios) < 2:
        return ""
    middle = float(np.median(ratios))
    if middle < 0.3:
        guess = ": they look like rad/s named deg/s" if middle < 0.06 else "; check their unit and scale"
        return f"the gyros turned {middle:.2g} times as far as gravity turned between rests{guess}"
    if middle > 20:
        return f"the gyros turned {middle:.3g} times as far as gravity did: they look like deg/s named rad/s"
    return ""


def _pairs(windows: Windows, rests: Sequence[Segment]) -> Iterator[tuple[float, float]]:
    """(angle by which the specific force turned, path of the gyros), rad, between neighbouring rests.

    The path ∫|ω| dt can be longer than the angle, never shorter. The bias is that of the rest before.
    """
    for a, b, before, after in neighbours(windows, rests):
        cosine = before[3:] @ after[3:] / (np.linalg.norm(before[3:]) * np.linalg.norm(after[3:]))
        spacing = np.diff(windows.start[a.last : b.first + 1])
        path = float(np.linalg.norm(windows.mean[a.last : b.first, :3] - before[:3], axis=1) @ spacing)
        yield float(np.arccos(np.clip(cosine, -1, 1))), path


def jumps_between(windows: Windows, segments: Sequence[Segment]) -> list[str]:
    """Sentences on bias jumps: gyros change their level in under 0.5 s while gravity stays where it was."""
    found = []
    rests = [s for s in segments if s.kind == "rest"]
    for a, b in pairwise(rests):
        if pause(windows, a, b) > 0.5 or min(_used(a), _used(b)) < 5:
            continue
        apart = mean_of(windows, b) - mean_of(windows, a)
        scatter = np.hypot(_error(windows, a), _error(windows, b))
        if np.isfinite(apart[3:]).all() and (np.abs(apart[3:]) > 5 * scatter[3:]).any():
            continue  # the unit moved
        for axis in np.flatnonzero(np.nan_to_num(np.abs(apart[:3])) > 5 * scatter[:3]):
            at = windows.end[a.last - 1]
            found.append(f"gyro_{'xyz'[axis]} jumps by {np.degrees(apart[axis]):.3g} deg/s at {at:.2f} s")
    return found


def _used(segment: Segment) -> int:
    return int(segment.quiet.sum())


def _error(windows: Windows, segment: Segment) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    means = windows.mean[segment.first : segment.last][segment.quiet]
    return np.asarray(means.std(axis=0, ddof=1) / np.sqrt(len(means)))


def saturated(windows: Windows) -> Iterator[str]:
    """Sentences on channels that stand exactly at their extreme for whole windows and scatter elsewhere."""
    for i, name in enumerate(CHANNELS):
        variance, peak = windows.variance[:, i], windows.peak[:, i]
        still = (windows.count >= 8) & (variance == 0) & (peak == np.max(peak, initial=0.0))
        if LEAST_SATURATED <= still.sum() < 0.5 * len(windows):
            at = windows.start[np.flatnonzero(still)[0]]
            samples = int(windows.count[still].sum())
            yield f"{name} stands at its extreme for {samples} samples, first at {at:.2f} s: saturated"
