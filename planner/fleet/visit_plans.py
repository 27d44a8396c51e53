"""What is planned for a unit in store: its visits, their schedule, the shortest visit that suffices."""

from __future__ import annotations

from dataclasses import dataclass

from planner.fleet.store import Visit
from planner.nouns.array import Array

ROUNDING = 1e-9  # of the limit


@dataclass(frozen=True)
class PlannedVisit:
    """One visit of a schedule. load_before, load_after: share of the limit; renewed: names of the terms."""

    day: float
    visit: Visit
    load_before: float
    load_after: float
    renewed: tuple[str, ...]


@dataclass(frozen=True)
class StorePlan:
    """The schedule of one unit.

    visits: empty when none is needed; hours_s: of all visits; kept_until: last day within the limits whole:
    whether the visits carry it to the end; proved: no visits cost less (or none carry it further); load:
    (W,) share of the limit over the days, with the visits; without: (W,) without them; binding: terms with
    the largest shares at the end of what can be kept
    """

    unit: str
    days: Array
    visits: tuple[PlannedVisit, ...]
    time_s: float
    kept_until: float
    whole: bool
    load: Array
    without: Array
    binding: tuple[tuple[str, float, bool], ...]
    constraint: int
    proved: bool = True

    @property
    def overdue(self) -> bool:
        """Whether it is past its limit today already."""
        return bool(self.without[0] > 1.0 + ROUNDING)


@dataclass(frozen=True)
class ShortestVisit:
    """The shortest visit on a day that keeps a unit within its limits until another; None: no visit does."""

    unit: str
    day: float
    until: float
    visit: Visit | None
    load_without: float
    load_with: float
    renewed: tuple[str, ...]
