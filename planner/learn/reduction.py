"""What came of a recording: the dwell table, and for every stretch of it what became of it and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from planner.learn.allan import AllanResult
from planner.measured import DwellTable


@dataclass(frozen=True)
class RowAccount:
    """One row of the table: where it stands in the recording and how many samples it used and left out.

    start, end: s since the first sample; reason -> number of samples left out
    """

    unit: str
    run: int
    label: str
    start: float
    end: float
    samples: int
    left_out: Mapping[str, int]


@dataclass(frozen=True)
class LeftOut:
    """A stretch that gave no row, and why. start, end: s since the first sample."""

    unit: str
    run: int
    kind: str
    start: float
    end: float
    reason: str


@dataclass(frozen=True)
class Reduction:
    """The dwell table with its account.

    counts: file -> reason -> number of samples or bytes that the reader had to leave out
    allan: of the longest rest; record: s, the best averaging time of one dwell, None when no rest tells;
    record_is_bound: the recording is too short to show the minimum, so longer may be better
    """

    table: DwellTable
    rows: tuple[RowAccount, ...]
    left_out: tuple[LeftOut, ...]
    counts: Mapping[str, Mapping[str, int]]
    allan: tuple[AllanResult, ...]
    record: float | None
    record_is_bound: bool
    rates_hz: Mapping[str, float]

    def document(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "rows": [vars(row) | {"left_out": dict(row.left_out)} for row in self.rows],
            "left_out": [vars(part) for part in self.left_out],
            "counts": {file: dict(counts) for file, counts in self.counts.items()},
            "rates_hz": dict(self.rates_hz),
            "record_s": self.record,
            "record_is_lower_bound": self.record_is_bound,
            "allan": [_allan(one) for one in self.allan],
            "notes": list(self.table.notes),
        }


def _allan(one: AllanResult) -> dict[str, Any]:
    unit = "rad/s" if one.channel.startswith("gyro") else "m/s^2"
    return {
        "channel": one.channel,
        "unit": unit,
        "tau_s": one.tau.tolist(),
        "deviation": one.deviation.tolist(),
        "low": one.low.tolist(),
        "high": one.high.tolist(),
        "terms": [vars(term) for term in one.terms],
        "best_time_s": one.best_time,
        "best_time_is_lower_bound": one.at_end,
    }
