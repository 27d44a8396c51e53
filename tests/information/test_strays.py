"""What a chamber that strays from record to record makes of steep curves, promised as it flies.

A unit that is 0.05 K warmer in one record than in another reads another value of its curves there, and no
table knows of it: noise that the fit takes for something else. It counts where little noise counts much, as
here: accelerometers that are fitted at 1 g for a cubic, and fly to 80 g.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from planner.campaign import noise
from planner.information import kinds
from planner.information.curves import Curves
from planner.pipelines.promise import FlightOptions, verify
from planner.simulate.campaign import Settings
from planner.verify.families import curves_in
from tests.specs import loaded
from tests.verify.plans import Planned, planned_from
from tests.verify.test_fitted_without_budget import unbudgeted

AT = np.array([-55.0, -31.0, 0.0, 17.5, 49.0])


def verified(one: Planned, flights: int = 0) -> Any:
    options = FlightOptions(flights=flights, through_files=0, curves="all")
    return verify(one.loaded, one.document, options, lambda message: None)


def is_found_out() -> bool:
    return any(f.check == "promise" for f in verified(planned_from(unbudgeted())).recount.faults)


def test_the_planner_counts_on_the_stray_that_is_simulated() -> None:
    assert Settings().temperature_jitter == noise.SOAKED_STRAY_K


@pytest.mark.parametrize("figure", ["largest", "sigma"])
def test_slopes_are_those_of_the_curves_that_verify_draws(figure: str) -> None:
    """Of every family, by differences of its own drawn curves; the mean over families of their squares."""
    tree = unbudgeted()
    tree["unit"]["gyro"]["bias"]["temperature_residual"] |= {"figure": figure}
    spec = loaded(tree).spec
    curves, each = Curves(spec), []
    for family, known in curves.slopes_by_family(AT).items():
        drawn = curves_in(spec, family)["gyro", "bias"]
        many, segment = drawn.drawn(10_000, np.random.default_rng(3)), np.diff(drawn.grid)
        place = np.searchsorted(drawn.grid, AT, side="right") - 1
        wanted = np.sqrt(np.mean((np.diff(many, axis=1) / segment)[:, place] ** 2, axis=0))
        np.testing.assert_allclose(known["gyro.bias"], wanted, rtol=0.06)
        each.append(known["gyro.bias"])
    np.testing.assert_allclose(curves.slopes(AT)["gyro.bias"], np.sqrt(np.mean(np.square(each), axis=0)))
    assert len(each) == 4


def test_what_is_promised_of_every_family_is_what_flies() -> None:
    one = planned_from(unbudgeted())
    found = verified(one, flights=1000)
    assert found.recount.ok, found.recount.faults[:5]
    for flown in found.outcomes:  # 1000 flights tell a root mean square to 2.5 %
        assert flown.at_promise == pytest.approx(one.document["families"][flown.family]["0"], rel=0.075)


def test_a_planner_whose_chambers_keep_still_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(noise, "SOAKED_STRAY_K", 0.0)
    assert is_found_out()


def test_a_family_is_not_promised_what_the_mean_of_all_leaves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kinds, "_strayed", lambda *of: {})
    assert is_found_out()
