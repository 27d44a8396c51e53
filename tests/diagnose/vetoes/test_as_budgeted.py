"""What few power-ons tell is held against what the spec lets each of them draw: leans on a centrifuge."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.vetoes.as_budgeted import SHARES, _gain, _whitened_again
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from tests.specs import shipped

SPEC = shipped("small_uav").spec
G = 9.80665
LEANS = np.radians(0.003)  # run-to-run of a misalignment, as small_uav's spec has it
ARM_M = 1.5
WHITE = {"gyro": np.radians(1e-3), "acc": 5e-5 * G}
LEVEL = {"gyro": np.radians(2e-3), "acc": 7e-4 * G}
SCALE = 1.5e-5  # run-to-run of a scale factor


def few_on_the_arm(seed: int, bends: float = 0.0) -> DwellTable:
    """Three temperatures, each with two power-ons of faces and rates and one on a centrifuge. Plain NumPy.

    bends: by which accelerometer z feels its own load squared, g per g²: no lean of any power-on
    """
    rng = np.random.default_rng([seed, 409])
    rows, eye = list[tuple[float, ...]](), np.eye(3)
    for run in range(9):
        t, time = (-36.0, 23.0, 66.0)[run // 3] + rng.normal(0.0, 0.3), 40.0
        for k in range(3):
            up, side = eye[k], eye[(k + 1) % 3]
            if run % 3 == 2:
                for load in (10.0, -10.0, 25.0, -25.0, 50.0, -50.0):
                    w = float(np.sqrt(abs(load) * G / ARM_M))
                    for way in (w, -w):
                        rows.append(
                            (run, time, t + rng.normal(0.0, 0.02), *(way * up), *(G * (up + load * side)))
                        )
                        time += 40.0
                continue
            for way in (1.0, -1.0):
                rows.append((run, time, t + rng.normal(0.0, 0.02), 0.0, 0.0, 0.0, *(way * G * up)))
                time += 60.0
            for rate in np.radians([50.0, -50.0, 200.0, -200.0, 400.0, -400.0]):
                rows.append((run, time, t + rng.normal(0.0, 0.02), *(rate * up), *(G * up)))
                time += 30.0
    a = np.array(rows)
    run = a[:, 0].astype(np.int64)
    rate, force = a[:, 3:6], a[:, 6:9]
    acc = _read(force, run, a[:, 2], "acc", rng)
    acc[:, 2] += bends * force[:, 2] ** 2 / G
    return DwellTable(
        unit=np.full(len(a), "arm"), run=run, day=0.05 * run, time_on=a[:, 1], duration=np.full(len(a), 20.0),
        temperature_degc=a[:, 2], temperature_rate=np.zeros(len(a)), ref_rate=rate, ref_acc=force,
        gyro=_read(rate, run, a[:, 2], "gyro", rng), acc=acc, source=f"arm {seed}",
    )  # fmt: skip


def _read(u: Array, run: Array, t: Array, sensor: str, rng: np.random.Generator) -> Array:
    """y = (1 + κ)(M u) + b + noise; b, κ and M with a part that every power-on draws anew."""
    x = t / 60.0
    powers = np.stack([np.ones(len(x)), x, x**2], axis=1)
    bias = (
        powers @ rng.normal(0.0, 10.0 * LEVEL[sensor], (3, 3)) + rng.normal(0.0, LEVEL[sensor], (9, 3))[run]
    )
    kappa = powers @ rng.normal(0.0, 1e-3, (3, 3)) + rng.normal(0.0, SCALE, (9, 3))[run]
    lean = np.radians(0.2) * rng.normal(size=(3, 3)) + LEANS * rng.normal(size=(9, 3, 3))[run]
    lean = lean * (1.0 - np.eye(3)) + np.eye(3)
    v = np.einsum("nij,nj->ni", lean, u)
    return np.asarray((1.0 + kappa) * v + bias + WHITE[sensor] * rng.normal(size=u.shape))


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3, 4, 5, 6])
def test_leans_that_three_power_ons_draw_are_no_curve_over_temperature(seed: int) -> None:
    """Of three accelerometers "temperature" was claimed at 14 to 170 sigma in half of such campaigns."""
    found = diagnose(few_on_the_arm(seed), SPEC)
    assert (found.effects, found.unknown) == ((), ())


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3, 4])
def test_what_no_lean_follows_is_still_named(seed: int) -> None:
    found = diagnose(few_on_the_arm(seed, bends=4e-6), SPEC)  # 10 mg at 50 g
    assert {c for e in found.effects for c in e.channels} == {"accelerometer_z"}


@pytest.mark.parametrize("draws", [3, 40, 90])
def test_draws_whiten_and_weigh_as_their_covariance_says(draws: int) -> None:
    """V = I + DDᵀ inverted as it stands, more columns than rows or fewer, two of them alike."""
    rng = np.random.default_rng([draws, 7])
    D, X = rng.normal(size=(60, draws)) * 10.0 ** rng.uniform(-2.0, 1.0, draws), rng.normal(size=(60, 4))
    D[:, 1] = D[:, 0]
    value, vector = np.linalg.eigh(np.eye(60) + D @ D.T)
    root = (vector / np.sqrt(value)) @ vector.T
    np.testing.assert_allclose(_whitened_again(D, X), root @ X, atol=1e-11)
    z = 5.0 * X[:, 0]
    covariances = [np.eye(60) + f**2 * D @ D.T for f in SHARES]
    wanted = [z @ z - z @ np.linalg.solve(V, z) - np.linalg.slogdet(V)[1] for V in covariances]
    assert _gain(D, z) == pytest.approx(max(wanted), rel=1e-10)
