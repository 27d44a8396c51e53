"""What a diagnosis says of the size of what it found is what calibrate says once it is declared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from planner.calibrate.dwells_to_fit import calibrate
from planner.diagnose.channels.prepared import prepared
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.search.sensor import diagnose_sensor
from planner.dwells.table_rows import rows_of
from planner.nouns.calibration import Coefficient
from planner.nouns.diagnosis import FoundEffect, UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.spec.model import Spec
from planner.units import from_si
from tests.calibrate.world import Hidden, Layout, Noise, campaign, sized
from tests.data import table as reduced
from tests.diagnose.hypotheses.test_shared_recordings import accelerometers_of_the_sweep, declared
from tests.diagnose.worlds import DECLARED, spec, whole

LAYOUT = Layout(later=(30.0,), rate_repeats=2, centrifuge=False)
Key = tuple[str, str, str]


def calibrated(table: DwellTable, base: Spec, found: UnitDiagnosis) -> Mapping[Key, Coefficient]:
    """(error, channel, term) -> what calibrate says with all found effects declared."""
    names = dict.fromkeys(e.effect for e in found.effects)
    (unit,) = calibrate(table, base.model_copy(update={"effects": [*base.effects, *names]}))
    every = [c for sensor in unit.sensors for c in sensor.coefficients]
    return {(c.error, c.channel, c.term): c for c in every if c.temperature_degc is None}


def assert_same(effect: FoundEffect, by_calibrate: Mapping[Key, Coefficient]) -> None:
    """Values, intervals, freedom and parameters, to the last digit."""
    for t in effect.terms:
        axis = "x" if t.channel == "all" else t.channel[-1]
        c = by_calibrate[f"{effect.sensor}.{effect.effect}", axis, t.name]
        assert (t.value, t.low, t.high, t.freedom) == (c.value, c.low, c.high, c.freedom), t
        assert not t.parameter or effect.nonlinear[t.name] == c.value


CASES = [
    (
        5,
        [
            Hidden("warm_up", "gyro_x", tau_s=500.0),
            Hidden("g_sensitivity", "gyro_y"),
            Hidden("scale_factor_nonlinearity", "gyro_z"),
        ],
    ),
    (6, [Hidden("temperature_rate", "gyro_z"), Hidden("warm_up", "acc_y", tau_s=500.0)]),
    (12, [Hidden("misalignment_temperature", "gyro_x"), Hidden("ageing", "gyro_y")]),
]


@cache
def diagnosed(case: int) -> tuple[DwellTable, UnitDiagnosis]:
    """The campaign of a case and its diagnosis, two seconds each."""
    seed, hidden = CASES[case]
    table = campaign(seed, [sized(h, 25.0, seed, LAYOUT) for h in hidden], LAYOUT)
    if not any(h.channel.startswith("acc") for h in hidden):
        table = replace(table, acc=None)
    return table, whole(table)


@pytest.mark.parametrize("case", [1])
@pytest.mark.further("case", [0, 2])
def test_sizes_and_intervals_are_those_of_calibrate(case: int) -> None:
    hidden, (table, found) = CASES[case][1], diagnosed(case)
    assert {h.effect for h in hidden} == {e.effect for e in found.effects}
    by_calibrate = calibrated(table, spec(), found)
    for effect in found.effects:
        assert_same(effect, by_calibrate)


def test_a_coefficient_that_channels_share_is_calibrates_joint_one() -> None:
    table = replace(campaign(10, [Hidden("earth_rate", "gyro_x", 1.0)], LAYOUT), acc=None)
    found = whole(table)
    (effect,) = found.effects
    assert [t.name for t in effect.terms][:2] == ["up", "north"]
    assert {t.channel for t in effect.terms} == {"all"}
    assert_same(effect, calibrated(table, spec(), found))


def test_rows_that_are_far_off_are_left_out_and_the_rest_is_calibrated() -> None:
    hidden = sized(Hidden("temperature_rate", "gyro_z"), 25.0, 71, LAYOUT)
    table = replace(campaign(71, [hidden], LAYOUT, Noise(outliers=0.004)), acc=None)
    found = whole(table)
    data = prepared(table)
    far = diagnose_sensor(data, "gyro", DECLARED, 1).far[2][data.where]
    assert far.any()
    (effect,) = found.effects
    assert_same(effect, calibrated(rows_of(table, ~far), spec(), found))


def test_an_effect_that_steps_keeps_the_size_that_the_search_gave_and_says_so() -> None:
    hidden = sized(Hidden("bias_step", "gyro_z", step_day=20.0), 30.0, 21)
    found = whole(replace(campaign(21, [hidden]), acc=None))
    (effect,) = found.effects
    assert effect.effect == "bias_step"
    day = next(t for t in effect.terms if t.parameter)
    assert day.low <= 20.0 <= day.high
    assert day.unit == "day"
    assert any("gyro_z: sizes are those of the search" in note for note in found.notes)


def test_a_table_over_temperature_is_told_by_its_mean_slope() -> None:
    """A straight line of 1e-3 deg/s/K over all temperatures: the mean slope of any table through it."""
    table = replace(campaign(3, (), LAYOUT), acc=None)
    assert table.gyro is not None
    assert table.ref_rate is not None
    rng = np.random.default_rng(4)
    slope = np.radians(1e-3)
    gyro = table.ref_rate + slope * (table.temperature_degc - 20.0)[:, None]
    run = np.radians(2e-3) * rng.normal(size=(table.run.max() + 1, 3))[table.run]
    table = replace(table, gyro=gyro + run + np.radians(1e-3) * rng.normal(size=gyro.shape))
    found = diagnose(table, spec().model_copy(update={"effects": ["bias", "scale_factor", "misalignment"]}))
    (effect,) = found.effects
    assert effect.effect == "bias_temperature"
    for t in effect.terms:
        assert t.low < slope < t.high
        assert t.value == pytest.approx(slope, rel=0.05)


@pytest.mark.parametrize("case", [1])
@pytest.mark.further("case", [0])
def test_what_is_told_from_zero_by_the_search_alone_is_said(case: int) -> None:
    """Every effect whose coefficients all hold zero has its sentence, and no other has."""
    _, found = diagnosed(case)
    for e in found.effects:
        empty = all(t.low <= 0.0 <= t.high for t in e.terms if not t.parameter)
        said = [n for n in found.notes if f"{e.sensor}.{e.effect} on" in n and "holds zero" in n]
        assert bool(said) == empty


def test_a_recorded_sweep_has_one_coefficient_of_the_lag() -> None:
    """Calibrate said 0.00051 and diagnose 0.0038 g/(K/min) of the same channel of the same recording."""
    table = replace(reduced("thermal_sweep"), gyro=None)
    base = declared("bias, bias_temperature")
    found = accelerometers_of_the_sweep()
    mine = [e for e in found.effects if (e.sensor, e.effect) == ("accelerometer", "thermal_lag")]
    assert mine
    data = prepared(table)
    far = diagnose_sensor(data, "accelerometer", ("bias", "bias_temperature"), 1).far
    referenced = replace(table, ref_acc=data.full.ref_acc)
    for effect in mine:
        for t in effect.terms:
            axis = "xyz".index(t.channel[-1])
            kept = rows_of(referenced, ~far[axis][data.where])
            assert_same(replace(effect, terms=(t,)), calibrated(kept, base, found))
    size, time = (t for e in mine for t in e.terms if t.channel == "accelerometer_y")
    # on a long even ramp k τ is the coefficient of the rate, of which calibrate says 0.00051 g/(K/min)
    assert from_si(size.value * time.value / 60.0, "g") == pytest.approx(0.00051, rel=0.4)
