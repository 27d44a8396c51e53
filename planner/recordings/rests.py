"""Rests and motions of a recording, found against the recording's own noise.

A window rests when its scatter is that of the quietest windows and its mean follows on its neighbours'. Both
limits are taken from the recording, so a tactical and a consumer unit need no setting. What moves for at most
0.15 s and leaves everything as it was is a burst (K 4.3.3: up to 100 ms); what leaves the gyros at another
level while the accelerometers stay is a bias jump.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.recordings.windows import Windows
from planner.solvers.distributions import chi_square_quantile

Kind = Literal["rest", "turn", "motion", "step"]
LONGEST_BURST_S = 0.15
LONGEST_GAP_S = 1.0  # in the samples of one rest: a stall of the computer that wrote them
TURNING = np.radians(2.0)  # rad/s: above it a steady gyro reading is a turn; biases of MEMS gyros lie below
TILTING = np.radians(0.1)  # rad/s of the specific force's direction: the unit turns slowly
SURE = 1e-7  # chance of a false alarm in one window
WIDEST = 4.0  # the noise may grow to twice its floor (over temperature) without being motion


@dataclass(frozen=True)
class Segment:
    """Windows first … last − 1 of one kind; quiet: (last − first,) which of them are used."""

    kind: Kind
    first: int
    last: int
    quiet: NDArray[np.bool_]
    label: str = ""
    note: str = ""


def segments_of(windows: Windows, longest_step: float) -> list[Segment]:
    """Rests, steady turns and motions, one behind the other, covering every window."""
    quiet = _quiet(windows)
    broken = ~windows.whole | (windows.count < 2)
    quiet &= ~broken
    found = _runs(windows, quiet, longest_step)
    found = _bursts_closed(windows, found)
    level = _rest_level(windows, found)
    return [_judged(windows, segment, level) for segment in found]


def steps_of(windows: Windows) -> list[Segment]:
    """The stretches of one label; windows without a label, or with several, are motion."""
    assert windows.label is not None  # asked for only when the recording has labels
    edges = np.flatnonzero(windows.label[1:] != windows.label[:-1]) + 1
    bounds = [0, *edges.tolist(), len(windows)]
    found = []
    for first, last in pairwise(bounds):
        label = str(windows.label[first])
        quiet = _undisturbed(windows[first:last])
        found.append(Segment("step" if label else "motion", first, last, quiet, label))
    return found


# ---------------------------------------------------------------- quiet windows


def used_channels(windows: Windows) -> NDArray[np.bool_]:
    """(6,) channels that the recording has and that are alive."""
    known = np.isfinite(windows.mean).any(axis=0)
    return np.asarray(known & (np.nan_to_num(windows.variance).max(axis=0, initial=0.0) > 0))


def noise_floor(windows: Windows) -> Array:
    """(6,) variance of the quietest state that the recording keeps coming back to.

    The narrowest stretch of log variance that holds a tenth of the windows, among the lower 70 %.
    """
    floor = np.full(6, np.nan)
    for channel in np.flatnonzero(used_channels(windows)):
        values = windows.variance[:, channel]
        values = np.sort(values[(values > 0) & (windows.count >= 2)])
        if not len(values):
            continue
        lower = np.log(values[: max(2, int(0.7 * len(values)))])
        span = max(1, len(values) // 10)
        if len(lower) <= span:
            floor[channel] = float(np.median(values))
            continue
        start = int(np.argmin(lower[span:] - lower[:-span]))
        floor[channel] = float(np.exp(np.median(lower[start : start + span + 1])))
    return floor


def _quiet(windows: Windows) -> NDArray[np.bool_]:
    floor = noise_floor(windows)
    known = np.flatnonzero(np.isfinite(floor))
    if not len(known):
        return np.ones(len(windows), dtype=bool)  # nothing scatters: all that is here rests
    freedom = max(1.0, float(np.median(windows.count)) - 1)
    limit = max(WIDEST, 1.5 * float(chi_square_quantile(1.0 - SURE, freedom)) / freedom)
    still = np.ones(len(windows), dtype=bool)
    for sensor in (known[known < 3], known[known >= 3]):
        if len(sensor):
            still &= (windows.variance[:, sensor] / floor[sensor]).max(axis=1) < limit
    return still & ~_steps_between(windows, still, known)


def _steps_between(windows: Windows, still: NDArray[np.bool_], known: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Windows whose two neighbours differ by more than quiet windows do: 8 times their usual difference."""
    moved = np.zeros(len(windows), dtype=bool)
    if len(windows) < 5:
        return moved
    change = np.abs(windows.mean[2:, known] - windows.mean[:-2, known])
    calm = still[2:] & still[1:-1] & still[:-2]
    usual = np.median(change[calm], axis=0) / 0.6745 if calm.sum() >= 5 else np.full(len(known), np.inf)
    filled = windows.count >= 2  # the mean of an empty window is no level
    known_change = filled[2:] & filled[:-2]
    moved[1:-1] = known_change & (change > 8.0 * np.maximum(usual, 1e-12)).any(axis=1)
    return moved


def _undisturbed(windows: Windows) -> NDArray[np.bool_]:
    """Within a step: not the windows of a burst, whose scatter is far over the step's own."""
    known = used_channels(windows)
    if not known.any():
        return windows.count > 0
    usual = np.median(windows.variance[:, known], axis=0)
    loud = (windows.variance[:, known] > 9.0 * np.maximum(usual, 1e-30)).any(axis=1)
    return (windows.count >= 2) & (~loud if loud.mean() < 0.1 else np.ones(len(windows), dtype=bool))


# ---------------------------------------------------------------- segments


def _runs(windows: Windows, quiet: NDArray[np.bool_], longest_step: float) -> list[Segment]:
    """Stretches of equal state; a gap in time ends one too."""
    gap = windows.start[1:] - windows.end[:-1] > longest_step
    edges = np.flatnonzero((quiet[1:] != quiet[:-1]) | gap) + 1
    bounds = [0, *edges.tolist(), len(windows)]
    return [Segment("rest" if quiet[a] else "motion", a, b, quiet[a:b]) for a, b in pairwise(bounds)]


def _bursts_closed(windows: Windows, found: list[Segment]) -> list[Segment]:
    """Rests on both sides of a burst, or of a short gap, become one that does not use what is between."""
    kept: list[Segment] = []
    spacing = float(np.median(np.diff(windows.start))) if len(windows) > 1 else 0.0
    longest = max(2, round(LONGEST_BURST_S / spacing) + 2) if spacing else 2
    for segment in found:
        before = _rest_before(windows, kept, segment, longest)
        if before is not None:
            between = kept[before + 1 :]
            quiet = np.concatenate([part.quiet for part in (kept[before], *between, segment)])
            segment = Segment("rest", kept[before].first, segment.last, quiet)
            del kept[before:]
        kept.append(segment)
    return kept


def _rest_before(windows: Windows, kept: list[Segment], segment: Segment, longest: int) -> int | None:
    """The number of the rest that goes on in this one after a burst or a short gap, if there is one."""
    place = len(kept) - (2 if kept and kept[-1].kind == "motion" else 1)
    if segment.kind != "rest" or place < 0 or kept[place].kind != "rest":
        return None
    before, burst = kept[place], windows[kept[place].last : segment.first]
    apart = windows.start[segment.first] - windows.end[before.last - 1]
    is_burst = 0 < len(burst) <= longest and bool(burst.whole.all())
    is_gap = apart <= LONGEST_GAP_S and (not len(burst) or (not burst.whole.all() and len(burst) <= longest))
    return place if (is_burst or is_gap) and _same_level(windows, before, segment) else None


def _same_level(windows: Windows, a: Segment, b: Segment) -> bool:
    """Whether the last second of a and the first of b have the same mean, within 5 σ of both."""
    before = windows.mean[max(a.first, a.last - 20) : a.last]
    after = windows.mean[b.first : min(b.last, b.first + 20)]
    scatter = np.hypot(_error_of_mean(before), _error_of_mean(after))
    known = used_channels(windows)
    return bool((np.abs(before.mean(axis=0) - after.mean(axis=0)) <= 5 * scatter)[known].all())


def _error_of_mean(means: Array) -> Array:
    """(6,) σ of the mean of (n, 6) window means; one window alone says nothing and passes for anything."""
    if len(means) < 3:
        return np.full(means.shape[1], np.inf)
    return np.asarray(means.std(axis=0, ddof=1) / np.sqrt(len(means)))


def mean_of(windows: Windows, segment: Segment) -> Array:
    """(6,) mean of the windows that a segment uses, weighted by their samples."""
    part = windows[segment.first : segment.last]
    weight = part.count * segment.quiet
    return np.asarray((weight[:, None] * part.mean).sum(axis=0) / max(weight.sum(), 1.0))


def span(windows: Windows, segment: Segment) -> float:
    """Seconds from the first sample of a segment to its last."""
    return float(windows.end[segment.last - 1] - windows.start[segment.first])


def pause(windows: Windows, before: Segment, after: Segment) -> float:
    """Seconds from the last sample of a segment to the first of another."""
    return float(windows.start[after.first] - windows.end[before.last - 1])


def _rest_level(windows: Windows, found: list[Segment]) -> Array:
    """(3,) the gyros' reading at rest: the middle of all quiet windows."""
    quiet = np.concatenate([segment.quiet & (segment.kind == "rest") for segment in found])
    chosen = windows.mean[quiet, :3] if quiet.any() else windows.mean[:, :3]
    return np.nan_to_num(np.median(chosen, axis=0))


def _judged(windows: Windows, segment: Segment, level: Array) -> Segment:
    """A quiet stretch in which the gyros read a rate is a turn; one in which gravity moves is a motion."""
    if segment.kind != "rest":
        return segment
    rate = float(np.linalg.norm(np.nan_to_num(mean_of(windows, segment)[:3] - level)))
    if rate > TURNING:
        return Segment("turn", segment.first, segment.last, segment.quiet, note="turns steadily")
    if _tilting(windows, segment) > TILTING:
        return Segment("motion", segment.first, segment.last, segment.quiet, note="tilts slowly")
    return segment


def _tilting(windows: Windows, segment: Segment) -> float:
    """Rad/s by which the specific force turns in body axes between the ends of a segment."""
    count = segment.last - segment.first
    if count < 5 or not np.isfinite(windows.mean[segment.first, 3:]).all():
        return 0.0
    quarter = max(1, count // 4)
    a = windows.mean[segment.first : segment.first + quarter, 3:].mean(axis=0)
    b = windows.mean[segment.last - quarter : segment.last, 3:].mean(axis=0)
    scatter = windows.mean[segment.first : segment.last, 3:].std(axis=0).max() * 4 / np.sqrt(quarter)
    long_a, long_b = float(np.linalg.norm(a)), float(np.linalg.norm(b))
    apart = float(np.linalg.norm(np.cross(a, b))) / max(long_a * long_b, 1e-12)
    sure = apart * long_a > 4 * scatter
    return float(np.arcsin(min(1.0, apart)) / max(0.75 * span(windows, segment), 1e-9)) if sure else 0.0
