"""plan.time_limit binds every stage: an answer that keeps the promise, and what was cut short for it."""

from __future__ import annotations

from planner.information import choose, to_plan
from planner.information.choose import campaign_found
from planner.information.exchange import Judge, shortest
from planner.information.model_of import on_offer
from planner.information.prices import prices_of
from planner.nouns.deadline import Deadline
from planner.nouns.plan import Plan
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


def test_prices_that_time_cuts_short_are_none(monkeypatch):
    """Their searches are told that it is late, and what these found then is not shown."""
    late = []

    def slow(flight, found, parts):
        late.append(found.judge.late())
        object.__setattr__(flight.deadline, "seconds", 0.0)
        late.append(found.judge.late())
        return prices_of(flight, found, parts)

    monkeypatch.setattr(to_plan, "prices_of", slow)
    made = pipeline.plan(loaded(searched()), lambda message: None).plan
    assert late == [False, True]
    assert made.prices == ()
    assert any("prices" in note for note in made.notes if note.startswith("plan.time_limit"))


def test_a_search_by_exact_figures_ends_when_its_time_is_over():
    """It has the campaign that was begun with; each exact figure can take seconds."""
    flight = cases.flight(cases.tree(0))
    offers, promise = on_offer(flight)
    asked = []

    def exactly(n):
        asked.append(n)
        return False

    judge = Judge(promise, exactly=exactly, late=lambda: len(asked) >= 2).loosened(1e9)
    assert shortest(offers, judge, 1000) is None
    assert len(asked) == 2


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


def test_a_thorough_proof_goes_on_where_a_quick_one_ends(monkeypatch):
    """The same campaign, and that none is shorter; of the quick one a note says how to have it."""
    monkeypatch.setattr(choose, "QUICK", (0, 0, 0))
    made = cases.tree(0)

    def planned(proof: str) -> Plan:
        spec = made | {"plan": made["plan"] | {"proof": proof}}
        return pipeline.plan(loaded(spec), lambda message: None).plan

    quick, thorough = planned("quick"), planned("thorough")
    assert not quick.proved
    assert quick.gap > 0.0
    assert thorough.proved
    assert thorough.gap == 0.0
    assert quick.bound_s < thorough.bound_s == thorough.time_s <= quick.time_s
    assert [any("proof: thorough" in note for note in p.notes) for p in (quick, thorough)] == [True, False]
