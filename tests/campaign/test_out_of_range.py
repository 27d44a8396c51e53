"""Terms that no temperature of use reaches: nobody need tell them, and a wider range asks for them."""

from __future__ import annotations

from planner.campaign.out_of_range import out_of_range
from planner.effects.drift_curve_over_temperature import TEMPERATURES_DEGC, TIMES_S
from planner.nouns.choices import TestVisits
from planner.nouns.sensor import ErrorName
from planner.plan.visits_to_observability import unobservable_in
from tests.specs import loaded, small
from tests.verify.plans import flown

DRIFT = ErrorName("gyro.drift_curve_over_temperature")


def spec_in(low: float, high: float):
    plan = small()["plan"]
    asked = plan | {"temperatures": plan["temperatures"] | {"range": [f"{low} degC", f"{high} degC"]}}
    return loaded(small() | {"plan": asked}).spec


def test_segments_beyond_the_range_are_nothing_within_it():
    expected = {f"{axis} 80 degC {time:g} s" for axis in "xyz" for time in TIMES_S[1:]}
    assert out_of_range(spec_in(-60.0, 60.0), DRIFT) == expected
    assert out_of_range(spec_in(-60.0, 61.0), DRIFT) == frozenset()


def test_both_ends_may_fall_short():
    found = {name.split()[1] for name in out_of_range(spec_in(-20.0, 20.0), DRIFT)}
    assert found == {f"{t:g}" for t in TEMPERATURES_DEGC[1:] if not -20.0 < t <= 20.0}


def test_what_is_straight_over_temperature_or_a_table_of_nodes_is_read_everywhere():
    for name in ("gyro.g_sensitivity_temperature", "gyro.bias", "accelerometer.bias_temperature"):
        assert out_of_range(spec_in(-10.0, 10.0), ErrorName(name)) == frozenset()


def test_no_record_need_tell_what_lies_beyond_the_range_and_some_must_what_lies_within():
    """Without it the segments above 60 degC were asked for, and no record could tell them."""
    drift = {"systematic": "0.02 deg/s", "run_to_run": "0 deg/s"}
    spec = flown() | {
        "effects": [*flown()["effects"], "drift_curve_of_gyro", "drift_curve_over_temperature_of_gyro"]
    }
    spec["unit"]["gyro"] |= {"drift_curve_of_gyro": drift, "drift_curve_over_temperature_of_gyro": drift}
    own = ["gyro.drift_curve_of_gyro", "gyro.drift_curve_over_temperature_of_gyro"]
    spec["tests"]["static"] |= {"record": "6 s", "gap": "650 s", "power_on": "2 s"}
    spec["tests"]["static"]["calibrates"] = [*spec["tests"]["static"]["calibrates"], *own]
    temperatures = tuple(float(t) for t in range(-60, 61, 10))
    one = loaded(spec).spec
    visits = [TestVisits(name, temperatures, (2,) * len(temperatures)) for name in one.tests]
    whole, colder = (
        {u.term for u in unobservable_in(one, some) if u.error == own[1]}
        for some in (visits, [without(v, 60.0) for v in visits])
    )
    beyond, within = "x 80 degC 300 s", "x 60 degC 300 s"
    assert not {beyond, within} & whole
    assert within in colder
    assert beyond not in colder


def without(visit: TestVisits, above: float) -> TestVisits:
    """The visit without its temperatures from one on."""
    kept = tuple(t for t in visit.temperatures_degc if t < above - 15.0)
    return TestVisits(visit.test, kept, visit.repeats[: len(kept)])
