"""Without a precise table: recalibration on top of an old one, gyros by Poisson."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from planner.calibrate.correction import corrected, true_input
from planner.calibrate.dwells_to_fit import calibrate
from planner.calibrate.fit_options import FitOptions
from planner.calibrate.in_store import combined
from planner.calibrate.methods import fit_options
from planner.calibrate.poisson_gyro import Turn, poisson_gyro
from planner.cli import app
from planner.dwells.dwell_files import write_dwells
from planner.dwells.table_rows import rows_of
from planner.errors import InputError
from planner.nouns.calibration import Tables
from planner.nouns.dwell_table import DwellTable
from planner.units import STANDARD_GRAVITY_MPS2 as G
from tests.calibrate import world
from tests.calibrate.truths import LAYOUT, any_spec
from tests.data import recording
from tests.data import table as reduced
from tests.recordings.rested import rests, table_of
from tests.specs import SHIPPED

DEG = np.pi / 180.0


# ---------------------------------------------------------------- recalibration


def old_tables(seed: int) -> Tables:
    rng = np.random.default_rng(seed)
    return Tables(
        np.array([-40.0, 20.0, 60.0]),
        1e-3 * rng.normal(size=(3, 3)),
        3e-3 * rng.normal(size=(3, 3)),
        1e-4 * rng.normal(size=3),
        np.eye(3) + 5e-3 * rng.normal(size=(3, 3)) * (1.0 - np.eye(3)),
    )


@pytest.mark.parametrize("seed", range(3))
def test_combined_tables_are_the_two_corrections_one_after_the_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    old, b, k = old_tables(seed), 1e-3 * rng.normal(size=3), 1e-3 * rng.normal(size=3)
    old = replace(old, asymmetry=np.zeros(3))  # its kink stays at the old zero: second order, tested below
    y = rng.normal(size=(50, 3))
    t = world.campaign(1, layout=LAYOUT)
    conditions = replace(rows_of(t, np.arange(50)).conditions(), temperature_degc=rng.uniform(-60, 80, 50))
    twice = (true_input(y, old, "gyro", conditions) - b) / (1.0 + k)
    once = true_input(y, combined(old, b, k), "gyro", conditions)
    np.testing.assert_allclose(once, twice, rtol=0, atol=1e-14)


@pytest.mark.parametrize("seed", [0])
@pytest.mark.further("seed", [1, 2])
def test_a_few_records_in_store_renew_an_old_calibration(seed: int, tmp_path: Path) -> None:
    """Storage moves bias and scale factor; six rests and six turns at one temperature bring both back.

    K table 2.19: the residual bias falls by 70-80 %.
    """
    first = world.campaign(seed, layout=LAYOUT, noise=world.Noise(gyro_run=1e-4, acc_run=1e-5))
    spec = any_spec().model_copy(
        update={"effects": ("bias", "bias_temperature", "scale_factor", "misalignment")}
    )
    (old,) = calibrate(first, spec)
    tables = {s.sensor: s.tables for s in old.sensors}
    rng = np.random.default_rng(seed)
    moved = {"gyro": 0.015 * DEG * rng.choice([-1, 1], 3), "acc": 7e-3 * G * rng.choice([-1, 1], 3)}
    aged = replace(
        first,
        gyro=first.gyro * 1.0006 + moved["gyro"],
        acc=first.acc * 1.0008 + moved["acc"],
    )
    few = np.concatenate([np.flatnonzero(first.run == r) for r in np.unique(first.run)[[0, 12, 13, 14]] if r])
    few = np.flatnonzero(np.isin(first.run, first.run[few]) & (first.temperature_degc < 20.0))
    (new,) = calibrate(rows_of(aged, few), spec, FitOptions(prior=tables))
    both = {s.sensor: s.tables for s in new.sensors}
    assert {s.method for s in new.sensors} == {"recalibration"}
    hot = rows_of(aged, np.flatnonzero(first.temperature_degc > 20.0))  # not among those records
    still = np.linalg.norm(hot.ref_rate, axis=1) < 1.0 * DEG
    for name, reference in (("gyro", "ref_rate"), ("acc", "ref_acc")):
        off = [
            np.sqrt(np.mean((getattr(corrected(hot, t), name) - getattr(hot, reference))[still] ** 2))
            for t in (tables, both)
        ]
        assert off[1] < 0.3 * off[0]


@pytest.mark.charts
def test_the_command_takes_a_prior(tmp_path: Path) -> None:
    spec = str(SHIPPED / "small_uav.yaml")
    data = tmp_path / "data.csv"
    write_dwells(world.campaign(1, layout=LAYOUT), data)

    def run(*more: str) -> dict:
        found = CliRunner().invoke(app, ["calibrate", str(data), "--spec", spec, "--json", *more])
        assert found.exit_code == 0, found.output
        return json.loads(found.stdout)["result"]

    run("-o", str(tmp_path / "one"))
    for name in ("calibration.json", "random.json", "calibration.h", "calibration.bin", "before_after.svg"):
        assert (tmp_path / "one" / name).stat().st_size > 300
    again = run("-o", str(tmp_path / "two"), "--prior", str(tmp_path / "one"))
    changes = [c for c in again["sensors"]["gyro"]["coefficients"] if c["error"] == "gyro.bias"]
    assert all(abs(c["value"]) < 3e-3 for c in changes)  # nothing has moved since, by more than a run does


def test_a_prior_of_another_method_is_refused() -> None:
    with pytest.raises(InputError, match="general estimator"):
        fit_options("triad_least_squares", "no", None, {})
    t = replace(world.campaign(1, layout=LAYOUT), acc=None)
    with pytest.raises(InputError, match="no sensor that this table measures"):
        calibrate(t, any_spec(), FitOptions(prior={"accelerometer": old_tables(1)}))


# ---------------------------------------------------------------- Poisson


def turns_of(K: np.ndarray, rng: np.random.Generator, n: int, noise: float) -> list[Turn]:
    """Random turns of 60 to 200 deg in steps about wandering axes, gravity turned by scipy."""
    found, attitude = [], Rotation.from_rotvec(rng.normal(size=3))
    bias = 0.01 * rng.normal(size=3)
    for _ in range(n):
        before = attitude.inv().apply([0.0, 0.0, G])
        axis = rng.normal(size=3)
        rates = np.array([1.5 * (axis + 0.3 * rng.normal(size=3)) / np.linalg.norm(axis) for _ in range(40)])
        spacing = np.full(40, rng.uniform(0.02, 0.05))
        for rate, dt in zip(rates, spacing, strict=True):
            attitude = attitude * Rotation.from_rotvec(rate * dt)
        after = attitude.inv().apply([0.0, 0.0, G])
        read = rates @ K.T + bias
        found.append(Turn(read, spacing, bias, before, after + noise * G * rng.normal(size=3)))
    return found


@pytest.mark.parametrize("seed", range(4))
def test_exact_turns_give_the_gyro_matrix_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    K = np.eye(3) + 0.03 * rng.normal(size=(3, 3))
    fit = poisson_gyro(turns_of(K, rng, 12, 0.0))
    np.testing.assert_allclose(fit.K, K, atol=1e-8)
    assert not fit.undetermined.any()


def test_poisson_intervals_cover() -> None:
    from scipy.stats import t as student

    hits = []
    for seed in range(40):
        rng = np.random.default_rng([8, seed])
        K = np.eye(3) + 0.03 * rng.normal(size=(3, 3))
        fit = poisson_gyro(turns_of(K, rng, 12, 1e-3))
        half = student.ppf(0.975, fit.freedom) * np.sqrt(np.diag(fit.covariance))
        hits.append(np.abs((fit.K - K).ravel()) <= half)
    assert 0.90 <= np.mean(hits) <= 0.99  # 360 intervals, nine together: their share has a spread of 2 %


def test_a_turn_about_the_vertical_shows_nothing_and_is_named() -> None:
    flat = [
        Turn(np.array([[0.0, 0.0, r]]), np.ones(1), np.zeros(3), *np.array([[0, 0, G]] * 2))
        for r in (1.0, 2.0)
    ]
    fit = poisson_gyro(flat)
    assert fit.undetermined[8]
    with pytest.raises(ValueError, match="no turn"):
        poisson_gyro([])


@pytest.mark.parametrize("unit", range(5))
def test_hand_held_gyros_carry_gravity_from_rest_to_rest(unit: int) -> None:
    """Other people's units, turns in pieces as `reduce` gives them: gravity is met to 0.15 degrees."""
    whole, still = reduced(f"imu{unit}"), reduced(f"imu{unit}", "rest_")
    assert whole.gyro is not None
    f = forces(still)
    rest = np.flatnonzero(np.isin(whole.time_on, still.time_on))
    turns = [
        Turn(whole.gyro[a + 1 : b], whole.duration[a + 1 : b], whole.gyro[a], f[i], f[i + 1])
        for i, (a, b) in enumerate(pairwise(rest))
    ]
    fit = poisson_gyro(turns)
    assert len(turns) >= 15
    # every sample of the same turns leaves 0.0014 to 0.0021 rad (test_whole_flows)
    assert np.sqrt(3.0 * np.mean(fit.residual**2)) < 0.0025
    assert np.abs(np.diag(fit.K) - 1.0).max() < 0.02


@pytest.mark.parametrize("unit", [0])
@pytest.mark.further("unit", range(1, 5))
def test_samples_of_a_turn_carry_gravity_better_than_its_means(unit: int) -> None:
    path = recording(f"five_units_multi_position/imu{unit}.log", "every 10 ms of the turns between two rests")
    readings = np.loadtxt(path)
    acc, gyro = readings[:, :3], readings[:, 3:]
    pieces = rests(gyro, 100.0)
    still = table_of(acc, gyro, pieces, 100.0)
    f = forces(still)
    turns = [
        Turn(gyro[a.stop : b.start], np.full(b.start - a.stop, 0.01), still.gyro[i], f[i], f[i + 1])
        for i, (a, b) in enumerate(pairwise(pieces))
    ]
    fit = poisson_gyro(turns)
    assert np.sqrt(np.mean(fit.residual**2)) < 0.01
    assert np.abs(np.diag(fit.K) - 1.0).max() < 0.05


def forces(still: DwellTable) -> np.ndarray:
    """(n, 3) specific force at rests, by accelerometers that were calibrated on them."""
    (found,) = calibrate(still, any_spec(), FitOptions("free_orientations"))
    return true_input(still.acc, found.sensors[0].tables, "accelerometer", still.conditions())


def test_rests_and_turns_of_a_dwell_table_need_no_references() -> None:
    """Each turn about a fixed axis is one row: its mean rate and duration."""
    rng = np.random.default_rng(2)
    K = np.eye(3) + 0.02 * rng.normal(size=(3, 3))
    A, b = np.eye(3) + np.tril(0.01 * rng.normal(size=(3, 3))), np.array([0.1, -0.2, 0.15])
    bias = np.array([0.01, -0.02, 0.005])
    attitude = Rotation.identity()
    gyro, acc, seconds = [], [], []

    def rest() -> None:
        gyro.append(bias + 1e-5 * rng.normal(size=3))
        acc.append(A @ attitude.inv().apply([0, 0, G]) + b + 1e-4 * rng.normal(size=3))
        seconds.append(20.0)

    rest()
    for k in range(24):
        axis = np.roll([1.0, 0.4, -0.2], k) + 0.2 * rng.normal(size=3)
        rate = axis / np.linalg.norm(axis) * rng.uniform(0.5, 1.0)
        gyro.append(K @ rate + bias)
        acc.append(A @ attitude.inv().apply([0, 0, G]))
        seconds.append(2.0)
        attitude = attitude * Rotation.from_rotvec(2.0 * rate)
        rest()
    t = table_of(np.array(acc), np.array(gyro), [slice(i, i + 1) for i in range(len(acc))], 1.0)
    t = replace(t, duration=np.array(seconds), time_on=np.cumsum(seconds))
    (found,) = calibrate(t, any_spec(), FitOptions("rests_and_turns"))
    tables = found.sensors[0].tables
    np.testing.assert_allclose((1.0 + tables.scale[:, 0])[:, None] * tables.misalignment, K, atol=2e-4)
    np.testing.assert_allclose(tables.bias[:, 0], bias, atol=1e-5)
    with pytest.raises(InputError, match="rest, turn and rest again"):
        calibrate(rows_of(t, np.arange(0, len(t), 2)), any_spec(), FitOptions("rests_and_turns"))
