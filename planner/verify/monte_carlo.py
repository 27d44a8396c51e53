"""Campaigns, calibrations and flights by the thousand: chunks out, one tally in, stopped at any moment."""

from __future__ import annotations

from dataclasses import dataclass

from planner.nouns.progress import Progress
from planner.verify.experiment import CHUNK, Experiment, run_chunk
from planner.verify.spreads import Typed, TypeTally, run_types
from planner.verify.spreads import total as all_types
from planner.verify.tally import Tally, total
from planner.verify.workers import Run


@dataclass(frozen=True)
class MonteCarlo:
    """What the flights found; stopped: by the user, before all of them had flown."""

    tally: Tally
    wanted: int
    stopped: bool


def chunks_of(flights: int) -> list[tuple[int, int]]:
    """(number, size): all of CHUNK but the last, whatever the number of workers."""
    return [(i, min(CHUNK, flights - start)) for i, start in enumerate(range(0, flights, CHUNK))]


def fly_types(typed: Typed, flights: int, run: Run, progress: Progress) -> TypeTally | None:
    """The same units as of every type; None when the user stopped it."""
    done: list[TypeTally] = []
    try:
        for tally in run(run_types, typed, chunks_of(flights)):
            done.append(tally)
            progress(f"{sum(t.flights for t in done)} of {flights} units as of every type")
    except KeyboardInterrupt:
        return None
    return all_types(done)


def fly(e: Experiment, flights: int, run: Run, progress: Progress) -> MonteCarlo | None:
    """All flights, or those that were done when the user stopped it; None when none was."""
    done: list[Tally] = []
    stopped = False
    try:
        for tally in run(run_chunk, e, chunks_of(flights)):
            done.append(tally)
            flown = sum(t.flights for t in done)
            progress(f"{flown} of {flights} campaigns with flights")
    except KeyboardInterrupt:
        stopped = True
    return MonteCarlo(total(done), flights, stopped) if done else None
