"""Samples of a recording in SI and body axes, and the account of what became of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.recordings.column_map import AXES

READ = "read"  # the count of samples that came through
CHANNELS = tuple(f"{sensor}_{axis}" for sensor in ("gyro", "acc") for axis in AXES)


class Columns:
    """Columns of one length: a subclass is a frozen dataclass of arrays, None for what there is not."""

    def __getitem__(self, rows: slice | NDArray[np.bool_]) -> Self:
        return type(self)(*(None if column is None else column[rows] for column in vars(self).values()))


Part = TypeVar("Part", bound=Columns)


def joined(parts: Sequence[Part]) -> Part:
    """Rows one behind the other."""
    together = zip(*(vars(part).values() for part in parts), strict=True)
    columns: list[Any] = [None if c[0] is None else np.concatenate(c) for c in together]
    return type(parts[0])(*columns)


@dataclass(frozen=True)
class Samples(Columns):
    """n consecutive samples.

    time: (n,) s since the first sample of the recording; values: (n, 6) gyros rad/s, accelerometers m/s^2,
    NaN for a sensor that the recording lacks; temperature_degc: (n,), NaN where absent
    reference: (n, 6) or None; label: (n,) names of the plan's steps or None; good: (n,) what may be used
    spike: (n,) what is left out for a spike
    """

    time: Array
    values: Array
    temperature_degc: Array
    reference: Array | None
    label: NDArray[np.str_] | None
    good: NDArray[np.bool_]
    spike: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.time)


@dataclass
class Account:
    """What happened to the samples of a recording: reason -> number; remarks: sentences with places.

    repeats: samples that are the one before to the last digit, which stay
    steps: the shortest and the longest step of the clock, s
    """

    counts: Counter[str] = field(default_factory=Counter)
    repeats: int = 0
    remarks: list[str] = field(default_factory=list)
    steps: tuple[float, float] = (np.inf, 0.0)

    def note(self, remark: str, most: int = 5) -> None:
        """Keep a remark, the first few only; the counts tell the rest."""
        if len(self.remarks) < most and remark not in self.remarks:
            self.remarks.append(remark)
