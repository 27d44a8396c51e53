"""The campaign that loads a promise least, found and foreseen with no more work than it takes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import planner.information.exact
from planner.errors import InfeasibleError
from planner.information.choose import _Kept, _mended, keeps_exactly
from planner.information.easiest import _least
from planner.information.even import even, most_repeats
from planner.information.exact import _made, foreseen, laid_out
from planner.information.exchange import Judge
from planner.information.model_of import on_offer
from planner.nouns.array import Array
from planner.nouns.choices import TestVisits
from tests.information import cases
from tests.information.test_refusals import found, small

FAMILIES = ("cosines", "kink", "cubic", "matern")


@pytest.mark.parametrize("binding", [0, 3])
def test_the_least_of_all_families_is_found_by_one_and_a_few(binding: int) -> None:
    """Campaigns (B, 1) are numbers of rows of a table of loads; one is asked for a family at most twice."""
    loads = 1.0 + np.random.default_rng(3).random((300, len(FAMILIES)))
    loads[:, binding] += 0.3
    asked = 0

    def by_family(counts: Array, families: Sequence[str]) -> Array:
        nonlocal asked
        asked += counts.size * len(families)
        return loads[counts[:, 0].astype(int)][:, [FAMILIES.index(f) for f in families]]

    best, own = _least(np.arange(300.0)[:, None], by_family, FAMILIES, binding)
    assert best == np.argmin(loads.max(axis=1))
    np.testing.assert_array_equal(own, loads[best])
    assert asked < 0.5 * loads.size


def test_a_refusal_asks_no_campaign_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their steps are laid out and foreseen with all records that the spec allows: seconds each."""
    asked = Counter[tuple[TestVisits, ...]]()

    def counted(flight: Any, visits: Sequence[TestVisits], **how: Any) -> Any:
        asked[tuple(visits)] += 1
        return laid_out(flight, visits, **how)

    monkeypatch.setattr(planner.information.exact, "laid_out", counted)
    made = small()
    made["requirement"] = [made["requirement"][0] | {"error": e, "limit": "1 mm"} for e in ("north", "east")]
    with pytest.raises(InfeasibleError, match=r"2 \(east within"):
        found(made)
    assert asked
    assert max(asked.values()) == 1


def test_power_ons_that_tell_the_same_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """With hundreds of them, of one kind and nearly one day, the promise is that of each for itself."""
    flight = cases.flight(small())
    steps = laid_out(flight, [TestVisits("static", (-20.0, 20.0), (200, 600))], first_only=True)
    counted, together = _made(flight, steps).runs.counts, foreseen(flight, steps)
    monkeypatch.setattr(planner.information.exact, "alike_together", lambda runs, spec: runs)
    every, alone = _made(flight, steps).runs.counts, foreseen(flight, steps)
    assert len(counted) < 450 < 800 == len(every) == counted.sum()
    assert together.days == alone.days
    np.testing.assert_allclose(together.figures, alone.figures, rtol=1e-5)


def test_a_search_that_is_cut_short_mends_what_it_found() -> None:
    """Else its answer were the campaign that it began with: all repeats of all tests."""
    made = small()
    made["plan"]["repeats"] = {"least": 1, "most": 60}
    made["requirement"][0]["limit"] = "173.0 m"  # by quick figures 174.5 by one repeat, 172.4 by sixty
    flight = cases.flight(made)
    offers, promise = on_offer(flight)
    few = even(offers, 3)
    judge = Judge(promise, families=[*promise.families])
    assert judge.loads(few[None])[0] > 1.0
    begun = _Kept(most_repeats(offers, few), judge)
    mended = _mended(flight, offers, judge, few, begun)
    assert mended is not None
    assert keeps_exactly(flight, offers, judge, mended.counts)
    assert offers.cost(mended.counts[None])[0] < 0.5 * offers.cost(begun.counts[None])[0]
