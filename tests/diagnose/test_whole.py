"""The diagnosis of one unit as a whole: verdicts, coefficients, limits, evidence, refusals and odd tables."""

from __future__ import annotations

import gc
from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.findings import evidence
from planner.diagnose.hypotheses.pool import Pool
from planner.dwells.table_rows import rows_of
from planner.errors import InputError
from planner.report.charts import residuals
from tests.calibrate.world import Hidden, Layout, Noise, campaign
from tests.diagnose.worlds import spec, whole

SMALL = Layout(later=(30.0,), rate_repeats=2, centrifuge=False)
NOT_GONE = ("clean", "untestable")


@pytest.fixture(scope="module")
def warm():
    """Warm-up of 0.02 deg/s and 500 s on gyro x."""
    return campaign(5, [Hidden("warm_up", "gyro_x", 0.02, tau_s=500.0)], SMALL)


@pytest.fixture(scope="module")
def found(warm):
    """Its diagnosis, which takes two seconds: made once for all that is asked of it."""
    return whole(warm)


@pytest.fixture(scope="module")
def gyros(warm):
    """Its gyros alone."""
    return replace(warm, acc=None)


@pytest.fixture(scope="module")
def found_of_gyros(gyros):
    """Their diagnosis, where what is asked needs no second sensor."""
    return whole(gyros)


def test_coefficients_come_with_intervals_that_hold_the_truth(found) -> None:
    assert found.verdict == "explained"
    (effect,) = found.effects
    assert (effect.effect, effect.channels) == ("warm_up", ("gyro_x",))
    size, tau = effect.terms
    assert tau.parameter
    assert tau.low < 500.0 < tau.high
    half = (size.high - size.low) / 2.0
    assert abs(size.value - np.radians(0.02)) < 2.0 * half < 0.5 * np.radians(0.02)
    assert effect.p_value < 0.01
    assert not effect.below_bench_uncertainty


def test_evidence_stands_in_the_order_of_the_table(gyros, found_of_gyros) -> None:
    order = np.random.default_rng(1).permutation(len(gyros))
    straight, mixed = found_of_gyros, whole(rows_of(gyros, order))
    for a, b in zip(straight.evidence, mixed.evidence, strict=True):
        np.testing.assert_allclose(a.before[order], b.before, atol=1e-9)
        np.testing.assert_allclose(a.expected[order], b.expected, rtol=1e-6)
    x = next(e for e in straight.evidence if e.channel == "gyro_x")
    assert np.std(x.after) < np.std(x.before)
    adds, reading = x.added["warm_up"].T
    assert np.polyfit(adds, reading, 1)[0] == pytest.approx(1.0, abs=0.1)


def test_evidence_of_a_large_table_is_of_rows_that_it_names(gyros, found_of_gyros, monkeypatch) -> None:
    monkeypatch.setattr(evidence, "MOST_ROWS", 100)
    for some, every in zip(whole(gyros).evidence, found_of_gyros.evidence, strict=True):
        assert 50 < len(some.rows) <= 100
        np.testing.assert_allclose(some.before, every.before[some.rows])
        np.testing.assert_allclose(some.expected, every.expected[some.rows])
        assert {n: a.shape for n, a in some.added.items()} == {n: (len(some.rows), 2) for n in every.added}
        assert residuals.most_telling(some, gyros)[0].values.shape == some.before.shape


def test_the_same_seed_gives_the_same_answer_and_keeps_nothing_of_the_search(gyros, found_of_gyros) -> None:
    gc.collect()
    gc.disable()  # then only what holds itself outlives a diagnosis
    try:
        one, two = found_of_gyros, whole(gyros)
        assert [o for o in gc.get_objects() if isinstance(o, Pool)] == []
    finally:
        gc.enable()
    assert one.effects == two.effects
    assert one.not_found == two.not_found


def test_limits_of_what_was_not_found_are_below_what_would_have_been(found) -> None:
    limits = {(n.effect, n.sensor): n.upper_limit for n in found.not_found}
    assert 0.0 < limits["temperature_rate", "gyro"] < np.radians(0.002) * 60.0  # per K/s
    assert ("warm_up", "gyro") not in limits
    assert ("warm_up", "accelerometer") in limits


def test_what_the_centrifuge_shows_is_untestable_without_one(found) -> None:
    untestable = {u.effect for u in found.untestable}
    assert "arm_bending" in untestable


def test_an_effect_that_the_spec_declares_is_no_candidate(warm) -> None:
    from planner.diagnose.dwells_to_diagnosis import diagnose

    declared = spec().model_copy(update={"effects": [*spec().effects, "warm_up"]})
    found = diagnose(replace(warm, acc=None), declared)
    assert found.verdict == "clean"
    assert "warm_up" not in {n.effect for n in found.not_found}


def test_rows_twice_do_not_fake_certainty(gyros, found_of_gyros) -> None:
    twice = rows_of(gyros, np.repeat(np.arange(len(gyros)), 2))
    once, doubled = found_of_gyros, whole(twice)
    assert any("count once" in note for note in doubled.notes)
    assert doubled.effects == once.effects
    assert len(doubled.evidence[0].before) == len(twice)


# ---------------------------------------------------------------- odd tables


def test_too_few_power_ons_make_effects_between_them_untestable() -> None:
    table = campaign(6, layout=SMALL)
    few = rows_of(table, np.isin(table.run, np.unique(table.run)[:7]))
    found = whole(few)
    assert found.verdict in NOT_GONE
    assert {"ageing", "bias_step"} <= {u.effect for u in found.untestable if u.sensor == "gyro"}


def test_a_single_run_is_judged_without_a_crash() -> None:
    table = campaign(6, layout=SMALL)
    rates = np.unique(table.run)[-1]
    found = whole(rows_of(table, table.run == rates))
    assert found.verdict in NOT_GONE
    assert found.untestable


def test_one_temperature_makes_temperature_effects_untestable() -> None:
    table = campaign(7, layout=replace(SMALL, temperatures=(20.0,), rate_temperatures=(20.0,), ramps=False))
    flat = replace(table, temperature_degc=np.full(len(table), 20.0), temperature_rate=np.zeros(len(table)))
    found = whole(flat)
    assert found.verdict == "clean"
    assert {"temperature_rate", "misalignment_temperature"} <= {u.effect for u in found.untestable}


def test_quantised_readings_claim_nothing() -> None:
    table = campaign(8, layout=SMALL)
    assert table.gyro is not None
    step = np.radians(0.001)
    found = whole(replace(table, gyro=np.round(table.gyro / step) * step, acc=None))
    assert found.verdict == "clean"


def test_readings_without_noise_show_what_hides_and_nothing_else() -> None:
    quiet = Noise(gyro=0.0, acc=0.0, gyro_run=0.0, acc_run=0.0, scale_run=0.0, rate=0.0)
    table = campaign(9, [Hidden("temperature_rate", "gyro_z", 0.01)], SMALL, quiet)
    found = whole(replace(table, acc=None))
    assert {e.effect for e in found.effects if "gyro_z" in e.channels} >= {"temperature_rate"}


@pytest.mark.parametrize("missing", ["gyro", "acc"])
def test_one_sensor_alone_is_diagnosed(missing: str) -> None:
    found = whole(replace(campaign(10, layout=SMALL), **{missing: None}))
    assert found.verdict == "clean"
    sensor = "gyro" if missing == "gyro" else "accelerometer"
    assert {u.sensor for u in found.untestable if "no columns" in u.why} == {sensor}


def test_rests_without_references_show_a_temperature_rate() -> None:
    """|f| = g and rest stand in for the references."""
    table = campaign(11, [Hidden("temperature_rate", "gyro_x", 0.01)], SMALL)
    still = np.linalg.norm(table.ref_rate, axis=1) < 1e-3
    found = whole(replace(rows_of(table, still), ref_rate=None, ref_acc=None))
    assert ("temperature_rate", ("gyro_x",)) in {(e.effect, e.channels) for e in found.effects}


def test_too_few_rows_and_no_readings_are_refused() -> None:
    table = campaign(12, layout=SMALL)
    with pytest.raises(InputError, match="too few"):
        whole(rows_of(table, np.arange(5)))
    with pytest.raises(InputError, match="no readings"):
        whole(replace(table, gyro=None, acc=None))
