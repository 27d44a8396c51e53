"""What units are held against, and the answer for their recalibration in store."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date

from planner.fleet.allowed_region import AllowedRegion
from planner.fleet.growth import Growth
from planner.fleet.sessions import Session
from planner.fleet.store import StoreBench
from planner.fleet.visit_plans import ShortestVisit, StorePlan
from planner.nouns.allowances import ErrorModel
from planner.nouns.sensitivities import Constraint
from planner.spec.load import LoadedSpec


@dataclass(frozen=True)
class Basis:
    """What units are held against: the plan's allowed region, the spec's errors and requirements."""

    loaded: LoadedSpec
    region: AllowedRegion
    models: tuple[ErrorModel, ...]
    constraints: tuple[Constraint, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Recalibrated:
    """Recalibrations in store of every unit: `spec` when there is no history.

    growth, renewable: of the first unit
    shortest: the shortest visit on the day a unit is due, for later and later days; start: the calendar date
    of day 0; today: a day of the same count; sessions: days on which units of a fleet come together
    """

    basis: Basis
    bench: StoreBench
    growth: Growth
    plans: tuple[StorePlan, ...]
    shortest: tuple[ShortestVisit, ...]
    renewable: tuple[bool, ...]
    start: date | None
    notes: tuple[str, ...] = ()
    today: float = 0.0
    sessions: tuple[Session, ...] = ()
