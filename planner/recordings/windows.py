"""A recording in short windows: mean and scatter of each, so that hours fit in bounded memory.

A window is 50 ms or 8 samples, whichever is longer. When there would be more than 262 144 windows (3.6 h),
neighbours are joined and windows are twice as long, so that memory stays bounded at any length.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.recordings.samples import Columns, Samples, joined
from planner.recordings.spikes import block_length, longest_spike, spikes

WINDOW_S = 0.05
LEAST_SAMPLES = 8
MOST_WINDOWS = 1 << 18
BATCH = 1 << 16


@dataclass(frozen=True)
class Windows(Columns):
    """n windows of a recording.

    start, end: (n,) s, times of the first and last sample
    count: (n,) samples used; left_out: (n,) not used; spikes: (n,) of them for a spike
    mean, variance: (n, 6) of gyros (rad/s) and accelerometers (m/s^2); variance is Σ(x − mean)² / (count − 1)
    temperature_degc: (n,) mean, NaN where absent; reference: (n, 6) mean, or None
    label: (n,) step of the whole window, empty where it has several; whole: (n,) no gap in time within
    peak: (n, 6) the largest |x|; held: (n, 6) how many samples stand exactly there
    turned: (n, 3) mean rate of the gyros with every sample: what a mean leaves out, an angle would lack.
        Broken samples are bridged, and spikes beyond all other readings: a jerk of a hand, which
        is no spike, stands out as much but not as far
    """

    start: Array
    end: Array
    count: Array
    left_out: Array
    spikes: Array
    mean: Array
    variance: Array
    temperature_degc: Array
    reference: Array | None
    label: NDArray[np.str_] | None
    whole: NDArray[np.bool_]
    peak: Array
    held: Array
    turned: Array

    def __len__(self) -> int:
        return len(self.start)


def window_length(rate: float) -> int:
    """Samples in a window at a sampling rate in Hz."""
    return max(LEAST_SAMPLES, round(WINDOW_S * rate))


def longest_gap(rate: float) -> float:
    """The longest step in s between samples of one stretch: three lost ones, or a quarter of a window."""
    return max(4.5, 0.25 * window_length(rate)) / rate


def windows_of(blocks: Iterator[Samples], rate: float) -> Windows:
    """The windows of a recording at a sampling rate in Hz; spikes are left out and counted."""
    size = window_length(rate)
    parts: list[Windows] = []
    factor, pending = 1, 0
    for batch in _without_spikes(blocks, size, rate):
        made = _batch_windows(batch, size, longest_gap(rate))
        for _ in range(factor.bit_length() - 1):
            made = halved(made)
        parts.append(made)
        pending += len(made)
        if pending > MOST_WINDOWS:
            parts, factor = [halved(joined(parts))], factor * 2
            pending = len(parts[0])
    return joined(parts)


def _without_spikes(blocks: Iterator[Samples], size: int, rate: float) -> Iterator[Samples]:
    """Batches of whole windows, spikes marked; each batch is judged with its neighbours' samples in view."""
    step = max(1, BATCH // (16 * size)) * 16 * size  # of 16 windows, so that batches can be halved
    length, block_size = longest_spike(rate), block_length(rate)
    left: Samples | None = None
    held: list[Samples] = []
    waiting = 0
    for block in blocks:
        held.append(block)
        waiting += len(block)
        if waiting < step + length:
            continue
        rest = joined(held)
        while len(rest) >= step + length:
            yield _marked(left, rest[:step], rest[step : step + length], length, block_size)
            left, rest = rest[step - length : step], rest[step:]
        held, waiting = [rest], len(rest)
    if waiting:
        rest = joined(held)
        yield _marked(left, rest, rest[:0], length, block_size)


def _marked(left: Samples | None, middle: Samples, right: Samples, length: int, block: int) -> Samples:
    parts = [part for part in (left, middle, right) if part is not None]
    seen = joined(parts)
    used = ~np.isnan(seen.values).all(axis=0)
    values = seen.values[:, used]
    bad = ~(np.isfinite(values).all(axis=1) & seen.good)
    if bad.any() and not bad.all():  # a place that is left out anyway must not make its neighbours look odd
        near = np.maximum.accumulate(np.where(bad, 0, np.arange(len(values))))
        values = values[near]
    found = np.zeros(len(seen), dtype=bool) if bad.all() else spikes(values, length, block)
    start = len(left) if left is not None else 0
    mine = found[start : start + len(middle)] & middle.good
    return replace(middle, good=middle.good & ~mine, spike=mine)


def _batch_windows(batch: Samples, size: int, longest_step: float) -> Windows:
    """Windows of `size` samples; the last of a recording may be shorter."""
    whole = len(batch) // size * size
    made = _equal_windows(batch[:whole], size, longest_step)
    rest = batch[whole:]
    if not len(rest):
        return made
    return joined([made, _equal_windows(rest, len(rest), longest_step)])


def _equal_windows(batch: Samples, size: int, longest_step: float) -> Windows:
    rows = len(batch) // size
    x, good = batch.values.reshape(rows, size, 6), batch.good.reshape(rows, size)
    time = batch.time.reshape(rows, size)
    count = good.sum(axis=1)
    keep = good[:, :, None]
    weight = np.maximum(count, 1)[:, None]
    mean = np.where(keep, x, 0.0).sum(axis=1) / weight
    apart = np.where(keep, x - mean[:, None, :], 0.0)
    variance = (apart**2).sum(axis=1) / np.maximum(count - 1, 1)[:, None]
    size_of = np.where(keep, np.abs(x), -1.0)
    peak = size_of.max(axis=1, initial=-1.0)
    label = None if batch.label is None else batch.label.reshape(rows, size)
    reference = None if batch.reference is None else batch.reference.reshape(rows, size, 6).mean(axis=1)
    return Windows(
        start=time[:, 0],
        end=time[:, -1],
        count=count.astype(float),
        left_out=(size - count).astype(float),
        spikes=batch.spike.reshape(rows, size).sum(axis=1).astype(float),
        mean=mean,
        variance=np.where(
            variance > (1e-13 * peak) ** 2, variance, 0.0
        ),  # a constant's mean is off by an ulp
        temperature_degc=_mean_of_known(batch.temperature_degc.reshape(rows, size)),
        reference=reference,
        label=None if label is None else np.where((label == label[:, :1]).all(axis=1), label[:, 0], ""),
        whole=np.asarray((np.diff(time, axis=1) < longest_step).all(axis=1)),
        peak=peak,
        held=(size_of == peak[:, None, :]).sum(axis=1).astype(float),
        turned=_bridged(batch).reshape(rows, size, 3).mean(axis=1),
    )


def _bridged(batch: Samples) -> Array:
    """(n, 3) rates, those that cannot be by straight lines between the good ones around."""
    values, good = batch.values[:, :3], batch.good
    if good.all() or not good.any():
        return values
    most = np.abs(values[good]).max(axis=0)
    good = good | (batch.spike & (np.abs(values) <= most).all(axis=1))
    place, known = np.arange(len(values)), np.flatnonzero(good)
    found = values.copy()
    for axis in range(values.shape[1]):
        found[~good, axis] = np.interp(place[~good], known, values[known, axis])
    return found


def _mean_of_known(values: Array) -> Array:
    known = np.isfinite(values)
    total = np.where(known, values, 0.0).sum(axis=1)
    return np.where(known.any(axis=1), total / np.maximum(known.sum(axis=1), 1), np.nan)


def halved(windows: Windows) -> Windows:
    """Neighbours joined to windows of twice the length; an odd last one stays as it is.

    mean = Σ n m / Σ n;  variance = (Σ (n − 1) v + Σ n (m − mean)²) / (Σ n − 1)
    """
    last = windows[len(windows) // 2 * 2 :]
    a, b = windows[: len(windows) // 2 * 2 : 2], windows[1::2] if len(windows) % 2 == 0 else windows[1:-1:2]
    n = a.count + b.count
    share = np.divide(a.count, n, out=np.full_like(n, 0.5), where=n > 0)[:, None]
    mean = share * a.mean + (1 - share) * b.mean
    apart = _squares(a, mean) + _squares(b, mean)
    peak = np.maximum(a.peak, b.peak)
    pair = Windows(
        start=a.start,
        end=b.end,
        count=n,
        left_out=a.left_out + b.left_out,
        spikes=a.spikes + b.spikes,
        mean=mean,
        variance=apart / np.maximum(n - 1, 1)[:, None],
        temperature_degc=_mean_of_known(np.column_stack([a.temperature_degc, b.temperature_degc])),
        reference=None if a.reference is None or b.reference is None else (a.reference + b.reference) / 2,
        label=None if a.label is None else np.where(a.label == b.label, a.label, ""),
        whole=a.whole & b.whole & (b.start - a.end < 0.5 * (a.end - a.start) + 1e-9),
        peak=peak,
        held=np.where(a.peak == peak, a.held, 0) + np.where(b.peak == peak, b.held, 0),
        turned=(a.turned + b.turned) / 2,
    )
    return joined([pair, last]) if len(last) else pair


def _squares(windows: Windows, mean: Array) -> Array:
    """(n, 6) Σ (x − mean)² of the samples of each window about another mean."""
    freedom, count = np.maximum(windows.count - 1, 0)[:, None], windows.count[:, None]
    return np.asarray(freedom * windows.variance + count * (windows.mean - mean) ** 2)
