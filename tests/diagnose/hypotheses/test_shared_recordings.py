"""Recordings that others made, by hand and in a chamber: what can be said of them, and nothing more.

None has references or more than one power-on. What they hold was looked up by plain least squares: over the
sweep the temperature alone takes 95 % of the spread off gyro_y and acc_x, so its effect must have its name.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from planner.diagnose.diagnosis_to_residual import residual_changes, unit_fits
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.nouns.diagnosis import UnitDiagnosis
from planner.spec.load import spec_from_bytes
from planner.spec.model import Spec
from tests.data import table

NINE = "bias, scale_factor, misalignment"
SPEC = """
planner: 1
name: consumer unit
requirement: [{error: position, limit: 1000 m, rule: worst_case}]
trajectory: small_uav_1
unit:
  gyro:
    bias: {systematic: 2 deg/s, run_to_run: 0.2 deg/s}
    scale_factor: {systematic: 3 %}
    misalignment: {systematic: 2 deg}
  accelerometer:
    bias: {systematic: 60 mg, run_to_run: 5 mg}
    scale_factor: {systematic: 3 %}
    misalignment: {systematic: 2 deg}
effects: [DECLARED]
benches:
  rate_table: {axes: 2, units: 1, limits: {rate: 600 deg/s}}
tests:
  static: {bench: rate_table, calibrates: [gyro.bias], motions: 6, record: 60 s, temperatures: room}
"""


def declared(effects: str) -> Spec:
    return spec_from_bytes(SPEC.replace("DECLARED", effects).encode(), Path("consumer.yaml")).spec


@cache
def accelerometers_of_the_sweep() -> UnitDiagnosis:
    """Their diagnosis with a declared curve over temperature."""
    return diagnose(replace(table("thermal_sweep"), gyro=None), declared("bias, bias_temperature"))


def names(found: UnitDiagnosis) -> set[str]:
    return {e.effect for e in found.effects}


@pytest.mark.parametrize("name", [*(f"imu{i}" for i in range(5)), "six_positions_in_halves"])
def test_rests_in_a_hand_name_no_effect(name: str) -> None:
    """Under twenty rests of one power-on: a hand moves a gyro by more than its own effects do at 1 g."""
    found = diagnose(table(name, "rest_"), declared(NINE))
    assert names(found) == set()
    why = {(u.effect, u.sensor): u.why for u in found.untestable}
    assert "temp_degc" in why["bias_temperature", "gyro"]
    assert "day" in why["ageing", "gyro"]
    assert all("reference" in reason for (_, sensor), reason in why.items() if sensor == "accelerometer")
    assert {n.sensor for n in found.not_found} <= {"gyro"}


def test_a_sweep_without_a_declared_temperature_lacks_it_and_something_more() -> None:
    sweep = table("thermal_sweep")
    spec = declared("bias")
    found = diagnose(sweep, spec)
    assert found.verdict == "partly_explained"  # the way up and the way down differ
    channels = {c for e in found.effects if e.effect == "bias_temperature" for c in e.channels}
    assert channels >= {"gyro_y", "accelerometer_x"}
    at_rest = {"bias_temperature", "temperature_rate", "thermal_lag", "hysteresis", "warm_up", "drift"}
    assert names(found) <= at_rest
    changes = {c.channel: c for c in residual_changes(unit_fits(sweep, spec, found))}
    assert len(changes) == 6
    assert changes["gyro_y"].after < 0.5 * changes["gyro_y"].before
    assert {c.split for c in changes.values()} <= {"branches", "blocks"}
    assert all("too few power-ons" in c.how or "cannot tell" in c.how for c in changes.values())


def test_every_accelerometer_of_the_sweep_lags_behind_its_thermometer() -> None:
    """A polynomial over temperature leaves 0.0109, 0.0352, 0.066 m/s² on unseen branches, with a lag half."""
    sweep, spec = replace(table("thermal_sweep"), gyro=None), declared("bias, bias_temperature")
    found = accelerometers_of_the_sweep()
    lags = {e.channels: e for e in found.effects if e.effect == "thermal_lag"}
    assert set(lags) == {(f"accelerometer_{a}",) for a in "xyz"}
    for e in lags.values():
        assert all(t.low * t.high > 0.0 for t in e.terms)  # size and time constant, neither beside zero
    for change in residual_changes(unit_fits(sweep, spec, found)):
        assert change.after < 0.5 * change.before, change.channel


def test_what_a_single_rest_cannot_show_is_untestable() -> None:
    found = diagnose(replace(table("thermal_sweep"), acc=None), declared("bias, bias_temperature"))
    assert found.verdict not in ("clean", "untestable")  # hysteresis stays, named or not
    assert "bias_temperature" not in names(found)
    turned = {"scale_factor", "scale_factor_asymmetry", "misalignment", "g_sensitivity", "arm_bending"}
    assert turned <= {u.effect for u in found.untestable}
