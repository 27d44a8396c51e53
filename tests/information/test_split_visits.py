"""Where soaks cost nothing repeats are best made at temperatures of their own: a visit is split.

A campaign for least power-on time, a test at five temperatures 2, 2, 2, 1 and 1 times, was the shortest
found; six temperatures and seven power-ons keep the promise, and no step led there.
"""

from __future__ import annotations

import numpy as np

from planner.information.model_of import on_offer
from planner.information.neighbours import Neighbours
from tests.information import cases


def test_a_repeat_goes_to_any_temperature_that_its_test_does_not_visit() -> None:
    tree = cases.tree(3)
    tree["plan"]["repeats"] = {"least": 1, "most": 3}
    offers, _ = on_offer(cases.flight(tree))
    places = next(
        o.places for o in offers.tests if o.fixed is None and not o.everywhere and len(o.places) > 2
    )
    n = np.zeros(len(offers.kinds))
    n[places[0]] = 2.0
    near = {one.tobytes() for one in Neighbours(offers).of(n)}
    for to in places[1:]:
        split = n.copy()
        split[[places[0], to]] = 1.0
        assert split.tobytes() in near
