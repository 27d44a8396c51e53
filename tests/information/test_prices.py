"""What room in the limits is worth, against plans of wider limits."""

from __future__ import annotations

import numpy as np

from planner.information.choose import campaign_found
from planner.information.prices import ROOM, _Room
from planner.information.scaled import with_limits
from tests.information import cases

SEED = 4


def test_wider_limits_are_worth_what_their_own_plan_saves() -> None:
    tree = cases.tree(SEED)
    every = cases.Everything(cases.flight(tree))
    quick = every.quick(every.counts())
    limits = np.quantile(quick[np.all(np.isfinite(quick), axis=1)], 0.2, axis=0)
    flight = cases.flight(cases.limited(tree, limits))
    found = campaign_found(flight)
    room = _Room.of(found)
    for factor in ROOM:
        planned = campaign_found(flight.under(with_limits(flight.spec, factor)), effort="brief")
        assert planned.cost < found.cost
        assert room.saved(factor) >= found.cost - planned.cost - 1.0
