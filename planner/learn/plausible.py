"""Whether a recording's readings can be meant: gravity at rest, turns seen by gyros and accelerometers alike."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from planner.learn.rests import Segment, mean_of
from planner.learn.windows import Windows
from planner.units import STANDARD_GRAVITY_MPS2 as G

LARGEST_RATE = np.radians(20_000.0)  # rad/s: five times the fastest gyro on the market
LEAST_TURN = np.radians(30.0)


def suspicious(windows: Windows, segments: Sequence[Segment]) -> str:
    """A sentence that guesses the mix-up of units, or nothing."""
    rests = [s for s in segments if s.kind == "rest" and s.last - s.first >= 3]
    return _gravity(windows, rests) or _rates(windows) or _turns(windows, rests)


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
    if not np.isfinite(windows.mean).all():
        return
    for a, b in zip(rests[:-1], rests[1:], strict=True):
        if not windows.whole[a.last : b.first].all() or windows.start[b.first] - windows.end[a.last - 1] > 60:
            continue
        before, after = mean_of(windows, a), mean_of(windows, b)
        cosine = before[3:] @ after[3:] / (np.linalg.norm(before[3:]) * np.linalg.norm(after[3:]))
        part = windows[a.last : b.first]
        if not len(part):
            continue
        spacing = np.diff(windows.start[a.last : b.first + 1])
        path = float(np.linalg.norm(part.mean[:, :3] - before[:3], axis=1) @ spacing)
        yield float(np.arccos(np.clip(cosine, -1, 1))), path


def jumps_between(windows: Windows, segments: Sequence[Segment]) -> list[str]:
    """Sentences on bias jumps: the gyros change their level in under 0.5 s while gravity stays where it was."""
    found = []
    rests = [s for s in segments if s.kind == "rest"]
    for a, b in zip(rests[:-1], rests[1:], strict=True):
        if windows.start[b.first] - windows.end[a.last - 1] > 0.5 or min(_used(a), _used(b)) < 5:
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
