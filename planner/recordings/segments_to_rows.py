"""Segments of a recording -> rows of the dwell table: means, spreads, temperature and its rate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.recordings.column_map import ColumnMap
from planner.recordings.rests import Segment, mean_of, span
from planner.recordings.temperature import slope
from planner.recordings.windows import Windows

MOST_KELVIN = 1.0  # within one dwell, so that a mean temperature means something
SHORTEST_PART_S = 10.0
ROOM_DEGC = 20.0


@dataclass(frozen=True)
class Row:
    """One row, SI; mean, spread: (6,) gyros and accelerometers; reference: (6,) or None; times in s.

    start, end: since the first sample; temperature_degc None when the recording has none
    n_samples: used; left_out: reason -> number of samples left out
    """

    unit: str
    run: int
    step: str
    start: float
    end: float
    duration: float
    temperature_degc: float | None
    temperature_rate: float | None
    mean: Array
    spread: Array
    reference: Array | None
    n_samples: int
    left_out: Mapping[str, int]
    notes: tuple[str, ...]


def cut(windows: Windows, segment: Segment, longest: float) -> Sequence[Segment]:
    """A rest or turn in equal parts of at most `longest` s and 1 K each, not under 10 s; a step stays whole.

    The first and the last window of a rest are not used: the motion may reach into them.
    """
    if segment.kind not in ("rest", "turn"):
        return (segment,)
    quiet = segment.quiet.copy()
    if len(quiet) > 4:
        quiet[[0, -1]] = False
    seconds = span(windows, segment)
    value = windows.temperature_degc[segment.first : segment.last]
    kelvin = float(np.nanmax(value) - np.nanmin(value)) if np.isfinite(value).any() else 0.0
    parts = max(
        int(np.ceil(seconds / longest)),
        min(int(np.ceil(kelvin / MOST_KELVIN)), int(seconds / SHORTEST_PART_S)),
    )
    edges = np.linspace(segment.first, segment.last, max(1, parts) + 1).round().astype(int)
    return [
        Segment(segment.kind, int(a), int(b), quiet[a - segment.first : b - segment.first])
        for a, b in pairwise(edges)
        if b > a
    ]


def row_of(
    windows: Windows,
    segment: Segment,
    living: NDArray[np.bool_],
    label: str,
    unit: str,
    run: int,
    rate: float,
    columns: ColumnMap,
) -> Row | None:
    """The row of a segment; None when its temperature is not known although the recording has a sensor."""
    part = windows[segment.first : segment.last]
    used = segment.quiet & (part.count > 0)
    known = living[segment.first : segment.last] & used
    measured = columns.temperature is not None and living.any()
    if not used.any() or (measured and not known.any()):
        return None
    start, end = float(part.start[used][0]), float(part.end[used][-1])
    mean = mean_of(windows, segment)
    weight = part.count * used
    return Row(
        unit=unit,
        run=run,
        step=label,
        start=start,
        end=end,
        duration=end - start + 1 / rate,
        temperature_degc=float(part.temperature_degc[known].mean()) if measured else None,
        temperature_rate=slope(windows, living, start, end) if measured else None,
        mean=mean,
        spread=_spread(part, used, mean),
        reference=None if part.reference is None else part.reference[used].mean(axis=0),
        n_samples=int(weight.sum()),
        left_out=_left_out(part, used),
        notes=tuple(_oddities(part, used, columns)),
    )


def _spread(part: Windows, used: NDArray[np.bool_], mean: Array) -> Array:
    """(6,) standard deviation of the samples about the record's mean, from the windows' moments."""
    count = part.count[used][:, None]
    squares = (count - 1) * part.variance[used] + count * (part.mean[used] - mean) ** 2
    return np.asarray(np.sqrt(squares.sum(axis=0) / max(count.sum() - 1, 1)))


def _left_out(part: Windows, used: NDArray[np.bool_]) -> dict[str, int]:
    counts = {
        "spike": part.spikes[used].sum(),
        "broken": (part.left_out - part.spikes)[used].sum(),
        "edge_or_burst": (part.count + part.left_out)[~used].sum(),
    }
    return {reason: int(count) for reason, count in counts.items() if count}


def _oddities(part: Windows, used: NDArray[np.bool_], columns: ColumnMap) -> list[str]:
    from planner.recordings.samples import CHANNELS

    notes = []
    limits = [columns.full_scale.gyro] * 3 + [columns.full_scale.acc] * 3
    for i, name in enumerate(CHANNELS):
        if not np.isfinite(part.mean[:, i]).any():
            continue
        if (part.variance[used, i] == 0).all() and part.count[used].sum() > 100:
            notes.append(f"{name} reads the same in every sample: it looks dead or saturated")
        limit = limits[i]
        if limit is not None and (part.peak[used, i] >= 0.999 * limit).any():
            notes.append(f"{name} reaches its full scale")
    return notes


def table_of(rows: Sequence[Row], columns: ColumnMap) -> DwellTable:
    """The dwell table of rows in order; what was not measured is None, or neutral and listed as absent."""
    n = len(rows)
    mean, spread = np.array([r.mean for r in rows]), np.array([r.spread for r in rows])
    reference = np.array([np.full(6, np.nan) if r.reference is None else r.reference for r in rows])
    no_temperature = any(r.temperature_degc is None for r in rows)
    no_rate = no_temperature or any(r.temperature_rate is None for r in rows)
    first = columns.time_on or 0.0
    absent = ["day"] if columns.day is None else []
    absent += ["temp_degc"] if no_temperature else []
    absent += ["temp_rate_degc_min"] if no_rate else []
    return DwellTable(
        unit=np.array([r.unit for r in rows]),
        run=np.array([r.run for r in rows], dtype=np.int64),
        day=np.full(n, columns.day or 0.0),
        time_on=np.array([first + (r.start + r.end) / 2 for r in rows]),
        duration=np.array([r.duration for r in rows]),
        temperature_degc=np.array(
            [ROOM_DEGC if no_temperature else r.temperature_degc for r in rows], dtype=float
        ),
        temperature_rate=np.array([0.0 if no_rate else r.temperature_rate for r in rows], dtype=float),
        ref_rate=_known(reference[:, :3]),
        ref_acc=_known(reference[:, 3:]),
        gyro=_known(mean[:, :3]) if columns.gyro is not None else None,
        acc=_known(mean[:, 3:]) if columns.acc is not None else None,
        step=np.array([r.step for r in rows]),
        gyro_std=_known(spread[:, :3]) if columns.gyro is not None else None,
        acc_std=_known(spread[:, 3:]) if columns.acc is not None else None,
        n_samples=np.array([r.n_samples for r in rows], dtype=np.int64),
        absent=tuple(absent),
    )


def _known(values: Array) -> Array | None:
    return None if np.isnan(values).any() else values
