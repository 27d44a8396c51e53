"""Other people's recordings, and the published check of a triad."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.calibrate.correction import true_input
from planner.calibrate.dwells_to_fit import calibrate
from planner.calibrate.fit_options import FitOptions
from planner.calibrate.free_orientations import free_orientations
from planner.export.calibration import calibration_text
from planner.nouns.calibration import Coefficient, SensorCalibration
from planner.units import STANDARD_GRAVITY_MPS2 as G
from tests.calibrate.truths import any_spec
from tests.data import table as reduced
from tests.recordings.rested import table_of


def unknowns(K, b):
    """(9,) as a fit of free orientations has them."""
    return np.concatenate([np.diag(K) - 1.0, K[[1, 2, 2], [0, 0, 1]], b])


@pytest.mark.parametrize("unit", range(5))
@pytest.mark.parametrize("form", ["free_orientations", "free_orientations_symmetric"])
def test_hand_held_units_calibrate_to_their_noise(unit: int, form: str) -> None:
    table = reduced(f"imu{unit}", "rest_")
    assert len(table) >= 12
    (found,) = calibrate(table, any_spec(), FitOptions(form))
    (sensor,) = found.sensors
    assert {c.status for c in sensor.coefficients} == {"determined"}
    (residual,) = sensor.residuals
    # a rest's mean scatters by what the record itself scatters over the root of its samples; a hand is no
    # granite block, so twice that is allowed for slow motion, and 9 of about 15 equations go to the fit
    noise = float(np.median(table.acc_std / np.sqrt(100.0 * table.duration)[:, None]))
    after = residual.in_sample * np.sqrt(len(table) / (len(table) - 9))
    assert after < 3.0 * noise
    assert residual.before > 10.0 * after
    assert residual.held_out == (len(table) >= 14)
    assert residual.after < residual.before / 5.0


def by_name(sensor: SensorCalibration) -> dict[tuple[str, str], Coefficient]:
    return {(c.error.split(".")[1], c.term): c for c in sensor.coefficients}


def test_cube_and_free_orientations_agree_on_six_positions() -> None:
    """Faces alone do not show the lean, which free orientations say; scale factors and biases agree."""
    (cube,) = calibrate(reduced("six_positions"), any_spec(), FitOptions("cube"))
    halves = reduced("six_positions_in_halves", "rest_")  # nine unknowns: six rests are too few
    (free,) = calibrate(halves, any_spec(), FitOptions("free_orientations"))
    one, other = by_name(cube.sensors[1]), by_name(free.sensors[0])
    for effect in ("scale_factor", "bias"):
        for axis in "xyz":
            a, b = one[effect, axis], other[effect, axis]
            assert a.status == b.status == "determined"
            assert max(a.low, b.low) <= min(a.high, b.high), (effect, axis)
    assert all(other["misalignment", term].status == "undetermined" for term in ("yx", "zx", "zy"))
    assert any("edges too" in note for note in free.sensors[0].notes)


def test_the_cube_turns_give_a_gyro_whole_turns() -> None:
    table = reduced("six_positions")
    (cube,) = calibrate(table, any_spec(), FitOptions("cube"))
    gyros = cube.sensors[0]
    turned = true_input(table.gyro, gyros.tables, "gyro", table.conditions()) * table.duration[:, None]
    np.testing.assert_allclose(np.degrees(np.abs(turned[-3:])).max(axis=1), 360.0, atol=0.5)
    assert any("multiples of 90 deg" in note for note in cube.notes)


def test_a_thermal_sweep_fits_its_bias_over_temperature() -> None:
    """One unit at rest from −18 to 74 degC: the table takes most of the drift with temperature away."""
    table = reduced("thermal_sweep")
    table = replace(table, ref_rate=np.zeros((len(table), 3)), acc=None, acc_std=None)
    spec = any_spec().model_copy(update={"effects": ("bias", "bias_temperature", "temperature_rate")})
    (found,) = calibrate(table, spec)
    (gyros,) = found.sensors
    for residual in gyros.residuals:
        channel = "xyz".index(residual.channel)
        assert residual.in_sample < 0.7 * float(np.std(table.gyro[:, channel]))
    # what is left follows the sweep's direction, 20 times a record's noise, and is said
    assert sum("err alike" in note for note in gyros.notes) == 3
    nodes = [c for c in gyros.coefficients if c.error == "gyro.bias" and c.channel == "x"]
    assert len(nodes) >= 8
    assert min(c.temperature_degc for c in nodes) < -10.0
    assert max(c.temperature_degc for c in nodes) > 65.0


# ---------------------------------------------------------------- the triad's check (A)


@pytest.mark.parametrize("seed", range(5))
def test_a_triad_reaches_the_published_modulus(seed: int) -> None:
    """σ(|g|) over twelve orientations from about 0.2 to under 1e-3 m/s² (A: 0.21 → 3.3e-4)."""
    rng = np.random.default_rng(seed)
    f = G * orientations()
    K = np.eye(3) + rng.uniform(-0.02, 0.02, (3, 3))
    b = rng.uniform(0.1, 0.3, 3) * rng.choice([-1.0, 1.0], 3)
    a = f @ K.T + b + 3e-4 * rng.normal(size=f.shape)  # noise of a record, of the order of what A has left
    table = replace(table_of(a, 0 * a, [slice(k, k + 1) for k in range(12)], 1.0), gyro=None, ref_acc=f)
    (found,) = calibrate(table, any_spec(), FitOptions("triad_least_squares"))
    corrected = true_input(a, found.sensors[0].tables, "accelerometer", table.conditions())
    before, after = (np.std(np.linalg.norm(x, axis=1), ddof=1) for x in (a, corrected))
    assert 0.1 < before < 0.5
    assert after < 1e-3
    assert any("over 12 orientations" in note for note in found.notes)
    M = found.sensors[0].tables
    np.testing.assert_allclose((1.0 + M.scale[:, 0])[:, None] * M.misalignment, K, atol=2e-4)


def orientations() -> np.ndarray:
    """(12, 3) the twelve edges of a cube."""
    sides = [(i, j, s, t) for i in range(3) for j in range(i) for s in (1, -1) for t in (1, -1)]
    found = np.zeros((12, 3))
    for k, (i, j, s, t) in enumerate(sides):
        found[k, i], found[k, j] = s, t
    return found / np.sqrt(2.0)


# ---------------------------------------------------------------- free orientations


@pytest.mark.parametrize("form", ["triangular", "symmetric"])
@pytest.mark.parametrize("seed", range(3))
def test_exact_readings_give_the_matrix_back(seed: int, form: str) -> None:
    rng = np.random.default_rng(seed)
    K = np.eye(3) + rng.uniform(-0.05, 0.05, (3, 3))
    K = np.tril(K) if form == "triangular" else (K + K.T) / 2.0
    b = rng.uniform(-0.5, 0.5, 3)
    f = np.vstack([orientations(), np.eye(3), -np.eye(3)]) * G
    f = f @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    fit = free_orientations(f @ K.T + b, form=form)
    np.testing.assert_allclose(fit.K, K, atol=1e-12)
    np.testing.assert_allclose(fit.b, b, atol=1e-11)
    assert not fit.undetermined.any()


def test_free_orientations_cover() -> None:
    """95 % ± 2 over 500 units in eighteen orientations."""
    hits = []
    directions = G * np.vstack([orientations(), np.eye(3), -np.eye(3)])
    from scipy.stats import t as student

    for seed in range(500):
        rng = np.random.default_rng([5, seed])
        K = np.eye(3) + np.tril(rng.uniform(-0.02, 0.02, (3, 3)))
        b = rng.uniform(-0.3, 0.3, 3)
        a = directions @ K.T + b + 2e-3 * rng.normal(size=(18, 3))
        fit = free_orientations(a)
        truth = unknowns(K, b)
        half = student.ppf(0.975, fit.freedom) * np.sqrt(np.diag(fit.covariance))
        hits.append(np.abs(unknowns(fit.K, fit.b) - truth) <= half)
    assert 0.93 <= np.mean(hits) <= 0.97
    assert (np.mean(hits, axis=0) > 0.92).all()


def test_lean_that_faces_do_not_show_is_within_the_interval() -> None:
    """Six faces twice, axes up to a degree out of square: scale factor and bias stay within 95 %."""
    from scipy.stats import t as student

    hits = []
    faces = G * np.vstack([np.eye(3), -np.eye(3)])
    for seed in range(300):
        rng = np.random.default_rng([6, seed])
        K = (
            np.eye(3)
            + np.diag(rng.uniform(-0.02, 0.02, 3))
            + np.tril(np.radians(rng.normal(size=(3, 3))), -1)
        )
        b = rng.uniform(-0.3, 0.3, 3)
        tilt = np.radians(rng.normal(size=(6, 3)))  # each face lies about a degree off
        f = np.repeat(faces + np.cross(tilt, faces), 2, axis=0)
        f *= G / np.linalg.norm(f, axis=1, keepdims=True)
        fit = free_orientations(f @ K.T + b + 2e-3 * rng.normal(size=(12, 3)))
        assert fit.square
        assert fit.undetermined.tolist() == [False] * 3 + [True] * 3 + [False] * 3
        truth = unknowns(K, b)
        half = student.ppf(0.975, fit.freedom) * np.sqrt(np.diag(fit.covariance))
        hits.append((np.abs(unknowns(fit.K, fit.b) - truth) <= half)[[0, 1, 2, 6, 7, 8]])
    assert np.mean(hits) >= 0.92  # the lean is no normal error of each rest: a bound from below is honest


def test_rests_without_one_to_spare_have_no_interval() -> None:
    rng = np.random.default_rng(0)
    a = G * np.vstack([np.eye(3), -np.eye(3)]) + 0.1 * rng.normal(size=(6, 3))
    table = table_of(a, 0 * a, [slice(k, k + 1) for k in range(6)], 1.0)
    (found,) = calibrate(table, any_spec(), FitOptions("free_orientations"))
    statuses = {c.error.split(".")[1]: c.status for c in found.sensors[0].coefficients}
    assert statuses == {"scale_factor": "weak", "misalignment": "undetermined", "bias": "weak"}
    assert any("no interval" in note for note in found.sensors[0].notes)


@pytest.mark.parametrize("form", ["triangular", "symmetric"])
@pytest.mark.parametrize("orientations_seen", [1, 2, 4])
def test_too_few_orientations_leave_everything_open(orientations_seen: int, form: str) -> None:
    """Many records of one face: nothing runs away, nothing is claimed."""
    rng = np.random.default_rng(0)
    faces = G * np.vstack([np.eye(3), -np.eye(3)])[:orientations_seen]
    a = np.repeat(faces, 30, axis=0) * 1.01 + 0.05 + 1e-3 * rng.normal(size=(30 * orientations_seen, 3))
    fit = free_orientations(a, form=form)
    assert fit.undetermined.all()
    assert np.isfinite(fit.K).all()
    assert np.abs(fit.K - np.eye(3)).max() < 0.1
    assert np.isfinite(fit.b).all()
    method = "free_orientations" + ("_symmetric" if form == "symmetric" else "")
    table = table_of(a, 0 * a, [slice(k, k + 1) for k in range(len(a))], 1.0)
    (found,) = calibrate(table, any_spec(), FitOptions(method))
    assert "NaN" not in calibration_text(found)
