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


def chunks_of(flights: int, flown: int = 0) -> list[tuple[int, int]]:
    """(number, size): all of CHUNK but the last, whoever works; without those that have flown before."""
    chunks = [(i, min(CHUNK, flights - start)) for i, start in enumerate(range(0, flights, CHUNK))]
    return chunks[flown // CHUNK :]


def fly_types(
    typed: Typed, flights: int, run: Run, progress: Progress, before: TypeTally | None = None
) -> TypeTally | None:
    """The same units as of every type, beside those flown before; None when the user stopped it."""
    done = [] if before is None else [before]
    try:
        for tally in run(run_types, typed, chunks_of(flights, sum(t.flights for t in done))):
            done.append(tally)
            progress(f"{sum(t.flights for t in done)} of {flights} units as of every type")
    except KeyboardInterrupt:
        return None
    return all_types(done)


def fly(
    e: Experiment, flights: int, run: Run, progress: Progress, before: Tally | None = None
) -> MonteCarlo | None:
    """All flights, or those that were done when the user stopped it; None when none was.

    before: those flown already, in whole chunks: the sum is, to the last bit, that of one run.
    """
    done = [] if before is None else [before]
    stopped = False
    try:
        for tally in run(run_chunk, e, chunks_of(flights, sum(t.flights for t in done))):
            done.append(tally)
            flown = sum(t.flights for t in done)
            progress(f"{flown} of {flights} campaigns with flights")
    except KeyboardInterrupt:
        stopped = True
    return MonteCarlo(total(done), flights, stopped) if done else None
