"""The spec with what was found: few edits, everything else kept, and it plans."""

from __future__ import annotations

import contextlib
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.diagnose.diagnosis_to_spec import updated_spec
from planner.diagnose.findings.assumptions import exceeded
from planner.diagnose.update.bench_runs import run_of_test
from planner.diagnose.update.calibration_cost import (
    UNKNOWN,
    RecordNoise,
    Target,
    calibrating_test,
    repeat_spread,
)
from planner.errors import InfeasibleError, InputError
from planner.nouns.diagnosed_spreads import Assumption
from planner.nouns.diagnosis import Diagnosis, NavigationCost, ResidualChange, Rival, UnitDiagnosis, Unknown
from planner.nouns.progress import silent
from planner.pipelines import planning
from planner.pipelines.diagnosing import replanned
from planner.plan.observable_campaign import refuse_what_no_campaign_observes
from planner.spec.load import load_spec, spec_from_bytes
from planner.spec.text_edit import SpecText
from tests.diagnose.found import found_effect
from tests.shipped_plans import shipped_plan
from tests.specs import SHIPPED, loaded, planned, small, with_limit

LOOP, UAV = SHIPPED / "close_the_loop.yaml", SHIPPED / "small_uav.yaml"
NOISE = RecordNoise(white=1e-5, duration=60.0)


def diagnosis(path: Path, *effects, assumptions=(), unknown=(), sha256=None) -> Diagnosis:
    residual = tuple(
        ResidualChange(c, "deg/s", *[2e-5] * 9, 100, 20, True, "", white=2e-5, stray=0.0, record=60.0)
        for e in effects
        for c in e.channels
    )
    found = UnitDiagnosis("u1", "explained", effects, unknown, (), (), (), tuple(assumptions))
    found = replace(found, budget_exceeded=exceeded(assumptions))
    digest = load_spec(path).sha256 if sha256 is None else sha256
    return Diagnosis(found, residual, (), (), "0", "x", digest, "a" * 64, "data.csv", 1)


def updated(path: Path, *effects, **more):
    text = path.read_text(encoding="utf-8")
    made = updated_spec(text, load_spec(path), diagnosis(path, *effects, **more))
    return made, spec_from_bytes(made.text.encode(), path)


# ---------------------------------------------------------------- the text


@pytest.mark.parametrize("name", ["close_the_loop", "small_uav", "tactical_leg", "published_optimum"])
def test_nothing_but_the_edits_changes(name):
    path = SHIPPED / f"{name}.yaml"
    made, loaded = updated(path, found_effect("scale_factor_asymmetry", "gyro_x", 1e-3, 1e-4))
    old, new = path.read_text(encoding="utf-8").splitlines(), made.text.splitlines()
    kept = [line for line in old if line in new]
    assert len(kept) >= len(old) - 2  # the line of `effects`, the line of a test
    assert [line for line in new if line in set(kept)] == kept  # in their order
    assert "scale_factor_asymmetry" in loaded.spec.effects
    assert set(load_spec(path).spec.effects) < set(loaded.spec.effects)


def test_the_old_specs_digest_and_every_change_stand_at_the_top():
    made, _ = updated(LOOP, found_effect("g_sensitivity", "gyro_x", 1e-5, 1e-7))
    head = made.text.splitlines()[:6]
    assert load_spec(LOOP).sha256 in head[0]
    assert all(line.startswith("#") for line in head)
    for change in made.changes:
        assert change in made.text
    assert "+effects:" in made.diff.replace(" ", "")


def test_a_found_effect_is_declared_budgeted_and_calibrated_by_the_test_that_shows_it():
    effect = found_effect("g_sensitivity", "gyro_x", 1e-5, 1e-7)
    _, loaded = updated(LOOP, effect)
    budget = loaded.spec.unit.gyro["g_sensitivity"]
    assert 1e-5 <= budget.systematic.si <= 1.05 * 1.01e-5  # the far end of the interval, rounded up
    assert budget.run_to_run is None  # no scatter of an estimate: planning by information knows that itself
    assert "gyro.g_sensitivity" in loaded.spec.tests["static"].calibrates
    assert loaded.warnings == ()


def test_what_no_soaked_power_on_shows_has_its_whole_size_as_budget_and_is_not_declared():
    """Nor a ramp: how a lag goes on from one to the next is not planned. Declared, nothing was planned."""
    made, loaded = updated(LOOP, found_effect("thermal_lag", "gyro_x", 1e-3, 1e-5))
    budget = loaded.spec.unit.gyro["thermal_lag"]
    assert budget.systematic.si == pytest.approx(1.01e-3, rel=0.02)
    assert budget.run_to_run is None
    assert any("no test" in note for note in made.notes)
    assert "thermal_lag" not in loaded.spec.effects
    assert planning.exact_plan(loaded).time_s > 0.0


# of the specs that are shipped: what no test of theirs tells, what hides their scale factors, what goes with
# days, what each sensor asks the same test for, and two names for what one ramp shows
FOUND = [
    [("bias_step", "gyro_x", 1e-4)],
    [("ageing", "acc_x", 1e-9)],
    [("ageing", "gyro_x", 1e-5)],  # as large as nothing is: told by hours, and by no plan of a day
    [("temperature_rate", "gyro_x", 1e-5)],  # less than a record on a ramp tells
    [("temperature_rate_table", "acc_x", 1e-3)],  # with a node that the chamber's ramps do not reach
    [("hysteresis", "gyro_x", 1e-4)],
    [("scale_factor_curve", "acc_x", 1e-4)],
    [("scale_factor_acceleration", "gyro_x", 1e-5)],
    [("cross_coupling", "acc_x", 1e-4)],
    [("drift_curve", "acc_x", 1e-3), ("warm_up", "gyro_x", 1e-4)],
    [("temperature_rate", "gyro_x", 1e-3), ("temperature_rate", "acc_x", 0.1)],
    [("temperature_rate_table", "gyro_x", 1e-3), ("temperature_rate", "acc_x", 0.1)],
]


@pytest.mark.parametrize("found", FOUND[4:])
@pytest.mark.further("found", FOUND[:4])
def test_whatever_is_found_the_new_spec_is_one_that_plans(found):
    made, loaded = updated(UAV, *(found_effect(name, c, size, size / 20.0) for name, c, size in found))
    refuse_what_no_campaign_observes(loaded.spec)
    for name, channel, size in found:
        sensor = "gyro" if channel.startswith("gyro") else "accelerometer"
        assert getattr(loaded.spec.unit, sensor)[name].systematic.si >= size
        tested = any(f"{sensor}.{name}" in test.calibrates for test in loaded.spec.tests.values())
        assert tested == (name in loaded.spec.effects)
        assert tested != any(f"{sensor}.{name}" in note and "not declared" in note for note in made.notes)


@pytest.mark.parametrize("found", FOUND[:1])
@pytest.mark.further("found", FOUND[1:])
def test_and_it_is_planned(found):
    _, loaded = updated(UAV, *(found_effect(name, c, size, size / 20.0) for name, c, size in found))
    with contextlib.suppress(InfeasibleError):  # its limits may be out of reach: that is an answer
        assert planning.exact_plan(loaded).time_s > 0.0


def test_one_test_on_ramps_serves_both_sensors():
    sizes = {"gyro_x": 1e-3, "acc_x": 0.1}
    both = [found_effect("temperature_rate", c, size, size / 20.0) for c, size in sizes.items()]
    _, loaded = updated(UAV, *both)
    test = loaded.spec.tests["show_temperature_rate"]
    assert test.calibrates == ("gyro.temperature_rate", "accelerometer.temperature_rate")


@pytest.mark.parametrize("effect", ["temperature_rate", "temperature_rate_table"])
def test_what_ramps_show_gets_a_test_on_ramps(tmp_path, effect):
    """As far as the chamber, which goes at 2 K/min one way, has room: 4.5 K beyond a record of a minute."""
    spec = small(effects=["bias"])
    spec["requirement"] = [{"error": "position", "limit": "1000 km", "rule": "rss"}]
    spec |= {"sensitivities": "simulated", "trajectory": {"name": "level", "duration": "20 s"}}
    spec["benches"]["rate_table"] |= {"axes": 2, "move": "5 s"}
    path = tmp_path / "spec.yaml"
    path.write_text(yaml.safe_dump(spec, sort_keys=False), encoding="utf-8")
    made, loaded = updated(path, found_effect(effect, "gyro_x", 1e-3, 1e-5))
    test = loaded.spec.tests[f"show_{effect}"]
    assert test.calibrates == (f"gyro.{effect}",)
    assert test.ramp is not None
    assert test.ramp.ramp * 60.0 == pytest.approx(2.0)
    assert loaded.spec.unit.gyro[effect].systematic.si >= 1e-3  # a test calibrates it: its whole size
    assert len(test.temperatures) == (6 if effect.endswith("table") else 2)
    assert not any("no test" in note for note in made.notes)


def test_a_new_test_is_added_when_none_shows_the_effect(tmp_path):
    spec = small(effects=["bias", "bias_temperature"])
    spec["sensitivities"] = "simulated"
    spec["trajectory"] = {"name": "level", "duration": "20 s"}
    spec["benches"]["rate_table"]["axes"] = 2
    path = tmp_path / "spec.yaml"
    path.write_text(yaml.safe_dump(spec, sort_keys=False), encoding="utf-8")
    _, loaded = updated(path, found_effect("scale_factor_asymmetry", "gyro_x", 1e-3, 1e-5))
    assert loaded.spec.tests["show_scale_factor_asymmetry"].calibrates == ("gyro.scale_factor_asymmetry",)


def test_published_coefficients_have_none_for_it_and_the_update_says_so():
    made, loaded = updated(SHIPPED / "published_optimum.yaml", found_effect("warm_up", "gyro_x", 1e-4, 1e-6))
    assert loaded.spec.unit.gyro["warm_up"].run_to_run is None
    assert any("published" in note for note in made.notes)


def test_two_channels_of_one_effect_are_one_error_of_the_spec():
    made, loaded = updated(
        LOOP,
        found_effect("g_sensitivity", "gyro_x", 1e-5, 1e-7),
        found_effect("g_sensitivity", "gyro_z", 3e-5, 1e-7),
    )
    assert made.text.count("    g_sensitivity:") == 1
    assert loaded.spec.unit.gyro["g_sensitivity"].systematic.si >= 3e-5


def test_doubts_are_said():
    effect = found_effect("warm_up", "gyro_x", 1e-4, 1e-6, {"time_constant": 300.0})
    effect = replace(effect, rivals=(Rival("temperature_rate", 1.0),), below_bench_uncertainty=True)
    made, _ = updated(LOOP, effect, unknown=(Unknown(("gyro_y",), "day", 0.001, 20.0),))
    said = " ".join(made.notes)
    for word in ("may be the bench", "temperature_rate", "time_constant", "varies with day"):
        assert word in said


@settings(deadline=None, max_examples=30)
@given(
    st.sampled_from(["[a, b]", "a", "\n    - a\n    - b", "[]", "[a,\n     b]", "[a, b]  # why"]),
    st.booleans(),
    st.booleans(),
)
def test_a_list_grows_in_its_own_style(written, crlf, last):
    text = f"x:\n  list: {written}\n" + ("" if last else "  other: 1  # kept\n")
    text = text.rstrip("\n") if last else text
    text = text.replace("\n", "\r\n") if crlf else text
    before = yaml.safe_load(text)
    edits = SpecText(text)
    edits.append(("x", "list"), ["new", "newer"])
    after = yaml.safe_load(edits.edited())
    old = before["x"].pop("list")
    old = [old] if isinstance(old, str) else old
    assert after["x"].pop("list") == [*old, "new", "newer"]
    assert after == before
    assert ("\r\n" in edits.edited()) == ("\r\n" in text)


@settings(deadline=None, max_examples=30)
@given(
    st.sampled_from(
        [
            "{a: 1}",
            "{}",
            "\n    a: 1\n    b: {c: 2}",
            "\n    a: 1  # why\n\n    # b\n    b: 2",
            "\n    a: |\n      t",
        ]
    ),
    st.booleans(),
)
def test_a_mapping_grows_in_its_own_style(written, last):
    text = f"x:\n  m: {written}\n" + ("" if last else "  other: 1  # kept\n")
    before = yaml.safe_load(text)
    edits = SpecText(text)
    edits.enter(("x", "m"), "new", "{z: 1}", "because")
    edits.enter(("x", "absent"), "key", "3")
    after = yaml.safe_load(edits.edited())
    assert after["x"].pop("absent") == {"key": 3}
    assert after["x"]["m"].pop("new") == {"z": 1}
    assert after == before


# ---------------------------------------------------------------- what it costs on the bench


def test_one_repeat_on_six_faces_tells_g_sensitivity_as_six_means_do():
    """Closed form: k_ij is half the difference of two faces, so s = σ/√2 per g, bias free besides."""
    spec = load_spec(LOOP).spec
    target = Target("gyro", "g_sensitivity", (0,), 1e-5)
    spread = repeat_spread(spec, run_of_test(spec, "static"), target, NOISE)
    assert spread * 9.80665 == pytest.approx(NOISE.white / math.sqrt(2.0), rel=1e-3)


def test_longer_records_tell_more_by_the_root():
    spec = load_spec(LOOP).spec
    target = Target("gyro", "g_sensitivity", (0,), 1e-5)
    run = run_of_test(spec, "static")
    longer = replace(run, duration=4.0 * run.duration)
    assert repeat_spread(spec, longer, target, NOISE) == pytest.approx(
        repeat_spread(spec, run, target, NOISE) / 2.0, rel=1e-3
    )


def test_a_day_cannot_be_seen_within_one_power_on():
    spec = load_spec(LOOP).spec
    target = Target("gyro", "ageing", (0, 1, 2), 1e-9)
    assert repeat_spread(spec, run_of_test(spec, "static"), target, NOISE) > 0.9 * UNKNOWN
    assert calibrating_test(spec, target, NOISE) is None


def test_what_is_nothing_at_the_temperature_of_the_room_is_told_at_an_end_of_the_range():
    """g-sensitivity per kelvin: 85 K from 20 degC the record of a face sees k · 85 K · g."""
    spec = load_spec(LOOP).spec
    target = Target("gyro", "g_sensitivity_temperature", (0, 1, 2), 2e-7)
    found = calibrating_test(spec, target, NOISE)
    assert found is not None
    furthest = max(abs(t - 20.0) for t in spec.plan.temperatures.range)
    plain = repeat_spread(spec, found.run, Target("gyro", "g_sensitivity", (0, 1, 2), 1e-5), NOISE)
    assert repeat_spread(spec, found.run, target, NOISE) == pytest.approx(plain / furthest, rel=0.05)


# ---------------------------------------------------------------- spreads


def assumption(assumed, low, measured, high, error="gyro.bias", part="run_to_run", chance=1e-6):
    return Assumption(error, part, "deg/s", assumed, measured, low, high, 50.0, "gyro_x", chance)


RUN_TO_RUN = float(np.radians(0.002))


def test_a_spread_is_replaced_only_where_the_interval_excludes_it():
    inside = assumption(RUN_TO_RUN, 0.9 * RUN_TO_RUN, 1.1 * RUN_TO_RUN, 1.3 * RUN_TO_RUN)
    above = assumption(RUN_TO_RUN, 1.5 * RUN_TO_RUN, 2.0 * RUN_TO_RUN, 2.6 * RUN_TO_RUN)
    with pytest.raises(InputError, match="nothing that the spec lacks"):
        updated(LOOP, assumptions=(inside,))
    made, loaded = updated(LOOP, assumptions=(above,))
    assert loaded.spec.unit.gyro["bias"].run_to_run_largest == pytest.approx(2.0 * RUN_TO_RUN, rel=0.01)
    assert loaded.spec.unit.gyro["bias"].power_ons == 51  # 50 degrees of freedom
    assert "instead of 0.002 deg/s" in made.changes[0]


def test_what_one_of_so_many_spreads_is_by_chance_replaces_no_budget():
    """With chance 0.015 `budget_exceeded` does not list it, and `update` wrote it."""
    above = assumption(RUN_TO_RUN, 1.1 * RUN_TO_RUN, 4.0 * RUN_TO_RUN, 20.0 * RUN_TO_RUN, chance=0.015)
    assert diagnosis(LOOP, assumptions=(above,)).found.budget_exceeded == ()
    with pytest.raises(InputError, match="nothing that the spec lacks"):
        updated(LOOP, assumptions=(above,))


def test_a_unit_noisier_than_its_spec_has_its_noise_written_and_one_less_noisy_keeps_it(tmp_path):
    text, one = LOOP.read_text(encoding="utf-8"), tmp_path / "one.yaml"
    one.write_text(
        text.replace("unit:\n", "unit:\n  noise: {gyro: 0.002 deg/s/sqrt(Hz)}\n", 1), encoding="utf-8"
    )
    size = float(np.radians(0.002))
    louder = assumption(size, 1.5 * size, 2.0 * size, 2.6 * size, "gyro.noise", "white_of_1_s")
    made, loaded = updated(one, assumptions=(louder,))
    assert loaded.spec.unit.white("gyro") == pytest.approx(2.0 * size, rel=0.01)
    assert "unit.noise.gyro: measured 0.004 deg/s/sqrt(Hz)" in made.changes[0]
    quieter = assumption(size, 0.4 * size, 0.5 * size, 0.6 * size, "gyro.noise", "white_of_1_s")
    with pytest.raises(InputError, match="nothing that the spec lacks"):
        updated(one, assumptions=(quieter,))


def test_a_spread_comes_down_only_when_every_channel_says_so():
    low = assumption(RUN_TO_RUN, 0.4 * RUN_TO_RUN, 0.5 * RUN_TO_RUN, 0.6 * RUN_TO_RUN)
    lower = assumption(RUN_TO_RUN, 0.2 * RUN_TO_RUN, 0.3 * RUN_TO_RUN, 0.4 * RUN_TO_RUN)
    unsure = assumption(RUN_TO_RUN, 0.5 * RUN_TO_RUN, 0.8 * RUN_TO_RUN, 1.2 * RUN_TO_RUN)
    _, loaded = updated(LOOP, assumptions=(low, lower))
    assert loaded.spec.unit.gyro["bias"].run_to_run_largest == pytest.approx(0.5 * RUN_TO_RUN, rel=0.01)
    with pytest.raises(InputError):
        updated(LOOP, assumptions=(low, unsure))


def test_a_spread_in_the_longer_form_is_replaced_in_its_place(tmp_path):
    path, text = tmp_path / "longer.yaml", LOOP.read_text(encoding="utf-8")
    longer = "run_to_run: {value: 0.002 deg/s, temperature_correlation: 40 K}"
    path.write_text(text.replace("run_to_run: 0.002 deg/s", longer, 1), encoding="utf-8")
    above = assumption(RUN_TO_RUN, 1.5 * RUN_TO_RUN, 2.0 * RUN_TO_RUN, 2.6 * RUN_TO_RUN)
    _, loaded = updated(path, assumptions=(above,))
    budget = loaded.spec.unit.gyro["bias"]
    assert budget.run_to_run_largest == pytest.approx(2.0 * RUN_TO_RUN, rel=0.01)
    assert budget.temperature_correlation == 40.0


def test_a_spread_over_temperature_keeps_its_shape_and_its_unit():
    path = SHIPPED / "tactical_leg.yaml"
    old = load_spec(path).spec.unit.gyro["bias"].run_to_run
    mean = float(np.mean([q.si for q in old.values()]))
    _, loaded = updated(path, assumptions=(assumption(mean, 2.5 * mean, 3.0 * mean, 4.0 * mean),))
    new = loaded.spec.unit.gyro["bias"].run_to_run
    for t, q in new.items():
        assert q.si == pytest.approx(3.0 * old[t].si, rel=0.01)
        assert "deg/h" in q.text


def test_what_the_data_cannot_tell_changes_nothing():
    vague = assumption(RUN_TO_RUN, math.nan, 3 * RUN_TO_RUN, math.nan)
    with pytest.raises(InputError):
        updated(LOOP, assumptions=(vague,))


def test_what_is_left_without_a_name_widens_the_budget_of_the_bias():
    unnamed = Unknown(("gyro_x",), "time_on", 1e-6, 9.0)
    left = ResidualChange("gyro_x", "deg/s", *[5e-5] * 6, *[4e-5] * 2, 3e-5, 100, 20, True, "")
    made = Diagnosis(
        UnitDiagnosis("u1", "unexplained", (), (unnamed,), (), (), (), ()),
        (left,), (), (), "0", "x", load_spec(LOOP).sha256, "a" * 64, "data.csv", 1,
    )  # fmt: skip
    found = updated_spec(LOOP.read_text(encoding="utf-8"), load_spec(LOOP), made)
    before = load_spec(LOOP).spec.unit.gyro["bias"].in_run_sigma
    after = spec_from_bytes(found.text.encode(), LOOP).spec.unit.gyro["bias"].in_run_sigma
    assert after == pytest.approx(np.hypot(before, 4e-5), rel=0.01)


def test_what_does_not_help_in_flight_is_not_declared():
    worse = NavigationCost("position", "m", 6.35, 32.6, 0.95, "flown")
    assert not worse.helps
    made = replace(diagnosis(LOOP, found_effect("g_sensitivity", "gyro_x", 1e-5, 1e-7)), navigation=(worse,))
    with pytest.raises(InputError, match="does not help in flight"):
        updated_spec(LOOP.read_text(encoding="utf-8"), load_spec(LOOP), made)


# ---------------------------------------------------------------- refusals


def test_a_diagnosis_of_another_spec_is_refused():
    effect = found_effect("g_sensitivity", "gyro_x", 1e-5, 1e-7)
    with pytest.raises(InputError, match="another spec"):
        updated(LOOP, effect, sha256="0" * 64)


def test_nothing_found_is_nothing_to_update():
    with pytest.raises(InputError, match="nothing to update"):
        updated(LOOP)


def test_what_the_spec_declares_already_is_refused():
    with pytest.raises(InputError, match="declares g_sensitivity already"):
        updated(SHIPPED / "high_g.yaml", found_effect("g_sensitivity", "gyro_x", 1e-5, 1e-7))


# ---------------------------------------------------------------- the new plan


def test_the_new_spec_plans_and_keeps_the_limit_for_more_hours():
    _, loaded = updated(LOOP, found_effect("g_sensitivity", "gyro_x", 1e-4, 1e-6))
    old, new = shipped_plan("close_the_loop").plan, planning.exact_plan(loaded)
    assert new.requirements[0].met
    assert new.time_s >= old.time_s  # the same limit with one error more
    assert "gyro.g_sensitivity" in {a.error for a in new.allowances}
    assert re.search("g_sensitivity", " ".join(t for test in new.tests for t in test.calibrates))


def test_both_specs_are_planned_as_plan_does_without_what_nobody_is_shown():
    old, tighter = small(), with_limit(small(), "9 m")
    both = replanned(loaded(old), loaded(tighter), silent)
    for made, spec in ((both.old, old), (both.new, tighter)):
        whole = planned(spec).plan
        assert (made.time_s, made.bound_s, made.steps) == (whole.time_s, whole.bound_s, whole.steps)
        assert [r.achieved for r in made.requirements] == [r.achieved for r in whole.requirements]
        assert (made.genetic, whole.genetic is None) == (None, False)
