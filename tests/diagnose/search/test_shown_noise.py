"""What wanders, or changes at every power-on, is noise where the rows show it, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.channel import channel
from planner.diagnose.channels.prepared import prepared
from planner.diagnose.noise.components import (
    IN_RUN,
    IN_RUN_SCALE,
    LEANS,
    LEVEL,
    drawn_name,
    drawn_of_power_ons,
)
from planner.diagnose.search.sensor import begin, diagnose_sensor
from planner.nouns.array import Array
from planner.nouns.dwell_table import DwellTable
from planner.spec.model import Unit
from tests.diagnose.hall import FACES, GYRO, RATES, Hall, Log, Noise, anywhere, days, hidden, read
from tests.diagnose.worlds import DECLARED
from tests.specs import shipped

POWER_ONS = 16
G = 9.80665
HIGH_G = shipped("high_g").spec.unit
FELT = HIGH_G.gyro["g_sensitivity"].run_to_run_largest  # rad/s per m/s²


def _walk(hall: Hall, seed: int, tau: float) -> Array:
    """(n,) of one sigma, correlated over tau seconds within every power-on (exact discretisation)."""
    rng = np.random.default_rng([seed, 31])
    out = np.empty(len(hall.run))
    for i in range(len(out)):
        same = i > 0 and hall.run[i] == hall.run[i - 1]
        a = np.exp(-(hall.time_on[i] - hall.time_on[i - 1]) / tau) if same else 0.0
        out[i] = a * (out[i - 1] if same else 0.0) + np.sqrt(1.0 - a * a) * rng.normal()
    return out


def _turning(axis: int) -> Hall:
    """Every power-on at rest on six faces, then two dozen turns about one axis."""
    log = Log()
    for _ in range(POWER_ONS):
        log.on(10.0)
        for face in FACES:
            log.record(*face, 20.0)
        for i in range(24):
            log.record(axis, 1.0, 20.0, turn=RATES[(0, 2, 1, 3)[i % 4]])
        log.day += 1.0
    return log.hall()


def _on_the_arm(seed: int, power_ons: int = 12) -> DwellTable:
    """Gyros alone on a centrifuge of 1.5 m, each axis along the arm in turn, with what every power-on draws.

    A level, a scale factor of 1e-5, and g-sensitivities of one sigma of high_g's budget.
    """
    rng = np.random.default_rng([seed, 53])
    eye, rows = np.eye(3), list[tuple[float, ...]]()
    for run in range(power_ons):
        time = 60.0
        for k in range(3):
            for load in (5.0, -5.0, 15.0, -15.0, 30.0, -30.0, 60.0, -60.0):
                w = float(np.sqrt(abs(load) * G / 1.5))
                rows.append((run, time, *(w * eye[(k + 1) % 3]), *(G * (eye[(k + 1) % 3] + load * eye[k]))))
                time += 80.0
    a = np.array(rows)
    run, rate, force = a[:, 0].astype(np.int64), a[:, 2:5], a[:, 5:8]
    level, scale = rng.normal(0.0, GYRO.level, (power_ons, 3)), 1e-5 * rng.normal(size=(power_ons, 3))
    felt = FELT * rng.normal(size=(power_ons, 3, 3))
    gyro = rate + level[run] + scale[run] * rate + np.einsum("nij,nj->ni", felt[run], force)
    t = 20.0 + rng.normal(0.0, 0.02, len(a))
    return DwellTable(
        unit=np.full(len(a), "arm"), run=run, day=0.1 * run, time_on=a[:, 1], duration=np.full(len(a), 20.0),
        temperature_degc=t, temperature_rate=np.zeros(len(a)), ref_rate=rate, ref_acc=force,
        gyro=gyro + rng.normal(0.0, GYRO.white / 4.5, gyro.shape), acc=None, source=f"arm {seed}",
    )  # fmt: skip


def _sizes(table: DwellTable, axis: int, unit: Unit | None = None) -> dict[str, float]:
    """One sigma of every variance of a gyro, SI."""
    declared = DECLARED if unit is None else ("bias", "scale_factor", "misalignment", "g_sensitivity")
    noise = begin(prepared(table, unit), "gyro", declared).pool.state[axis].noise
    return dict(zip(noise.components, np.sqrt(noise.variances.theta).tolist(), strict=True))


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", range(3, 8))
def test_a_bias_that_wanders_is_found_with_its_size(seed: int) -> None:
    hall, axis, sigma = days(seed, POWER_ONS), seed % 3, 2.0 * GYRO.white
    table = replace(hidden(read(hall, seed), "gyro", axis, sigma * _walk(hall, seed, 400.0)), acc=None)
    sizes = _sizes(table, axis)
    assert sizes[IN_RUN] > 0.0
    both = np.degrees(np.hypot(sizes[IN_RUN], sizes[LEVEL]))  # a slow walk and a level are much the same
    assert both == pytest.approx(np.hypot(sigma, GYRO.level), rel=0.35)


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, *range(3, 8)])
def test_beside_it_one_product_is_named(seed: int) -> None:
    """As white noise the walk hid it among tables over the time, and the other products beside it."""
    hall, axis = anywhere(seed), seed % 3
    moved = read(hall, seed)
    for a in range(3):
        moved = hidden(moved, "gyro", a, 2.0 * GYRO.white * _walk(hall, seed + 10 * a, 600.0))
    shape = hall.rate[:, axis] * hall.rate[:, (axis + 1) % 3]
    table = hidden(moved, "gyro", axis, 40.0 * GYRO.white * shape / np.linalg.norm(shape))
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, 1).found
    assert [found.pool.blocks[b].key for b in found.all] == [("cross_coupling", (axis,))]


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", range(3, 8))
def test_misalignments_of_every_power_on_are_no_noise_of_every_record(seed: int) -> None:
    hall, axis, sigma = days(seed, POWER_ONS), seed % 3, 1e-4
    rng = np.random.default_rng([seed, 32])
    drawn = sigma * rng.normal(size=(POWER_ONS, 2))[np.unique(hall.run, return_inverse=True)[1]]
    across = np.stack([hall.rate[:, (axis + k) % 3] for k in (1, 2)], axis=1)
    table = replace(hidden(read(hall, seed), "gyro", axis, np.sum(drawn * across, axis=1)), acc=None)
    sizes = _sizes(table, axis)
    for k in (1, 2):
        assert sizes[drawn_name(LEANS, k)] == pytest.approx(sigma, rel=0.6)
    assert sizes["cross_noise"] < 0.1 * sigma


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", range(3, 8))
def test_a_scale_factor_of_every_power_on_multiplies_the_misaligned_input(seed: int) -> None:
    """Its product with the lean of the axes was a misalignment that every power-on draws, of all channels."""
    hall, axis = days(seed, POWER_ONS), seed % 3
    table = read(hall, seed, gyro=Noise(1e-4, 1e-3, 0.0))
    assert table.gyro is not None
    drawn = 5e-4 * np.random.default_rng([seed, 33]).normal(size=(POWER_ONS, 3))
    of_each = drawn[np.unique(hall.run, return_inverse=True)[1]]
    sizes = _sizes(replace(table, gyro=(1.0 + of_each) * table.gyro, acc=None), axis)
    assert sizes["run_to_run_scale_factor"] == pytest.approx(5e-4, rel=0.6)
    assert not {drawn_name(LEANS, k) for k in (1, 2)} & set(sizes)


@pytest.mark.parametrize(("power_ons", "leaned"), [(11, False), (12, True)])
def test_few_power_ons_draw_it_along_their_own_input(power_ons: int, leaned: bool) -> None:
    """A misalignment over the temperature of eleven on an arm was a scale factor six times its budget."""
    table = read(days(1, power_ons), 1)
    assert table.gyro is not None
    c = channel("gyro", 0, table.conditions(), table.gyro[:, 0], DECLARED)
    column = drawn_of_power_ons(c, (), power_ons)["run_to_run_scale_factor"]
    assert bool(np.any(column != c.u)) is leaned


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", range(3, 8))
def test_coefficients_of_the_budget_that_every_power_on_draws_are_no_process(seed: int) -> None:
    """They were noise of every record that grows with the rate, or a scale factor that wanders."""
    sizes = _sizes(_on_the_arm(seed), seed % 3, HIGH_G)
    for k in (1, 2, 3):
        assert sizes[drawn_name("g_sensitivity", k)] == pytest.approx(FELT, rel=0.6)
    assert not {IN_RUN, IN_RUN_SCALE} & set(sizes)


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", range(3, 8))
def test_a_scale_factor_that_wanders_is_no_noise_of_every_record(seed: int) -> None:
    axis, sigma = seed % 3, 1e-4
    hall = _turning(axis)
    added = sigma * _walk(hall, seed, 300.0) * hall.rate[:, axis]
    sizes = _sizes(replace(hidden(read(hall, seed), "gyro", axis, added), acc=None), axis)
    assert sizes[IN_RUN_SCALE] == pytest.approx(sigma, rel=0.6)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.further("seed", range(4, 12))
def test_rows_that_show_nothing_of_the_kind_have_none_of_it(seed: int) -> None:
    """Once in a hundred channels chance may."""
    table = replace(read(days(seed, POWER_ONS), seed, gyro=Noise(4e-4, 1e-3, 0.0)), acc=None)
    assert set(_sizes(table, 0)) <= {"white", "rate_noise", "cross_noise", "constant", "run_to_run_bias",
                                     "run_to_run_scale_factor"}  # fmt: skip
