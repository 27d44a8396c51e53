"""What came of a recording: the dwell table, and for every stretch of it what became of it and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from planner.dwells.table_rows import together
from planner.nouns.dwell_table import DwellTable
from planner.recordings.allan import AllanResult
from planner.recordings.clocks import Clock
from planner.recordings.coloured_noise import NoiseOfSamples
from planner.recordings.recording import Recording
from planner.recordings.rests import Segment
from planner.recordings.samples import Account
from planner.recordings.segments_to_rows import Row
from planner.recordings.windows import Windows


@dataclass(frozen=True)
class ScannedFile:
    """One recording in windows, with its rests and motions; rate: Hz; name: of the file and power-on."""

    recording: Recording
    unit: str
    run: int
    rate: float
    windows: Windows
    segments: tuple[Segment, ...]
    account: Account
    name: str = ""


@dataclass(frozen=True)
class LeftOut:
    """A stretch that gave no row, and why. start, end: s since the first sample."""

    unit: str
    run: int
    kind: str
    start: float
    end: float
    samples: int
    reason: str


@dataclass(frozen=True)
class Reduction:
    """The dwell table with its account.

    counts: file -> reason -> number of samples or bytes that were left out while reading, and `read`, the
        number of samples that came through
    allan: of the longest rest; record: s, the best averaging time of one dwell, None when no rest tells;
    record_is_bound: the recording is too short to show the minimum, so longer may be better
    snippet: the line of a spec's test that says so, such as `record: 120 s`
    clocks: file -> its clock, where it jitters
    noise: white and coloured, of the samples of the longest rest
    motions: hand turns between rests, in pieces of a few degrees: what the gyros turned in each
    """

    table: DwellTable
    rows: tuple[Row, ...]
    left_out: tuple[LeftOut, ...]
    counts: Mapping[str, Mapping[str, int]]
    allan: tuple[AllanResult, ...]
    record: float | None
    record_is_bound: bool
    snippet: str | None
    rates_hz: Mapping[str, float]
    clocks: Mapping[str, Clock] = field(default_factory=dict)
    motions: DwellTable | None = None
    noise: tuple[NoiseOfSamples, ...] = ()

    @property
    def whole(self) -> DwellTable:
        """The rests and the hand turns between them, in order of time, told apart by `kind`."""
        return self.table if self.motions is None else together(self.table, self.motions)
