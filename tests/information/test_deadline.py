"""plan.time_limit binds every stage: an answer that keeps the promise, and what was cut short for it."""

from __future__ import annotations

from planner.information.choose import campaign_found
from planner.nouns.deadline import Deadline
from planner.pipelines import planning as pipeline
from tests.information import cases
from tests.specs import loaded
from tests.verify.plans import flown


def searched() -> dict:
    """Everything is the planner's to choose, at any moment of the flight."""
    rule = {"percentile": "90 %"}
    wanted = [{"error": "position", "limit": "400 m", "rule": rule, "at": "any"}]
    return flown(requirement=wanted)


def test_no_time_at_all_still_gives_a_campaign_that_keeps_the_promise():
    spec = searched()
    spec["plan"] = spec["plan"] | {"time_limit": "0.001 s"}
    made = pipeline.plan(loaded(spec), lambda message: None).plan
    assert not made.complete
    assert all(r.met for r in made.requirements)
    (said,) = (note for note in made.notes if note.startswith("plan.time_limit"))
    assert all(stage in said for stage in ("the search", "the genetic campaign", "prices"))
    assert made.genetic is None
    assert made.gap > 0.0


def test_published_planning_keeps_within_its_time():
    spec = flown()
    spec["plan"] = spec["plan"] | {"time_limit": "1 s", "genetic": {"generations": 100_000}}
    made = pipeline.plan(loaded(spec), lambda message: None).plan
    assert all(r.met for r in made.requirements)
    assert made.genetic is None or made.genetic.history.stopped in ("time", "converged")


def test_who_has_time_is_told_nothing():
    flight = cases.flight(cases.tree(0))
    campaign_found(flight)
    assert not flight.deadline.cut
    assert Deadline(0.0).over(1.0, "this")
