"""Beside a reference that is off no misfit of it gets a sensor's name, and a sensor's own effect keeps it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.findings.beside_the_bench import beside_the_bench
from planner.diagnose.findings.of_one_temperature import Temperatures
from planner.diagnose.references.references import REFERENCES
from planner.nouns.diagnosis import FoundEffect, ReferenceSuspect, Unknown
from planner.nouns.dwell_table import DwellTable
from planner.pipelines.data import simulate
from planner.protocols import Sensor
from planner.simulate.settings import settings_of
from tests.diagnose.hall import Hall, days, hidden, read, sweeps
from tests.diagnose.worlds import whole
from tests.specs import shipped

MOUNTING = ReferenceSuspect("mounting", 0.1, 0.09, 0.11, "deg", ("gyro_x",), 1e-9, 30.0, "", 20.0)
THERMOMETER = replace(MOUNTING, hypothesis="thermometer_lag", unit="s")
ACCELEROMETERS = ("accelerometer_x", "accelerometer_y", "accelerometer_z")


def _effect(effect: str, channels: tuple[str, ...]) -> FoundEffect:
    sensor: Sensor = "gyro" if channels[0].startswith("gyro") else "accelerometer"
    return FoundEffect(effect, sensor, channels, (), 1e-6, 12.0)


def _rest(channel: str, variable: str = "time_on") -> Unknown:
    return Unknown((channel,), variable, 1e-6, 9.0)


def _stands(
    effects: list[FoundEffect], unknown: list[Unknown], *wrong: ReferenceSuspect
) -> tuple[set[str], set[tuple[str, str]]]:
    """The names that stand, and the variable of every channel that stays without one."""
    nobody = Temperatures((), prepared(read(days(1, 6), 1)))  # no channel that denies or agrees
    stands, falls, rest = beside_the_bench(effects, unknown, wrong, nobody)
    assert len(stands) + len(falls) == len(effects)
    return {e.effect for e in stands}, {(u.channels[0], u.varies_with) for u in rest}


# ---------------------------------------------------------------- the rules, one by one


def test_one_effect_of_one_channel_stands_beside_a_fault() -> None:
    own = _effect("g_sensitivity", ("gyro_x",))
    for wrong in (MOUNTING, THERMOMETER):
        assert _stands([own], [], wrong) == ({"g_sensitivity"}, set())
    assert _stands([own], [_rest("accelerometer_z")], MOUNTING) == ({"g_sensitivity"}, set())


def test_a_channel_with_a_rest_bears_no_name_beside_a_fault() -> None:
    own = _effect("g_sensitivity", ("gyro_x",))
    rest = [_rest("gyro_x")]
    assert _stands([own], rest, MOUNTING) == (set(), {("gyro_x", "specific_force")})
    assert _stands([own], rest, THERMOMETER)[0] == {"g_sensitivity"}  # gravity is what it was
    assert _stands([own], rest)[0] == {"g_sensitivity"}
    stated = replace(MOUNTING, stated=0.2, chance=0.5)  # no more than the spec says of the bench
    assert _stands([own], rest, stated)[0] == {"g_sensitivity"}


def test_rests_of_several_other_channels_take_a_name_as_well() -> None:
    own = _effect("load_curve", ("gyro_x",))
    rests = [_rest(c, "specific_force") for c in ACCELEROMETERS]
    assert _stands([own], rests, MOUNTING)[0] == set()
    assert _stands([own], rests)[0] == {"load_curve"}


def test_what_several_channels_show_is_the_reference() -> None:
    several = _effect("cross_coupling", ACCELEROMETERS)
    names, rest = _stands([several], [], MOUNTING)
    assert not names
    assert {c for c, _ in rest} == set(ACCELEROMETERS)
    assert _stands([several], [], replace(MOUNTING, hypothesis="wrong_label"))[0]  # its rows are left out
    assert _stands([several], [])[0] == {"cross_coupling"}


def test_the_course_of_the_temperature_beside_its_thermometer() -> None:
    late = _effect("thermal_lag", ("gyro_x",))
    assert _stands([late], [], THERMOMETER) == (set(), {("gyro_x", "temperature_rate")})
    assert _stands([late], [], MOUNTING)[0] == {"thermal_lag"}
    curve = _effect("bias_temperature", ("gyro_x",))  # of what the temperature is, not of its course
    assert _stands([curve], [], THERMOMETER)[0] == {"bias_temperature"}


def test_three_channels_that_lack_something_else_each_lack_a_reference() -> None:
    x, y = _effect("warm_up", ("gyro_x",)), _effect("thermal_lag", ("gyro_y",))
    assert _stands([x, y], [_rest("gyro_z", "day")])[0] == set()
    assert _stands([x, y], [_rest("gyro_z", "rate")])[0] == {"warm_up", "thermal_lag"}  # of another kind
    assert _stands([x, y], [])[0] == {"warm_up", "thermal_lag"}
    same = _effect("thermal_lag", ("gyro_x", "gyro_y", "gyro_z"))
    assert _stands([same], [])[0] == {"thermal_lag"}


def test_two_effects_of_every_channel_stand() -> None:
    """A g-sensitivity and an asymmetry of three gyros lacked "something, and not the same"."""
    three = ("gyro_x", "gyro_y", "gyro_z")
    two = [_effect("g_sensitivity", three), _effect("scale_factor_asymmetry", three)]
    assert _stands(two, [])[0] == {"g_sensitivity", "scale_factor_asymmetry"}
    assert _stands(two, [_rest("gyro_z", "rate")])[0] == {"g_sensitivity", "scale_factor_asymmetry"}


def test_rests_of_both_sensors_that_go_with_the_same_take_a_name() -> None:
    """At one rate the supply made all six channels read more: gyro x had a product of rates at 36 sigma."""
    own = _effect("cross_coupling", ("gyro_x",))
    rests = [_rest(c, "rate") for c in ("gyro_y", "gyro_z", "accelerometer_x", "accelerometer_z")]
    assert _stands([own], rests) == (set(), {("gyro_x", "rate")})
    assert _stands([own], rests[:2])[0] == {"cross_coupling"}  # a second effect of its own sensor
    assert _stands([_effect("g_sensitivity", ("gyro_x",))], rests)[0] == {"g_sensitivity"}


def test_a_name_leaves_nothing_of_its_own_variable() -> None:
    own = _effect("scale_factor_nonlinearity", ("gyro_x",))
    assert _stands([own], [_rest("gyro_x", "rate")])[0] == set()
    assert _stands([own], [_rest("gyro_x", "day")])[0] == {"scale_factor_nonlinearity"}
    assert _stands([own], [_rest("gyro_x", "day"), _rest("gyro_x", "orientation")])[0] == set()


def test_how_the_unit_stands_is_a_misalignment() -> None:
    leans = _effect("misalignment_temperature", ("gyro_z",))
    assert _stands([leans], [], MOUNTING)[0] == set()
    assert _stands([leans], [], THERMOMETER)[0] == {"misalignment_temperature"}


def test_all_channels_that_follow_how_the_temperature_moved() -> None:
    """A temperature that had lost its sign was a table over its rate on six channels, at 200 sigma."""
    gyros = _effect("temperature_rate_table", ("gyro_x", "gyro_y", "gyro_z"))
    others = _effect("thermal_lag", ACCELEROMETERS)
    assert _stands([gyros, others], [])[0] == set()
    assert _stands([others], [_rest("gyro_x", "temperature_rate")])[0] == {"thermal_lag"}  # one of its own
    warms = _effect("warm_up", ACCELEROMETERS)
    assert _stands([gyros, warms], [])[0] == {"temperature_rate_table", "warm_up"}  # a unit warms itself


def test_two_names_on_a_channel_and_others_on_the_next() -> None:
    """A fan that shook the hot records of each power-on its own way: four names on two accelerometers."""
    x = [_effect("drift", ("accelerometer_x",)), _effect("thermal_lag", ("accelerometer_x",))]
    y = _effect("warm_up", ("accelerometer_y",))
    assert _stands([*x, y], [])[0] == set()
    assert len(_stands(x, [])[0]) == 2
    assert _stands([x[0], y], [])[0] == {"drift", "warm_up"}
    same = [_effect(name, ACCELEROMETERS) for name in ("drift", "thermal_lag")]
    assert len(_stands(same, [])[0]) == 2


def test_a_channel_that_was_recorded_wrongly() -> None:
    own = _effect("cross_coupling", ("gyro_x",))
    each = [replace(MOUNTING, hypothesis="stuck_channel", unit="rows", channels=(c,)) for c in ACCELEROMETERS]
    assert _stands([own], [], *each)[0] == set()  # a recorder that writes in steps
    assert _stands([own], [], *each[:2])[0] == {"cross_coupling"}
    step, wrong = _effect("bias_step", ("gyro_x",)), replace(each[0], channels=("gyro_x",))
    assert _stands([step, own], [], wrong)[0] == {"cross_coupling"}  # a level is left of wrong readings
    assert _stands([step], [], replace(wrong, channels=(*ACCELEROMETERS, "gyro_x")))[0]  # of no channel


def test_two_names_over_one_variable_beside_a_fault() -> None:
    y, z = _effect("scale_factor_polynomial", ("gyro_y",)), _effect("scale_factor_curve", ("gyro_z",))
    assert _stands([y, z], [], MOUNTING)[0] == set()
    assert len(_stands([y, z], [])[0]) == 2
    assert len(_stands([y, _effect("drift", ("gyro_z",))], [], MOUNTING)[0]) == 2


# ---------------------------------------------------------------- whole campaigns


def _late_log(hall: Hall, seed: int, seconds: float) -> DwellTable:
    """The temperatures of some minutes later, as a log whose clock is off has them; at the ends it stands."""
    degc = hall.temperature.copy()
    for run in np.unique(hall.run):
        mine = hall.run == run
        t = hall.time_on[mine]
        degc[mine] = np.interp(t + seconds, t, hall.temperature[mine])
    return replace(read(hall, seed), temperature_degc=degc)


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3, 4])
def test_temperatures_of_another_minute(seed: int) -> None:
    """Four names, `thermal_lag` and tables over temperature and its rate, on gyros and accelerometers."""
    found = whole(_late_log(sweeps(seed), seed, 400.0))
    assert not found.effects
    assert found.reference_suspects
    assert {s.hypothesis for s in found.reference_suspects} <= {"thermometer_lag", "thermometer_offset"}
    assert all(s.record for s in found.reference_suspects if s.alias)


@pytest.mark.parametrize("seed", [11])
@pytest.mark.further("seed", [12, 13, 14])
def test_a_drift_of_its_own_beside_a_thermometer_that_lags(seed: int) -> None:
    """The other channels deny that it is one temperature with it."""
    hall = sweeps(seed)
    table = replace(read(hall, seed), temperature_degc=hall.temperature - 200.0 * hall.ramp / 60.0)
    found = whole(hidden(table, "gyro", seed % 3, 0.01 * hall.time_on / 1000.0))
    assert [(e.effect, e.channels) for e in found.effects] == [("drift", (f"gyro_{'xyz'[seed % 3]}",))]
    assert {s.hypothesis for s in found.reference_suspects} == {"thermometer_lag"}


@pytest.mark.parametrize("seed", [1, 21])
@pytest.mark.further("seed", [2, 22, 23, 24])
def test_a_cable_that_is_loose_in_one_attitude(seed: int) -> None:
    """It was an asymmetric scale factor, at 22 to 29 sigma; one that is there has the same size in all."""
    hall, rng = days(seed, 36), np.random.default_rng([seed, 5])
    down = (hall.up[:, 1] < -0.9) & ~hall.turns
    now_and_then = down & (rng.random(len(down)) < 0.6)
    loose = 3e-3 * now_and_then * rng.uniform(0.3, 1.0, len(down))
    found = whole(hidden(read(hall, seed), "accelerometer", 1, loose))
    assert not found.effects
    assert {c for u in found.unknown for c in u.channels} <= {"accelerometer_y"}  # of 21 nothing is said
    true = whole(hidden(read(hall, seed), "accelerometer", 1, 1.5e-3 * np.abs(hall.up[:, 1])))
    assert {e.effect for e in true.effects} == {"scale_factor_asymmetry"}


@pytest.mark.parametrize("seed", [31, 32])
@pytest.mark.further("seed", [33, 34, 35])
def test_an_effect_with_a_spread_of_its_own(seed: int) -> None:
    """From power-on to power-on by a third of itself: it is the sensor's all the same."""
    hall, rng = days(seed, 36), np.random.default_rng([seed, 6])
    size = (1.0 + 0.33 * rng.normal(size=int(hall.run.max()) + 1))[hall.run]
    found = whole(hidden(read(hall, seed), "gyro", 0, 0.01 * size * hall.up[:, 1]))
    assert [(e.effect, e.channels) for e in found.effects] == [("g_sensitivity", ("gyro_x",))]


@pytest.mark.parametrize("seed", [45, 47])
@pytest.mark.further("seed", [48])
def test_accelerometers_that_warm_up_each_by_its_own_size(seed: int) -> None:
    """Two of three went as one temperature by chance, 0.6 and 0.3 of it; the gyros knew nothing of one."""
    hall, rng = days(seed), np.random.default_rng([seed, 8])
    table = read(hall, seed)
    for axis in range(3):
        size = 1.2e-3 * rng.choice([-1, 1]) * rng.uniform(0.5, 1.5)
        table = hidden(table, "accelerometer", axis, size * (1.0 - np.exp(-hall.time_on / 600.0)))
    found = whole(table)
    assert not found.reference_suspects
    assert {e.effect for e in found.effects} == {"warm_up"}
    assert {c for e in found.effects for c in e.channels} == set(ACCELEROMETERS)


@pytest.mark.parametrize("seed", [5])
@pytest.mark.further("seed", [3, 4, 8])
def test_one_other_channel_that_warms_up_as_well_is_no_witness(seed: int) -> None:
    """Accelerometer x said 0.6 of what y did, and nobody else knew: "thermometer off by 1.3 K", 7 sigma."""
    unit = shipped("high_g")
    table, _ = simulate(unit, None, ("accelerometer.warm_up=1.7 mg",), seed, settings_of(unit.spec))
    found = diagnose(table, unit.spec)
    assert "thermometer_offset" not in {s.hypothesis for s in found.reference_suspects}
    assert {e.effect for e in found.effects} == {"warm_up"}


def test_who_is_one_with_a_sensors_error_names_the_record_that_tells() -> None:
    for r in REFERENCES.values():
        assert bool(r.alias) <= bool(r.record), r.name
