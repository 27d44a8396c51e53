"""What the verdicts rest on: the noise, its degrees of freedom, chance with few rows, and rows made ready."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels import prepared as rows
from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.pool import Pool
from planner.diagnose.noise import noise_of_triad
from planner.diagnose.search.sensor import begin
from planner.dwells.table_rows import rows_of
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Sensor
from tests.calibrate.world import Layout, Noise, campaign
from tests.diagnose.worlds import DECLARED, whole

G = 9.80665
SMALL = Layout(later=(30.0,), rate_repeats=2)


def begun(table: DwellTable, sensor: Sensor = "gyro") -> Pool:
    """The pool before anything is searched in it."""
    return begin(prepared(table), sensor, DECLARED).pool


def freedom(pool: Pool, axis: int, component: str) -> float:
    """Satterthwaite's, of one variance."""
    known = pool.state[axis].noise
    k = known.components.index(component)
    return float(2.0 / known.relative_error[k, k])


@pytest.mark.parametrize(("kind", "sensor"), [("grows", "gyro"), ("normal", "accelerometer")])
@pytest.mark.further(("kind", "sensor"), [("normal", "gyro")])
def test_the_shares_of_the_variances_add_up_to_the_columns(kind: str, sensor: Sensor) -> None:
    # the noise differs within a run, so the root of its covariance is not symmetric
    pool = begun(campaign(81, layout=SMALL, noise=Noise(kind=kind)), sensor)
    for axis, part in pool.parts.items():
        shares = pool.shares[axis].of(np.arange(part.shape[1]))
        np.testing.assert_allclose(sum(shares), part.T @ part, atol=1e-8)


def test_channels_that_are_alike_tell_their_badly_known_variances_together(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    table = campaign(83)  # one campaign in twenty looks unlike by chance
    shared = begun(table)
    with monkeypatch.context() as patched:
        patched.setattr(noise_of_triad, "UNLIKE", 2.0)  # no likelihood ratio is that probable
        alone = begun(table)
    k = shared.state[0].noise.components.index("run_to_run_scale_factor")
    assert len({float(w.noise.variances.theta[k]) for w in shared.state.values()}) == 1
    mine = [freedom(alone, axis, "run_to_run_scale_factor") for axis in range(3)]
    # three times as many power-ons
    assert freedom(shared, 0, "run_to_run_scale_factor") > 2.0 * np.median(mine)


def test_channels_that_differ_are_judged_each_for_itself() -> None:
    table = campaign(83, noise=Noise(scale_run=3e-5))
    assert table.gyro is not None
    rng = np.random.default_rng(1)
    stray = 3e-4 * rng.normal(size=table.run.max() + 1)[table.run]  # run by run, ten times as far as x and y
    gyro = table.gyro + np.outer(stray * table.ref_rate[:, 2], [0.0, 0.0, 1.0])
    pool = begun(replace(table, gyro=gyro))
    k = pool.state[0].noise.components.index("run_to_run_scale_factor")
    sizes = [float(np.sqrt(w.noise.variances.theta[k])) for w in pool.state.values()]
    assert sizes[2] > 4.0 * max(sizes[:2])


def test_eighteen_rows_of_one_power_on_name_nothing_by_chance() -> None:
    claims = 0
    table = campaign(84, layout=Layout(temperatures=(20.0,), ramps=False, centrifuge=False))
    first = rows_of(table, np.flatnonzero(np.abs(table.ref_rate).max(axis=1) < 0.01)[:18])
    one = replace(first, run=np.ones(18, dtype=np.int64), time_on=10.0 + 80.0 * np.arange(18.0))
    for seed in range(15):
        rng = np.random.default_rng([84, seed])
        # the reference has the Earth's rate: without it in the readings it is missing, and said to be
        read = one.ref_rate + 2e-5 * rng.normal(size=(18, 3))
        found = whole(replace(one, gyro=read, acc=None, ref_acc=one.ref_acc))
        claims += len(found.effects) + len(found.unknown)
    # 1 % of 45 channels is 0.45; three would be a chance of 1 %
    assert claims <= 2


def test_readings_without_any_noise_lack_nothing() -> None:
    # the declared misalignment takes the Earth's rate up but for the digits that were not printed
    table = campaign(87, layout=Layout(temperatures=(20.0,), ramps=False, centrifuge=False))
    rests = rows_of(table, np.flatnonzero(np.abs(table.ref_rate).max(axis=1) < 0.01))
    printed = np.radians(np.round(np.degrees(rests.ref_rate) + np.array([0.02, -0.01, 0.03]), 9))
    found = whole(replace(rests, gyro=printed, acc=None))
    assert (found.effects, found.unknown) == ((), ())


# ---------------------------------------------------------------- rows made ready


def still(n: int, acc: np.ndarray) -> DwellTable:
    """A record of one power-on at rest, without references."""
    return DwellTable(
        unit=np.full(n, "u1"),
        run=np.ones(n, dtype=np.int64),
        day=np.zeros(n),
        time_on=10.0 * np.arange(1.0, n + 1.0),
        duration=np.full(n, 10.0),
        temperature_degc=np.linspace(-20.0, 70.0, n),
        temperature_rate=np.full(n, 1.0 / 60.0),
        ref_rate=None,
        ref_acc=None,
        gyro=None,
        acc=acc,
        source="still",
    )


def test_a_drift_over_temperature_is_no_new_attitude() -> None:
    drift = np.linspace(0.0, 0.05 * G, 200)  # three degrees of lean, a hundredth of one from row to row
    made = prepared(still(200, np.column_stack([drift, np.zeros(200), np.full(200, G)])))
    assert made.attitude is not None
    assert made.attitude.max() == 0


def test_a_turn_is_a_new_attitude() -> None:
    up = np.repeat([[0.0, 0.0, G], [0.0, G, 0.0], [0.0, 0.0, G]], 60, axis=0)
    made = prepared(still(180, up + 1e-3 * np.random.default_rng(2).normal(size=(180, 3))))
    assert made.attitude is not None
    assert made.attitude.tolist() == [0] * 60 + [1] * 60 + [0] * 60


def test_ramps_are_taken_at_their_levels_and_a_sweep_as_it_is() -> None:
    table = campaign(85)
    levels = np.unique(prepared(table).table.temperature_rate * 60.0)
    np.testing.assert_allclose(levels, [-2.0, 0.0, 2.0], atol=0.02)
    swept = replace(table, temperature_rate=np.linspace(-3.0, 3.0, len(table)) / 60.0)
    assert len(np.unique(prepared(swept).table.temperature_rate)) == len(table)


def test_more_rows_than_are_judged_are_averaged_by_condition_and_thinned_by_power_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    table = campaign(86)
    monkeypatch.setattr(rows, "WHOLE", 200)
    monkeypatch.setattr(rows, "MOST_ROWS", 200)
    made = prepared(table)
    assert len(made.table) < 0.6 * len(table)
    assert any("power-ons are judged" in note for note in made.notes)
    seen = made.where >= 0
    assert 0.3 < seen.mean() < 1.0
    np.testing.assert_array_equal(made.table.run[made.where[seen]], made.full.run[seen])
    # a row and the one that stands for it have one reference, to a thousandth of the largest
    for reference in ("ref_rate", "ref_acc"):
        mine, theirs = getattr(made.table, reference), getattr(made.full, reference)
        assert np.abs(mine[made.where[seen]] - theirs[seen]).max() < 2e-3 * np.abs(theirs).max()
