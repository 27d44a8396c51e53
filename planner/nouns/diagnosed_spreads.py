"""What a unit's data say of spreads that its spec assumes, and what they cost in flight or on a bench."""

from __future__ import annotations

import math
from dataclasses import dataclass

NOISE, WHITE_OF_1_S = "noise", "white_of_1_s"
"""Error and part of `unit.noise`: N per root hertz scatters the mean of t seconds by N/√t, of one by N."""
BUDGETED = ("run_to_run", "in_run", WHITE_OF_1_S)
"""Parts that a diagnosis holds against their budgets, all of a unit together: `budget_exceeded`."""


@dataclass(frozen=True)
class Assumption:
    """A spread that the spec assumes, and what the data say of it, SI (NaN: not determined).

    error: `gyro.bias`, `gyro.noise`; part: `run_to_run`, `in_run`, `white_of_1_s`, `temperature_residual` …
    channel: `gyro_x`, "" for all
    chance: of data that say as much, or more, of a unit that has what is assumed
    """

    error: str
    part: str
    unit: str
    assumed: float | None
    measured: float
    low: float
    high: float
    freedom: float
    channel: str = ""
    chance: float = 1.0


@dataclass(frozen=True)
class SpreadInFlight:
    """What a spread makes of one flight by the requirement's rule, SI: as budgeted, and as measured.

    promised: what a plan promises with the budgets, NaN without a plan
    """

    error: str
    unit: str
    limit: float
    budgeted: float
    measured: float
    promised: float = float("nan")
    worst_case: bool = False

    @property
    def total(self) -> float:
        """What the plan comes to with the measured spread in place of the budget."""
        if self.worst_case:
            return self.promised + self.measured - self.budgeted
        return math.sqrt(max(self.promised**2 + self.measured**2 - self.budgeted**2, 0.0))


@dataclass(frozen=True)
class BudgetExceeded:
    """A spread that is larger than the spec's budget of it, SI. channel: "" for all of the sensor."""

    error: str
    part: str
    measured: float
    low: float
    high: float
    budget: float
    unit: str
    channel: str = ""
    flight: SpreadInFlight | None = None


@dataclass(frozen=True)
class CampaignCost:
    """The shortest campaign with the spec's budgets, and with the spreads that were measured, s.

    after: NaN where no campaign keeps the requirement then; why: that, in words
    """

    before: float
    after: float
    why: str = ""
