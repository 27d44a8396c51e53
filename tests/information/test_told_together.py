"""What a campaign tells at a temperature is told at once: the same promise with fewer kinds of power-on."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.information.distinct import distinct
from planner.information.even import even
from planner.information.exact import _kinds, _made, laid_out
from planner.information.model_of import Flight, asked_of, on_offer, promise_of
from planner.plan.spec_to_trajectory import trajectory_of
from tests.information import cases
from tests.information.test_means_misread import misread
from tests.specs import ROOT, loaded


def _flights() -> dict[str, Flight]:
    from planner.information.model_of import flight_of

    spec = misread()
    thermometers = flight_of(loaded(spec).spec, trajectory_of(spec["trajectory"], ROOT))
    return {"thermometers": thermometers} | {
        str(seed): cases.flight(cases.tree(seed)) for seed in (3001, 3004, 3007)
    }


@pytest.mark.parametrize("name", ["thermometers", "3001", "3004", "3007"])
def test_sums_at_a_temperature_promise_what_every_power_on_does(name: str) -> None:
    flight = _flights()[name]
    offers, _ = on_offer(flight)
    for temperatures, repeats in ((1, 3), (3, 2), (4, 4)):
        visits = offers.visits(repeats * even(offers, temperatures))
        made = _made(flight, laid_out(flight, visits, first_only=True))
        each, wanted = _kinds(flight, made), asked_of(flight, exact=True, days=3.0)
        together = each.together(made.runs.counts)
        assert len(together.kinds) < len(each.kinds)
        alone = promise_of(flight, each, wanted).figures(made.runs.counts[None])
        summed = promise_of(flight, together, wanted).figures(np.ones((1, len(together.kinds))))
        assert np.all(np.isfinite(alone))
        assert summed == pytest.approx(alone, rel=1e-7)


def test_benches_whose_thermometers_differ_stay_apart() -> None:
    flight = _flights()["thermometers"]
    offers, _ = on_offer(flight)
    made = _made(flight, laid_out(flight, offers.visits(2 * even(offers, 2)), first_only=True))
    kinds = _kinds(flight, made)
    known = {(k.temperature_degc, k.bench) for k in kinds.kinds}
    assert {(k.temperature_degc, k.bench) for k in kinds.together(made.runs.counts).kinds} == known


@given(st.lists(st.lists(st.integers(0, 70_000), min_size=5, max_size=5), min_size=1, max_size=40))
def test_campaigns_each_once_are_those_of_numpy(counts: list[list[int]]) -> None:
    every = np.array(counts, dtype=float)
    assert np.array_equal(distinct(list(every)), np.unique(every, axis=0))
