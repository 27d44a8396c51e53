"""Rounds of flights, flown until they tell: first some of every round, more where these leave it open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from planner.errors import StoppedEarly
from planner.nouns.progress import Progress
from planner.spec.model import Spec
from planner.verify.experiment import Experiment, flown_with
from planner.verify.monte_carlo import MonteCarlo, fly, fly_types
from planner.verify.outcome import RequirementOutcome, outcomes
from planner.verify.prediction import Prediction
from planner.verify.rounds import Round
from planner.verify.spreads import Typed, Types, TypeTally, judged
from planner.verify.workers import Run

LOOKS = (2_000, 10_000)
"""So many flights are flown when nobody says how many: the second number where the first leaves it open.

Shares of 95 % are then told apart to 1 %, and to half a percent. Of a promise at its very limit two
looks, each at 95 %, err at most twice as often as one.
"""


@dataclass(frozen=True)
class Pilot:
    """Who flies, and by what: the plan's tree and its types of unit, verify's own foresight, who works."""

    document: Mapping[str, Any]
    types: Types | None
    prediction: Prediction | None
    run: Run
    progress: Progress


@dataclass(frozen=True)
class Flown:
    """One round of flights.

    e: as it was flown; found: by its flights; types: its units as of each type, if spreads are drawn
    foreseen: requirement -> figure by the linear model; stopped: by the user, before all had flown
    """

    e: Experiment
    round: Round
    found: MonteCarlo
    types: TypeTally | None
    foreseen: Mapping[int, float]
    stopped: bool

    def outcomes(self, document: Mapping[str, Any]) -> list[RequirementOutcome]:
        """Its requirements, judged."""
        spec, types = self.e.spec, self.types
        found = [
            replace(o, foreseen=self.foreseen.get(o.index))
            for o in outcomes(self.e, self.found.tally, document, spec, self.round.requirements)
        ]
        if types is None:
            return found
        return [o.over_types(judged(types, o.index, spec.requirement[o.index], spec)) for o in found]


def flown_until_told(e: Experiment, asked: Sequence[Round], flights: int | None, pilot: Pilot) -> list[Flown]:
    """So many flights of every round; None: as many of LOOKS as it takes until no promise is left open.

    When the user stops, those that were done. Raises StoppedEarly when these are none.
    """
    done: list[Flown] = []
    for look in LOOKS if flights is None else (flights,):
        done = _one_look(e, asked, look, pilot, done)
        verdicts = {o.verdict for f in done for o in f.outcomes(pilot.document)}
        if any(f.stopped for f in done) or "broken" in verdicts or "undecided" not in verdicts:
            break
    return done


def _one_look(
    e: Experiment, asked: Sequence[Round], flights: int, pilot: Pilot, before: Sequence[Flown]
) -> list[Flown]:
    """Every round up to so many flights; from where the user stopped on, as they were before."""
    done: list[Flown] = []
    for i, one in enumerate(asked):
        flown = _one_round(e, one, flights, pilot, before[i] if before else None)
        if flown is not None:
            done.append(flown)
        if flown is None or flown.stopped:
            break
    if not done:
        raise StoppedEarly("stopped before the first flights had landed: nothing can be said")
    if flown is None:
        done[-1] = replace(done[-1], stopped=True)  # the next round has none: nothing goes on
    return [*done, *before[len(done) :]]


def _one_round(e: Experiment, one: Round, flights: int, pilot: Pilot, before: Flown | None) -> Flown | None:
    """The flights of one round, beside those flown before; None when the user stopped before the first."""

    def progress(said: str) -> None:
        pilot.progress(f"{said}, curves {one.family}")

    flying = before.e if before else flown_with(e, one.starts, one.family)
    found = fly(flying, flights, pilot.run, progress, before.found.tally if before else None)
    if found is None:
        return None
    typed, stopped = before.types if before else None, found.stopped
    if pilot.types is not None and not stopped:
        more = fly_types(Typed(flying, pilot.types), flights, pilot.run, progress, typed)
        typed, stopped = more or typed, more is None
    foreseen = before.foreseen if before else _foreseen(one, e.spec, pilot.prediction)
    return Flown(flying, one, found, typed, foreseen, stopped)


def _foreseen(one: Round, spec: Spec, prediction: Prediction | None) -> dict[int, float]:
    """Requirement -> figure by the linear model, of those that speak of probability."""
    wanted = [i for i in one.requirements if spec.requirement[i].rule != "worst_case"]
    return {i: prediction.drawn(i, one.family, one.starts) for i in wanted} if prediction else {}
