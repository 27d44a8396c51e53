"""Allan deviation of the longest rest among recordings, and the record that it recommends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.recordings.allan import LEAST_SAMPLES, AllanResult, allan
from planner.recordings.coloured_noise import NoiseOfSamples, noise_of_samples
from planner.recordings.reduction import ScannedFile
from planner.recordings.rests import Segment, span, used_channels
from planner.recordings.samples import CHANNELS, Samples
from planner.recordings.spikes import block_length, longest_spike, spikes
from planner.recordings.temperature import alive

RECORD_LIMITS_S = (10.0, 600.0)  # the temperature rate needs 10 s; K's longest record is 300 s
MOST_SAMPLES = 1 << 18
LEAST_S = 30.0
MOST_KELVIN = 2.0


@dataclass(frozen=True)
class RestNoise:
    """Allan deviations of the longest rest, a phrase on where it is, what it recommends; noise of samples.

    record: s, the best averaging time of one dwell; None when nothing rests for 30 s, or when the temperature
        moves during the rest, so that its drift and not the noise would set the time
    is_bound: the rest is too short to show the minimum, so longer may be better
    """

    allan: tuple[AllanResult, ...]
    place: str
    record: float | None
    is_bound: bool
    samples: tuple[NoiseOfSamples, ...] = ()


def noise_of(files: Sequence[ScannedFile]) -> RestNoise:
    """Of every living channel in the longest rest or step of at least 30 s."""
    longest = _longest(files)
    if longest is None:
        return RestNoise((), "", None, False)
    file, segment = longest
    values, rate = _readings(file, segment)
    if len(values) < LEAST_SAMPLES:
        return RestNoise((), "", None, False)
    living = np.flatnonzero(used_channels(file.windows) & (np.ptp(values, axis=0) > 0))
    results = tuple(allan(values[:, i], rate, CHANNELS[i]) for i in living)
    fitted = (noise_of_samples(values[:, i], rate, CHANNELS[i]) for i in living)
    coloured = tuple(one for one in fitted if one is not None)
    record, bound = recommended(results)
    kelvin = _warming(file, segment)
    place = f"{span(file.windows, segment):.0f} s of {file.unit} run {file.run}"
    if kelvin <= MOST_KELVIN:
        return RestNoise(results, place, record, bound, coloured)
    place += f", over which the temperature moves by {kelvin:.3g} K; so they recommend no record"
    return RestNoise(results, place, None, False, coloured)


def _longest(files: Sequence[ScannedFile]) -> tuple[ScannedFile, Segment] | None:
    every = ((file, s) for file in files for s in file.segments if s.kind in ("rest", "step"))
    longest = max(every, key=lambda one: span(one[0].windows, one[1]), default=None)
    return longest if longest is not None and span(longest[0].windows, longest[1]) >= LEAST_S else None


def _warming(file: ScannedFile, segment: Segment) -> float:
    """K by which the temperature moves; 0 where it is not known."""
    value = file.windows.temperature_degc[segment.first : segment.last]
    known = value[alive(file.windows)[segment.first : segment.last]]
    return float(np.ptp(known)) if len(known) else 0.0


def _readings(file: ScannedFile, segment: Segment) -> tuple[Array, float]:
    """(n, 6) readings of a segment and their rate in Hz, averaged so that they are at most 262 144.

    Samples that were left out are bridged by the one before: they are few, and a hole would shift the rest.
    """
    start, end = file.windows.start[segment.first], file.windows.end[segment.last - 1]
    factor = max(1, int(np.ceil((end - start) * file.rate / MOST_SAMPLES)))
    parts: list[Array] = []
    rest = np.zeros((0, 6))
    for block in file.recording.samples():
        inside = (block.time >= start) & (block.time <= end)
        if not inside.any():
            if len(block) and block.time[0] > end:
                break
            continue
        rest = np.vstack([rest, _bridged(block[inside], file.rate)])
        whole = len(rest) // factor * factor
        parts.append(rest[:whole].reshape(-1, factor, 6).mean(axis=1))
        rest = rest[whole:]
    return np.vstack(parts) if parts else rest, file.rate / factor


def _bridged(samples: Samples, rate: float) -> Array:
    used = np.isfinite(samples.values).any(axis=0)
    values = samples.values.copy()
    bad = ~np.isfinite(values[:, used]).all(axis=1) | ~samples.good
    values = values[_last_good(bad)]
    if used.any():
        values = values[_last_good(spikes(values[:, used], longest_spike(rate), block_length(rate)))]
    return np.asarray(values)


def _last_good(bad: NDArray[np.bool_]) -> NDArray[np.intp]:
    """(n,) number of the sample to take for each: itself, the last good one, or the first good one."""
    n = len(bad)
    first = int(np.argmin(bad))
    return np.asarray(np.maximum(np.maximum.accumulate(np.where(bad, 0, np.arange(n))), first))


def recommended(results: Sequence[AllanResult]) -> tuple[float | None, bool]:
    """The shortest best time over the channels: past it some channel gets worse; whether it is a bound."""
    if not results:
        return None, False
    told = [one for one in results if not one.at_end]
    if told:
        return float(min(one.best_time for one in told)), False
    return float(min(one.best_time for one in results)), True


def snippet(record: float | None) -> str | None:
    """The line for a spec's test, within 10 s … 600 s, to two digits."""
    if record is None:
        return None
    return f"record: {float(f'{np.clip(record, *RECORD_LIMITS_S):.2g}'):g} s"
