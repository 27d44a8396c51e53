"""What records tell worse than it is known without them is no reason to refuse: the promise counts it.

Refused is what nothing tells, and, of campaigns that the planner may choose, what motions would tell.
"""

from __future__ import annotations

from typing import Any

import pytest
import yaml

from planner.errors import InputError
from planner.pipelines.planning import exact_plan
from planner.pipelines.planning import plan as plan_of
from planner.pipelines.promise import FlightOptions, verify
from planner.plan.observable_campaign import refuse_what_no_campaign_observes
from tests.specs import SHIPPED, loaded
from tests.verify.plans import planned_from


def turned_about_x_only(limit: str = "20 km", faces: int = 6, **fixed: Any) -> dict[str, Any]:
    """Of the scale factors of the gyros y and z records see the Earth's rate alone."""
    spec: dict[str, Any] = yaml.safe_load((SHIPPED / "small_uav.yaml").read_text(encoding="utf-8"))
    spec["requirement"] = [{"error": "position", "limit": limit, "rule": {"percentile": "95 %"}}]
    spec["tests"]["rates"]["motions"] = 2
    spec["tests"]["static"]["motions"] = faces
    return spec | {"plan": spec["plan"] | ({"fixed": fixed} if fixed else {})}


BY_HAND = {"static": {"temperatures": 5, "repeats": 4}, "rates": {"temperatures": 2, "repeats": 2}}


def test_a_campaign_by_hand_is_promised_as_it_flies_and_remarked() -> None:
    spec = turned_about_x_only(**BY_HAND)
    made = plan_of(loaded(spec), lambda message: None).plan
    assert any("cannot tell gyro.scale_factor (y, z)" in note for note in made.notes)
    one = planned_from(spec)
    options = FlightOptions(flights=600, through_files=0, curves="cosines")
    found = verify(one.loaded, one.document, options, lambda message: None)
    assert found.recount.ok
    (flown,) = found.outcomes
    assert flown.at_promise == pytest.approx(one.document["families"]["cosines"]["0"], rel=0.12)


def test_what_nothing_tells_is_refused_of_hands_too() -> None:
    with pytest.raises(InputError, match="the records cannot tell"):
        exact_plan(loaded(turned_about_x_only(faces=1, **BY_HAND)))


def test_what_motions_would_tell_is_asked_of_a_campaign_that_is_chosen() -> None:
    with pytest.raises(InputError, match="the unit never turns about y"):
        exact_plan(loaded(turned_about_x_only()))


def test_no_motions_are_asked_for_where_references_err() -> None:
    """Misalignments to 0.5 deg on a table that a unit is put on to 1 deg: more turns tell them no better."""
    spec = yaml.safe_load((SHIPPED / "small_uav.yaml").read_text(encoding="utf-8"))
    spec["benches"]["rate_table"]["accuracy"] = {"mounting": "1 deg"}
    refuse_what_no_campaign_observes(loaded(spec).spec)
