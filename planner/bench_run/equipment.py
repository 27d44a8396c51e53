"""What a campaign is run with."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from planner.bench_run.clock import Clock
from planner.bench_run.interrupts import Stop
from planner.bench_run.line import Line
from planner.bench_run.people import NoRecorder, Operator, Recorder
from planner.bench_run.tolerances import Tolerances
from planner.control.dialect import ChamberDialect, TableDialect
from planner.control.dialect_files import chamber_dialect, table_dialect
from planner.nouns.step import Step

Say = Callable[[str], None]
Notify = Callable[[str, str], None]  # (event, words): person, attention
Dialects = Mapping[str, tuple[TableDialect, ChamberDialect]]  # bench -> of its table, of its chamber


@dataclass(frozen=True)
class BenchLines:
    """The lines to one bench, None where it has no such device, and the dialects spoken over them."""

    table: Line | None = None
    chamber: Line | None = None
    table_dialect: TableDialect = field(default_factory=table_dialect)
    chamber_dialect: ChamberDialect = field(default_factory=chamber_dialect)


@dataclass(frozen=True)
class Equipment:
    """Lines by bench, and what all benches have in common.

    week: () -> seconds from Monday 00:00 now; None: as planned, from the session's first step on
    stop: what somebody has told the run; patience_s: how long a bench is tried to be made safe when nobody
    says to give up
    """

    benches: Mapping[str, BenchLines]
    clock: Clock
    recorder: Recorder = field(default_factory=NoRecorder)
    operator: Operator | None = None
    tolerances: Tolerances = field(default_factory=Tolerances)
    week: Callable[[], float] | None = None
    stop: Stop = field(default_factory=Stop)
    patience_s: float = 3600.0
    notify: Notify = lambda event, words: None

    def gives_up(self, tried_s: float) -> bool:
        """Whether to stop trying to make a bench safe."""
        return self.stop.told or tried_s >= self.patience_s


@dataclass(frozen=True)
class Finished:
    """What a run did: steps and records made in this session, records void, and its length on the clock."""

    steps: int
    records: int
    seconds: float
    void: int = 0


@dataclass(frozen=True)
class Status:
    """Where a run is: what it makes, how much is left by the plan, what the bench reads.

    attended: the next step that people are needed for, and in how many planned seconds
    """

    bench: str
    step: Step
    done: int
    steps: int
    left_s: float
    attended: Step | None = None
    attended_in_s: float = 0.0
    temperature_degc: float | None = None
    angles: Mapping[int, float] = field(default_factory=dict)
