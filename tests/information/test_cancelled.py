"""What one coefficient's estimate adds and another's takes away: no campaign is chosen that relies on it.

A gyro's scale factor and what follows the load are seen under 1 g together, to a ten-thousandth, and each to
half of itself; the plan had promised 0.32 deg of a foreign spec, and 43 deg flew. On a table, where |f| is g
however it turns, nothing tells them apart.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml

from planner.errors import InputError
from planner.information.cancelled import leaves_products_small, taken_away
from planner.information.choose import campaign_found, condition_of
from planner.information.model_of import Flight, flight_of, on_offer
from planner.information.offers import Offers
from planner.information.promise import Promise
from planner.information.told import told
from planner.nouns.array import Array
from planner.plan.spec_to_trajectory import trajectory_of
from tests.specs import SHIPPED, loaded


def offered(*, loads: bool = True, **plan: object) -> tuple[Flight, Offers, Promise]:
    """high_g.yaml in a flight that turns at 1 g, with a second test on its arm, of a tenth of that."""
    spec = yaml.safe_load((SHIPPED / "high_g.yaml").read_text(encoding="utf-8"))
    spec["trajectory"] = "helicopter"
    spec["requirement"] = [{"error": "position", "limit": "25 m", "rule": "rss"}]
    small = [{"acceleration": f"{load} g"} for load in (0.1, -0.1, 0.2, -0.2)] * 6
    spec["tests"]["small_loads"] = spec["tests"]["loads"] | {"motions": small}
    if not loads:
        spec["tests"].pop("loads")
    found = loaded(spec | {"plan": spec["plan"] | plan})
    flight = flight_of(found.spec, trajectory_of(found.spec.trajectory, found.folder))
    return flight, *on_offer(flight)


def made(offers: Offers, *tests: str) -> Array:
    """Of some tests three at every other temperature on offer."""
    counts = np.zeros(len(offers.kinds))
    for test in tests:
        counts[[i for i, k in enumerate(offers.kinds) if k.test == test][::2]] = 3.0
    return counts


@pytest.fixture(scope="module", name="one")
def _one() -> tuple[Flight, Offers, Promise]:
    return offered(redundancy=0)


def test_nothing_is_taken_away_of_what_is_told_by_itself(one: tuple[Flight, Offers, Promise]) -> None:
    """By dense algebra of the channels' covariances, at every temperature; and less with more records."""
    _, offers, promise = one
    for tests in (("static", "rates", "small_loads"), ("static", "rates", "loads")):
        counts = made(offers, *tests)
        away = taken_away(promise, counts[None])[0, 0]
        assert away == pytest.approx(_densely(promise, counts), rel=1e-6)
        assert taken_away(promise, 4.0 * counts[None])[0, 0] <= away


def _densely(promise: Promise, counts: Array) -> float:
    """Channel by channel and term by term, with loops."""
    found = 0.0
    for group in promise._groups:
        known, seen = told(group.alike, counts[None]), group.seen_from[0]
        R = seen.reads(known)[:, 0]
        for r, C in zip(R, known.covariance[:, 0], strict=True):
            for at in r:
                together = np.trace(at @ C @ at.T)
                for place in known.places:
                    own = np.trace(at[:, place] @ C[place, place] @ at[:, place].T)
                    found = max(found, own - together)
    return float(np.sqrt(found))


def test_on_a_table_alone_nothing_tells_the_load_from_the_scale_factor(
    one: tuple[Flight, Offers, Promise],
) -> None:
    """Turns about level and upright axes had: |f| was taken for that of the mean force of a record."""
    _, offers, promise = one
    untold = promise.untold(made(offers, "static", "rates"))
    assert untold.keys() == {"gyro.scale_factor", "gyro.scale_factor_acceleration"}


def test_small_loads_tell_only_what_load_and_scale_factor_add_together(
    one: tuple[Flight, Offers, Promise],
) -> None:
    flight, offers, promise = one
    at_1_g = made(offers, "static", "rates", "small_loads")
    every = made(offers, "static", "rates", "small_loads", "loads")
    assert not promise.untold(at_1_g)
    assert leaves_products_small(promise, every)
    assert not leaves_products_small(promise, at_1_g)
    allowed = condition_of(flight, promise)
    assert allowed(every)
    assert not allowed(at_1_g)


def test_it_is_asked_only_where_some_campaign_keeps_it() -> None:
    flight, offers, promise = offered(loads=False, redundancy=0)
    strict = replace(promise, asked=tuple(replace(a, limit=1e-4 * a.limit) for a in promise.asked))
    counts = made(offers, "static", "rates", "small_loads")
    assert not leaves_products_small(strict, counts)
    assert condition_of(flight, strict)(counts)  # the limits refuse it, not this


def test_a_campaign_by_hand_that_relies_on_it_is_refused() -> None:
    """A few loads of 0.1 g, whatever the limit: what is promised is a small difference."""
    fixed = {
        "static": {"temperatures": 7, "repeats": 4},
        "rates": {"temperatures": 1, "repeats": 2},
        "small_loads": {"repeats": 2},
    }
    with pytest.raises(InputError, match="only together"):
        campaign_found(offered(loads=False, redundancy=0, fixed=fixed)[0])
