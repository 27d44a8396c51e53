"""The power-ons of a campaign: their records, at known conditions, power-on by power-on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.campaign.design import Design
from planner.campaign.reference_errors import reference_errors
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Sensor
from planner.response import Acting, response
from planner.spec.model import Spec


@dataclass(frozen=True)
class PowerOns:
    """n records of one unit in g power-ons, the records of one power-on together.

    conditions: of every record; duration: (n,) s; starts: (g,) first record of every power-on
    counts: (g,) how often each is made: 1 in measured data, repeats in a plan; 0: not used
    bench: (n,) names, installation: (n,) which installation of the unit; None where nobody says
    misplaced: (n, 3, 2, 3) of `reference_errors`; None: nobody knows the motions
    """

    conditions: Conditions
    duration: Array
    starts: NDArray[np.int64]
    counts: Array
    bench: NDArray[np.str_] | None = None
    installation: NDArray[np.int64] | None = None
    misplaced: Array | None = None

    def __len__(self) -> int:
        return len(self.duration)

    @cached_property
    def sizes(self) -> NDArray[np.int64]:
        """(g,) records of every power-on."""
        return np.diff(np.append(self.starts, len(self)))

    @cached_property
    def on_day(self) -> Array:
        """(n,) day on which each record's power-on began: what walks in store stands while the unit is on."""
        return np.repeat(self.conditions.day[self.starts], self.sizes)

    @cached_property
    def known_duration(self) -> Array:
        """(n,) s; all alike where the data do not say how long a record was."""
        if len(self) == 0 or self.duration.min() <= 0:
            return np.ones(len(self))
        return self.duration

    def response(self, sensor: Sensor, acting: Sequence[Acting]) -> Array:
        """(n, 3) what a unit reads in every record without noise, SI."""
        return response(sensor, self.conditions, acting)


def of_table(table: DwellTable) -> PowerOns:
    """The power-ons of a dwell table whose rows stand power-on by power-on, in the order of their time."""
    starts = np.flatnonzero(np.append(True, np.diff(table.run) != 0)).astype(np.int64)
    return PowerOns(table.conditions(), table.duration, starts, np.ones(len(starts)), table.bench)


def of_design(design: Design, spec: Spec | None = None) -> PowerOns:
    """The power-ons that a plan's steps make of one unit, each once; spec: None where no bench errs."""
    starts = design.starts.astype(np.int64)
    return PowerOns(
        design.conditions,
        design.duration,
        starts,
        np.ones(len(starts)),
        design.bench,
        design.installation,
        None if spec is None else reference_errors(design.asked, design.bench.tolist(), spec),
    )
