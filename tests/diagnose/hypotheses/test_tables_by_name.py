"""Tables and curves of K's: hidden in a simulated campaign they are named, fitted and held by the firmware.

A campaign that reaches them: eight rates, eight loads, an hour after power-on. What a plan makes of them is
flown in tests/verify (test_walk_in_store, test_recount), what the C header does in tests/export.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import planner
from planner.campaign.design import Design, design
from planner.campaign.power_ons import of_table
from planner.campaign.triad import fit_triad
from planner.diagnose.channels.prepared import prepared as sorted_out
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.choices import Campaign, TestVisits
from planner.nouns.dwell_table import DwellTable
from planner.plan.schedule_to_steps import steps
from planner.protocols import Sensor
from planner.simulate.campaign import prepared, simulate
from planner.simulate.hidden import hidden_effect
from planner.simulate.settings import settings_of
from planner.spec.model import Spec
from tests.diagnose.worlds import named, unnamed
from tests.export.test_firmware import CURVES

DECLARED = ("bias", "scale_factor", "misalignment")
TURNS = {"bench": "rate_table", "motions": 48, "power_on": "30 s", "record": "20 s", "temperatures": "room"}
SPEC = {
    "planner": 1,
    "name": "tables",
    "requirement": [{"error": "position", "limit": "100 km", "rule": "rss"}],
    "trajectory": "static",
    "unit": {
        "noise": {"gyro": "0.1 deg/sqrt(h)", "accelerometer": "0.05 m/s/sqrt(h)"},
        "gyro": {
            "bias": {"systematic": "0.03 deg/s", "run_to_run": "0.001 deg/s"},
            "scale_factor": {"systematic": "0.5 %", "run_to_run": "0.002 %"},
            "misalignment": {"systematic": "0.5 deg"},
        },
        "accelerometer": {
            "bias": {"systematic": "20 mg", "run_to_run": "0.1 mg"},
            "scale_factor": {"systematic": "0.5 %", "run_to_run": "0.002 %"},
            "misalignment": {"systematic": "0.5 deg"},
        },
    },
    "effects": list(DECLARED),
    "benches": {
        "rate_table": {"axes": 2, "move": "5 s", "limits": {"rate": "600 deg/s"}},
        "centrifuge": {"arm": "1.5 m", "limits": {"acceleration": "100 g"}},
    },
    "tests": {
        "hour": TURNS
        | {
            "calibrates": ["gyro.bias", "accelerometer.bias"],
            "motions": 24,
            "power_on": "2 s",
            "record": "10 s",
            "gap": "2 min",
        },
        "rates": TURNS | {"calibrates": ["gyro.scale_factor", "gyro.misalignment"]},
        "loads": TURNS | {"bench": "centrifuge", "calibrates": ["accelerometer.scale_factor"]},
    },
}
# one effect a channel, all in one search; the arm is on all channels
TOGETHER: dict[str, tuple[Sensor, dict[str, str], set[tuple[str, str]]]] = {
    "gyro tables": (
        "gyro",
        {
            "gyro.scale_factor_curve.x +100 deg/s": "0.5 %",
            "load_curve.yz +50 g": "0.05 deg/s",
            "gyro.drift_curve.z 600 s": "0.02 deg/s",
        },
        {("scale_factor_curve", "x"), ("load_curve", "y"), ("drift_curve", "z")},
    ),
    "gyro k2 a²": (
        "gyro",
        {"gyro.scale_factor_acceleration_squared.x": "0.0003 %/g^2"},
        {("scale_factor_acceleration_squared", "x")},
    ),
    "gyro k1 a + k2 a², polynomial one way": (
        "gyro",
        {
            "gyro.scale_factor_acceleration.x": "0.001 %/g",
            "gyro.scale_factor_acceleration_squared.x": "0.00003 %/g^2",
            "gyro.scale_factor_polynomial.y +1": "0.3 %",
            "gyro.scale_factor_polynomial.y +2": "0.2 %",
        },
        {
            ("scale_factor_acceleration", "x"),
            ("scale_factor_acceleration_squared", "x"),
            ("scale_factor_polynomial", "y"),
        },
    ),
    "accelerometer tables, polynomial": (
        "accelerometer",
        {
            "accelerometer.scale_factor_curve.x +10 g": "0.5 %",
            "accelerometer.scale_factor_polynomial.y +1": "0.4 %",
            "accelerometer.scale_factor_polynomial.y -1": "0.4 %",
            "accelerometer.scale_factor_polynomial.y +2": "0.3 %",
            "accelerometer.scale_factor_polynomial.y -2": "0.2 %",
            "accelerometer.drift_curve.z 600 s": "2 mg",
        },
        {("scale_factor_curve", "x"), ("scale_factor_polynomial", "y"), ("drift_curve", "z")},
    ),
    "the arm": ("accelerometer", {"arm_length": "0.5 %"}, {("arm_length", "xyz")}),
}
SINGLE = ["gyro k2 a²"]  # which stands beside another in a case of its own


@cache
def campaign() -> tuple[Spec, Design]:
    spec = planner.load(SPEC).spec
    visits = tuple(TestVisits(test, (20.0,), (6 if test == "hour" else 3,)) for test in spec.tests)
    return spec, design(steps(spec, Campaign(visits, (), 0.0, 0.0, False)), spec)


def measured(hidden: dict[str, str]) -> DwellTable:
    spec, made = campaign()
    effects = [hidden_effect(f"{name}={size}") for name, size in hidden.items()]
    return simulate(made, prepared(spec), 5, hidden=effects, settings=settings_of(spec))[0]


@pytest.mark.parametrize("case", [case for case in TOGETHER if case not in SINGLE])
@pytest.mark.further("case", SINGLE)
def test_each_is_named_on_its_channel_and_fitted(case: str) -> None:
    sensor, hidden, expected = TOGETHER[case]
    table = measured(hidden)
    found = diagnose_sensor(sorted_out(table), sensor, DECLARED, 1).found
    assert {(name, "".join(axes)) for name, axes in named(found)} == expected
    assert unnamed(found) == set()
    told = fitted(table, sensor, {name for name, _ in expected})
    for place, size in hidden.items():
        name, _, term = place.removeprefix(f"{sensor}.").partition(".")
        value, sigma = told[name, term or "arm"]
        assert abs(value) == pytest.approx(hidden_effect(f"{place}={size}").size, abs=4.0 * sigma), place


def fitted(table: DwellTable, sensor: Sensor, names: set[str]) -> dict[tuple[str, str], tuple[float, float]]:
    """(effect, term) -> value and its sigma, by the fit that calibrates, with the effects declared."""
    runs = of_table(table)
    readings = table.gyro if sensor == "gyro" else table.acc
    found = {}
    for e in fit_triad(sensor, readings, runs, campaign()[0], [*DECLARED, *sorted(names)]):
        sigma = np.sqrt(np.diag(e.fit.covariance))
        for column, value, own in zip(e.model.columns(), e.theta, sigma, strict=True):
            found[column.effect, column.term] = (float(value), float(own))
    return found


def test_firmware_has_a_place_for_each_that_flies() -> None:
    names = {name for _, _, expected in TOGETHER.values() for name, _ in expected}
    assert names - {"arm_length"} <= set(CURVES)
