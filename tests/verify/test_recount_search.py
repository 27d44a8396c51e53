"""What a search left in a plan, held against the rest: a change of any figure of a front is seen."""

import copy

import pytest

from planner.verify.recount_search import check_front, check_keys, check_prices

SUMS = {
    "method": "published",
    "requirements": [{"limit": 10.0, "rule": "worst_case", "at": "end"}],
    "sensitivities": [
        {"error": "gyro.bias", "axis": "x", "value": 500.0, "unit": "m/(deg/s)", "requirement": 0},
        {"error": "accelerometer.bias", "axis": "x", "value": -300.0, "unit": "m/g", "requirement": 0},
    ],
    "hours_per_limit": {"0": 0.5},
    "genetic": {
        "time_s": 100.0,
        "generations": 7,
        "front": [
            {"gyro.bias": 0.014, "accelerometer.bias": 0.01, "time_s": 100.0},
            {"gyro.bias": 0.002, "accelerometer.bias": 0.03, "time_s": 120.0},
        ],
    },
}
FIGURES = SUMS | {
    "method": "information",
    "hours_per_limit": {},
    "genetic": {
        "time_s": 100.0,
        "front": [
            {"0": 12.0, "time_s": 50.0, "power_on_s": 9.0},
            {"0": 9.5, "time_s": 100.0, "power_on_s": 9.0},
        ],
    },
}


def faults(document):
    return [*check_front(document).faults, *check_prices(document).faults]


@pytest.mark.parametrize("document", [SUMS, FIGURES])
def test_a_front_as_planner_writes_it_is_right(document):
    assert faults(document) == []


@pytest.mark.parametrize("factor", [0.999, 1.001])
@pytest.mark.parametrize("point", [0, 1])
@pytest.mark.parametrize("error", ["gyro.bias", "accelerometer.bias"])
def test_any_changed_allowance_of_a_point_is_off_the_limit(point, error, factor):
    document = copy.deepcopy(SUMS)
    document["genetic"]["front"][point][error] *= factor
    assert faults(document)


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d["genetic"]["front"][1].update(time_s=90.0),
        lambda d: d["genetic"]["front"].append({"0": 13.0, "time_s": 60.0, "power_on_s": 9.0}),
        lambda d: d["genetic"]["front"][0].update({"0": 9.0}),
        lambda d: d["genetic"]["front"][0].pop("0"),
        lambda d: d["hours_per_limit"].update({"0": 1.0}),
    ],
)
def test_what_is_of_no_front_is_seen(change):
    document = copy.deepcopy(FIGURES)
    change(document)
    assert faults(document)


@pytest.mark.parametrize("hours", [{"0": -1.0}, {"1": 0.5}])
def test_a_price_is_of_a_requirement_and_not_negative(hours):
    assert faults(SUMS | {"hours_per_limit": hours})


def test_keys_that_planner_does_not_write_are_named():
    strange = {
        "planner": "0",
        "speed": 1,
        "spec": {"name": "a", "sha256": "b", "owner": "me"},
        "steps": [{"id": "a", "motion": {"rate_9_dps": 1.0}}],
        "path": "where it was read",
        "allowances": {"gyro.bias": {"allowed": 1.0, "parts": {"luck": 0.0}}},
    }
    named = {fault.where for fault in check_keys(strange).faults}
    assert named == {"speed", "spec.owner", "allowances.gyro.bias.parts.luck"}
