"""As many flights as it takes: more where the first leave a promise open, and what stopping them leaves."""

from __future__ import annotations

import numpy as np
import pytest

from planner.pipelines import promise
from planner.pipelines.promise import FlightOptions, verify
from planner.verify import flown
from planner.verify.spreads import run_types
from planner.verify.workers import here
from tests.verify.plans import planned_from
from tests.verify.test_promise import quartered, tight
from tests.verify.test_spreads import estimated

LOOKS = (200, 500)


@pytest.fixture(name="few")
def _few(monkeypatch):
    """The rule is that of two larger numbers: flights cost time."""
    monkeypatch.setattr(flown, "LOOKS", LOOKS)
    monkeypatch.setattr(promise, "LOOKS", LOOKS)


def verified(one, document=None, **options):
    """Without files; flights are as the options say, or as many as it takes."""
    asked = FlightOptions(through_files=0, **options)
    return verify(one.loaded, document or one.document, asked, lambda message: None)


def known(limit: str) -> dict:
    """The campaign by hand, of spreads that are no estimates."""
    tree = estimated(4, limit)
    bias = tree["unit"]["accelerometer"]["bias"]
    bias["run_to_run"] = bias["run_to_run"]["value"]
    return tree


def test_a_promise_left_open_is_flown_on_as_in_one_run(few):
    """A plan whose rule is exact keeps its promise by a hair: 200 flights cannot tell."""
    one = planned_from(tight())
    assert verified(one, flights=LOOKS[0]).verdict == "undecided"
    found, at_once = verified(one), verified(one, flights=LOOKS[1])
    assert found.flights == found.wanted == LOOKS[1]
    assert f"{LOOKS[0]} flights left it open: flown on to {LOOKS[1]}" in found.notes
    for by_looks, by_one in zip(found.outcomes, at_once.outcomes, strict=True):
        np.testing.assert_array_equal(by_looks.lengths, by_one.lengths)
        assert by_looks.rms == by_one.rms


@pytest.mark.parametrize(("limit", "verdict"), [("900 m", "kept"), ("60 m", "broken")])
def test_a_promise_that_the_first_flights_tell_is_flown_no_further(few, limit, verdict):
    """A campaign by hand, far from either limit."""
    found = verified(planned_from(estimated(4, limit)))
    assert found.verdict == verdict
    assert found.flights == found.wanted == LOOKS[0]
    assert not any("left it open" in note for note in found.notes)


def test_a_cut_plan_is_flown_no_further(few):
    """It is not what it says, whatever flies: 200 flights with a quarter of the repeats leave that open."""
    one = planned_from(tight())
    found = verified(one, quartered(one.document))
    assert found.verdict == "broken"
    assert found.flights == LOOKS[0]


def test_stopping_between_two_rounds_says_so_and_flies_no_further(few, monkeypatch):
    """The second family has no flights yet, the first leaves the promise open: that is no call for more."""
    asked = []

    def stopped(function, shared, chunks):
        asked.append(chunks)
        if len(asked) == 2:
            raise KeyboardInterrupt
        yield from here(function, shared, chunks)

    monkeypatch.setattr(promise, "runner", lambda workers, cluster: stopped)
    loose = planned_from(known("900 m")).document["families"]
    limit = f"{1.02 * max(figures['0'] for figures in loose.values()):.1f} m"
    found = verified(planned_from(known(limit)), curves="all")
    assert found.stopped
    assert len(found.families) == 1 < len(loose)
    assert found.verdict == "undecided"
    assert found.flights == LOOKS[0]
    assert len(asked) == 2


def test_stopping_among_the_types_says_so(few, monkeypatch):
    """Before, the flights of the stated spread alone gave a verdict, and exit 0, as if all were done."""

    def stopped(function, shared, chunks):
        if function is run_types:
            raise KeyboardInterrupt
        yield from here(function, shared, chunks)

    monkeypatch.setattr(promise, "runner", lambda workers, cluster: stopped)
    found = verified(planned_from(estimated(4, "900 m")))
    assert found.stopped
    assert found.outcomes[0].types is None
