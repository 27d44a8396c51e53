"""Spreads that are estimates: types of unit with true spreads of their own."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest

from planner.pipelines.promise import FlightOptions, verify
from planner.spec.budget import RunToRun
from planner.verify.experiment import CHUNK, experiment, units_left
from planner.verify.flights import exact_coefficients, lengths_of, vectors_of
from planner.verify.spreads import TYPES, Typed, TypeTally, judged, run_types, types_of
from tests.specs import loaded
from tests.verify.plans import planned_from, several


def estimated(power_ons: int, limit: str = "220 m") -> dict:
    """One error that matters, its spread from a few power-ons; a campaign by hand."""
    spec = several()
    wanted = [spec["requirement"][0] | {"limit": limit, "temperature": "flight"}]
    unit = copy.deepcopy(spec["unit"])
    bias = unit["accelerometer"]["bias"]
    unit["accelerometer"]["bias"] = bias | {
        "run_to_run": {"value": bias["run_to_run"], "power_ons": power_ons}
    }
    fixed = {"static": {"temperatures": 3, "repeats": 2}, "rates": {"temperatures": 1, "repeats": 2}}
    plan = spec["plan"] | {"fixed": fixed, "method": "information", "confidence": "90 %"}
    return spec | {"requirement": wanted, "unit": unit, "plan": plan}


@pytest.mark.parametrize("power_ons", [2, 12])
def test_true_spreads_are_scaled_inverse_chi_squared(power_ons):
    """(n − 1) s² / s_true² is χ²(n − 1): mean and variance within five standard errors."""
    found = types_of(loaded(estimated(power_ons)).spec, 3)
    assert found.errors == (("accelerometer", "bias"),)
    freedom = power_ons - 1
    chi = freedom / found.factors[:, 0] ** 2
    assert chi.mean() == pytest.approx(freedom, abs=5.0 * np.sqrt(2.0 * freedom / TYPES))


def test_without_power_ons_there_are_no_types():
    assert types_of(loaded(several()).spec, 1).errors == ()


def test_a_type_is_flown_as_a_unit_of_its_spread():
    """d₀ + (f − 1) d_e is what units of the spread f s do, whose estimator knows the stated one."""
    one = planned_from(estimated(12))
    e = experiment(one.document, one.loaded.spec, one.trajectory, seed=2)
    types = replace(types_of(e.spec, 1), factors=np.array([[1.0], [2.0]]))
    found = run_types(Typed(e, types), 0, CHUNK)
    budget = e.unit.budgets["accelerometer", "bias"]
    stated = budget.run_to_run
    assert isinstance(stated, RunToRun)
    doubled = stated.model_copy(update={"value": replace(stated.value, si=2.0 * stated.value.si)})
    budgets = e.unit.budgets | {("accelerometer", "bias"): budget.model_copy(update={"run_to_run": doubled})}
    for k, unit in enumerate((e.unit, replace(e.unit, budgets=budgets))):
        own = replace(e, unit=unit)
        coefficients = exact_coefficients(e.flight, units_left(own, 0, CHUNK))
        d = vectors_of(e.flight.linear, e.flight.instants, e.requirements[0]) @ coefficients.T
        # products of errors, one in a thousand each, are not linear
        assert found.squares[0, k].sum() == pytest.approx(np.sum(lengths_of(d) ** 2), rel=0.01)


@pytest.mark.parametrize(("limit", "verdict"), [("900 m", "kept"), ("60 m", "broken")])
def test_the_promise_is_that_of_the_types(limit, verdict):
    one = planned_from(estimated(4, limit))
    options = FlightOptions(flights=100, through_files=0)  # of limits far beyond and far below
    (o,) = verify(one.loaded, one.document, options, lambda message: None).outcomes
    assert o.types is not None
    assert o.types.promised == 0.9
    assert o.verdict == o.types.verdict == verdict


def test_stated_spreads_are_of_one_type():
    one = planned_from(estimated(4, "900 m"))
    options = FlightOptions(flights=2, through_files=0, spreads="stated")
    (o,) = verify(one.loaded, one.document, options, lambda message: None).outcomes
    assert o.types is None


def test_fewer_power_ons_leave_more_types_outside():
    """At a limit that the stated spread just keeps; the same draws of χ² do not serve both."""
    kept = []
    for power_ons in (3, 100):
        one = planned_from(estimated(power_ons, "900 m"))
        figure = max(f["0"] for f in one.document["families"].values())
        spec = estimated(power_ons, f"{1.15 * figure:.1f} m")
        tight = planned_from(spec)
        options = FlightOptions(flights=100, through_files=0)
        (o,) = verify(tight.loaded, tight.document, options, lambda message: None).outcomes
        kept.append(o.types.share)
    assert kept[0] < kept[1] - 0.1


@pytest.mark.parametrize("rule", ["rss", {"percentile": "80 %"}])
def test_what_flights_err_by_their_number_breaks_no_promise(rule):
    """All types fly the same units: 400 that are 2 % over a limit are no more than one such interval."""
    tree = estimated(15)
    spec = loaded(tree | {"requirement": [tree["requirement"][0] | {"rule": rule}]}).spec
    wanted = spec.requirement[0]
    limit, flights = wanted.limit.si, 1000
    squares = np.full((1, TYPES, 1), flights * (1.02 * limit) ** 2)
    fourth = 3.0 * squares**2 / flights  # as of a normal error
    hits = np.full((1, TYPES), 793.0)
    found = judged(TypeTally(flights, hits, squares, fourth), 0, wanted, spec)
    assert found.share == 0.0
    assert found.verdict == "undecided"
    many = TypeTally(100 * flights, 100.0 * hits, 100.0 * squares, 100.0 * fourth)
    assert judged(many, 0, wanted, spec).verdict == "broken"
