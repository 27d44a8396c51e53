"""Before and after on rows that the fit has not seen: honest figures, honest intervals, said how."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.diagnose.channels.unseen_runs import cells_of, folds_of
from planner.diagnose.diagnosis_to_residual import residual_changes, unit_fits
from planner.diagnose.mean_squares import mean_square, noise_floor, within
from planner.dwells.table_rows import by_run, rows_of
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.spec.load import load_spec
from tests.calibrate.world import Hidden, Layout, Noise, campaign, sized
from tests.diagnose.found import found_effect, unit_diagnosis
from tests.specs import SHIPPED

SPEC = load_spec(SHIPPED / "small_uav.yaml").spec
SMALL = Layout(temperatures=(-40.0, 20.0, 60.0), rate_temperatures=(-40.0, 20.0, 60.0), later=(30.0,))
NOTHING = UnitDiagnosis("u1", "clean", (), (), (), (), (), ())


def changes(table: DwellTable, found: UnitDiagnosis = NOTHING):
    return {c.channel: c for c in residual_changes(unit_fits(table, SPEC, found))}


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3])
def test_the_missing_effect_takes_the_residual_down_to_the_noise(seed):
    hidden = sized(Hidden("g_sensitivity", "gyro_y"), 60.0, seed, SMALL)
    table = campaign(seed, [hidden], SMALL)
    found = unit_diagnosis(table, SPEC, [found_effect("g_sensitivity", "gyro_y", 1e-5, 1e-6)])
    change = changes(table, found)["gyro_y"]
    assert change.held_out
    assert change.sigma_before > 2.0
    # 1 is noise alone; the moments of 300 rows know σ to about a tenth
    assert change.sigma_after == pytest.approx(1.0, abs=0.35)
    assert change.within_after < change.within_before
    assert change.after <= change.before
    assert change.within_after < 1.3 * change.noise_floor_within
    assert change.after_low < change.after < change.after_high


@pytest.mark.parametrize("seed", [4, 5])
def test_where_nothing_was_found_before_is_after_and_equals_the_noise_floor(seed):
    for change in changes(campaign(seed, (), SMALL)).values():
        assert (change.before, change.within_before) == (change.after, change.within_after)
        # a held-out row also carries the error of the coefficients: a third more at most with three repeats
        assert 0.6 < change.after / change.noise_floor < 1.6


@pytest.mark.parametrize("seed", [6])
@pytest.mark.further("seed", [7])
def test_an_effect_that_is_not_there_buys_nothing_on_runs_not_seen(seed):
    """In the rows that were fitted three more coefficients always lower the residual."""
    table = campaign(seed, (), SMALL)
    found = unit_diagnosis(table, SPEC, [found_effect("g_sensitivity", "gyro_z", 1e-9, 1e-9)])
    fits = unit_fits(table, SPEC, found)
    (channel,) = [c for c in fits.channels if c.channel == "gyro_z"]
    # in sample, weighted as the fit weighs: never worse
    white = channel.before.v.whiten(np.column_stack([channel.before.residual, channel.after.residual]))
    assert np.sum(white[:, 1] ** 2) <= np.sum(white[:, 0] ** 2) * (1 + 1e-6)
    change = changes(table, found)["gyro_z"]
    assert change.sigma_after > 0.99 * change.sigma_before


def test_the_level_of_a_power_on_is_no_noise_within_it_however_unequally_long_its_records_last():
    rng = np.random.default_rng(9)
    group, sigma = np.repeat(np.arange(200), 10), np.tile([1.0, 2.0], 1000)
    noise = sigma * rng.normal(size=2000)
    level = 100.0 * rng.normal(size=200)[group]
    # 1 800 degrees of freedom know σ to 1.7 %
    assert within(noise, group, sigma) == pytest.approx(1.0, abs=0.06)
    assert within(noise + level, group, sigma) == pytest.approx(within(noise, group, sigma), rel=1e-9)


@pytest.mark.parametrize("seed", [13])
@pytest.mark.further("seed", [14])
def test_ten_times_the_spread_of_power_ons_leaves_the_same_within_them(seed):
    quiet, loud = (changes(campaign(seed, (), SMALL, Noise(acc_run=x))) for x in (8e-4, 8e-3))
    for channel in ("accelerometer_x", "accelerometer_y", "accelerometer_z"):
        assert loud[channel].sigma_after == pytest.approx(quiet[channel].sigma_after, rel=0.1)


def test_forty_sigma_outliers_in_four_of_a_thousand_rows_do_not_carry_the_figures():
    clean, struck = (changes(campaign(8, (), SMALL, Noise(outliers=x))) for x in (0.0, 0.004))
    for name, change in struck.items():
        assert change.within_after < 1.3 * clean[name].within_after
    assert any("far off" in c.how for c in struck.values())


def test_the_interval_of_a_root_mean_square_covers_as_often_as_it_says():
    rng, hit, tries = np.random.default_rng(5), 0, 600
    group = np.repeat(np.arange(40), 6)
    truth = np.sqrt(1.0 + 0.5)
    for _ in range(tries):
        residual = rng.normal(size=240) + np.sqrt(0.5) * rng.normal(size=40)[group]
        _, low, high = mean_square(residual, group)
        hit += low <= truth <= high
    # 600 tries know a 95 % frequency to ±1.8 % (two sigma); the linearised variance of 40 groups costs 3 %
    assert 0.90 <= hit / tries <= 0.985


def test_the_noise_floor_of_replicates_is_their_standard_deviation():
    rng = np.random.default_rng(3)
    cells, group = np.repeat(np.arange(100), 6), np.tile(np.arange(6), 100) + 6 * np.repeat(np.arange(100), 6)
    curve = 10.0 * rng.normal(size=100)[cells]  # what is alike within a cell is no noise
    total, within = noise_floor(curve + rng.normal(size=600), group, cells)
    assert total == pytest.approx(1.0, rel=0.1)  # 500 degrees of freedom know it to 3 %
    assert np.isnan(within)  # every run is one row: nothing is known within runs


# ---------------------------------------------------------------- which rows are held out


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10_000), st.integers(1, 4))
def test_a_power_on_is_never_split_and_its_condition_stays_in_the_fit(seed, repeats):
    layout = replace(SMALL, static_repeats=repeats, rate_repeats=repeats, ramps=False, centrifuge=False)
    table, starts = by_run(campaign(seed, (), layout))
    folds = folds_of(table.conditions(), starts)
    if folds.split != "runs":
        return
    cells = cells_of(table.conditions())
    for rows in np.split(folds.fold, starts[1:]):
        assert len(set(rows.tolist())) == 1
    for k in range(folds.fold.max() + 1):
        assert set(cells[folds.fold == k]) <= set(cells[folds.fold != k])


def test_a_single_power_on_is_held_out_by_branches_of_its_temperature_and_says_so():
    table, starts = by_run(sweep(up_and_down=True))
    folds = folds_of(table.conditions(), starts)
    assert folds.fold.max() == 1
    assert "branches of the temperature" in folds.how
    assert folds.split == "branches"
    for change in changes(sweep(up_and_down=True)).values():
        assert change.held_out
        assert "branches" in change.how


def test_without_repeats_and_branches_blocks_of_time_are_held_out_and_called_flattering():
    for change in changes(sweep(up_and_down=False)).values():
        assert "flatter" in change.how
        assert np.isfinite(change.after)


def sweep(up_and_down: bool) -> DwellTable:
    """One power-on at rest on one face while the temperature passes from -20 to 60 degC, and back."""
    table = campaign(1, (), SMALL)
    n = 160
    table = rows_of(table, np.zeros(n, dtype=int))
    t = np.linspace(0.0, 2.0 if up_and_down else 1.0, n)
    temperature = -20.0 + 80.0 * np.where(t > 1.0, 2.0 - t, t)
    rng = np.random.default_rng(2)
    return replace(
        table,
        time_on=10.0 + 60.0 * np.arange(n),
        temperature_degc=temperature,
        gyro=table.gyro + 1e-6 * temperature[:, None] + 2e-5 * rng.normal(size=(n, 3)),
        acc=table.acc + 1e-3 * rng.normal(size=(n, 3)),
    )


@pytest.mark.parametrize(("rows", "sensors"), [(12, {"gyro"}), (None, {"gyro", "accelerometer"})])
def test_accelerometers_without_a_reference_have_figures_where_many_rows_share_an_attitude(rows, sensors):
    """Twelve rows in six attitudes are their own reference, so nothing is left to judge them by."""
    table = campaign(2, (), replace(SMALL, rate_temperatures=(), centrifuge=False))
    some = rows_of(table, np.arange(len(table) if rows is None else rows))
    found = changes(replace(some, ref_acc=None, ref_rate=None))
    assert {name.split("_")[0] for name in found} == sensors


def test_a_table_too_large_for_matrices_is_thinned_by_whole_power_ons_and_says_so(monkeypatch):
    from planner.diagnose import diagnosis_to_residual as stage

    table = campaign(9, (), SMALL)
    whole = changes(table)
    monkeypatch.setattr(stage, "MOST_ROWS", len(table) // 2 + 1)
    for name, change in changes(table).items():
        assert "of the rows, evenly taken" in change.how
        assert change.rows < whole[name].rows
        assert 0.7 < change.within_after / whole[name].within_after < 1.4


@pytest.mark.parametrize("rows", [1, 2, 3, 5, 8, 20])
def test_a_table_of_a_few_rows_has_figures_that_say_that_nothing_was_held_out(rows):
    table = rows_of(campaign(1, (), SMALL), np.arange(rows))
    for change in changes(table).values():
        assert change.held_out or "fitted" in change.how
        assert np.isfinite(change.before)


def test_readings_without_noise_have_a_residual_of_zero():
    table = campaign(1, (), SMALL)
    for change in changes(replace(table, gyro=table.ref_rate, acc=table.ref_acc)).values():
        assert change.before <= 1e-9
        assert change.noise_floor <= 1e-9
