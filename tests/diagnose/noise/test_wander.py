"""A bias that walks or steps within power-ons is held against the budget's `in_run`, or against none."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.findings.assumptions import assumptions, exceeded
from planner.diagnose.noise.wander import left_of
from planner.diagnose.records.stepped_run import stepped_run
from planner.diagnose.search.sensor import begin, diagnose_sensor
from planner.nouns.array import Array
from planner.nouns.diagnosed_spreads import BudgetExceeded
from planner.nouns.dwell_table import DwellTable
from planner.spec.load import spec_from_bytes
from planner.spec.model import Spec
from planner.units import STANDARD_GRAVITY_MPS2 as G
from tests.specs import SHIPPED

MG = 1e-3 * G
RUNS, ROWS = 24, 9
WHITE = 0.1 * MG


@cache
def spec(in_run: str) -> Spec:
    """The shipped unit with another budget of the accelerometers' bias within a power-on."""
    path = SHIPPED / "small_uav.yaml"
    text = path.read_text(encoding="utf-8").replace("      in_run: 0.5 mg\n", in_run)
    return spec_from_bytes(text.encode(), path).spec


def walk(rng: np.random.Generator) -> Array:
    """(RUNS, ROWS) of unit steps."""
    return np.cumsum(rng.normal(size=(RUNS, ROWS)), axis=1)


def steps(rng: np.random.Generator) -> Array:
    """(RUNS, ROWS) one step somewhere in every power-on."""
    after = np.arange(ROWS) >= rng.integers(2, ROWS - 1, (RUNS, 1))
    return np.asarray(after * rng.choice([-3.0, 3.0], (RUNS, 1)), dtype=float)


def measured(seed: int, moves: Array | float, heavy: bool = False) -> DwellTable:
    """A triad of which x moves, (RUNS, ROWS) m/s²; nothing of `simulate` is in it."""
    rng = np.random.default_rng([seed, 7])
    n = RUNS * ROWS
    faces = np.vstack([np.eye(3), -np.eye(3)])[np.argsort(rng.random((RUNS, 6)), axis=1)]
    faces = np.concatenate([faces, faces[:, : ROWS - 6]], axis=1).reshape(n, 3)
    noise = rng.standard_t(3, (n, 3)) / np.sqrt(3.0) if heavy else rng.normal(size=(n, 3))
    level = np.repeat(rng.normal(size=(RUNS, 3)) * 0.3 * MG, ROWS, axis=0)
    acc = faces * G + 5.0 * MG + level + WHITE * noise
    acc[:, 0] += np.broadcast_to(moves, (RUNS, ROWS)).ravel()
    return DwellTable(
        unit=np.full(n, "u1"),
        run=np.repeat(np.arange(RUNS), ROWS),
        day=np.repeat(np.arange(RUNS) / 4.0, ROWS),
        time_on=np.tile(60.0 * (1.0 + np.arange(ROWS)), RUNS),
        duration=np.full(n, 30.0),
        temperature_degc=np.full(n, 20.0),
        temperature_rate=np.zeros(n),
        ref_rate=0.0 * faces,
        ref_acc=faces * G,
        gyro=None,
        acc=acc,
        source="test",
    )


def told(seed: int, moves: Array | float, budgeted: Spec, heavy: bool = False) -> tuple[BudgetExceeded, ...]:
    """What is said of the triad's biases."""
    data = prepared(measured(seed, moves, heavy))
    found = exceeded(assumptions(diagnose_sensor(data, "accelerometer", ("bias",), 1), budgeted, data))
    return tuple(b for b in found if b.error == "accelerometer.bias")


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", range(3, 8))
def test_a_walk_beyond_its_budget_is_said_with_channel_and_size(seed: int) -> None:
    (said,) = told(seed, 0.2 * MG * walk(np.random.default_rng(seed)), spec("      in_run: 0.1 mg\n"))
    assert (said.error, said.part, said.channel) == ("accelerometer.bias", "in_run", "accelerometer_x")
    assert said.low > said.budget == pytest.approx(0.1 * MG)


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", range(2, 8))
def test_the_same_walk_within_its_budget_is_declared_already(seed: int) -> None:
    assert told(seed, 0.2 * MG * walk(np.random.default_rng(seed)), spec("      in_run: 1 mg\n")) == ()


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", range(2, 8))
def test_steps_where_the_spec_has_no_process_are_said_against_none(seed: int) -> None:
    (said,) = told(seed, 0.2 * MG * steps(np.random.default_rng(seed)), spec(""))
    assert (said.part, said.channel, said.budget) == ("in_run", "accelerometer_x", 0.0)


@pytest.mark.parametrize(("seed", "heavy"), [(1, False), (2, True)])
@pytest.mark.further(("seed", "heavy"), [(s, h) for s in range(3, 8) for h in (False, True)])
def test_a_bias_that_stays_is_none(seed: int, heavy: bool) -> None:
    assert told(seed, 0.0, spec(""), heavy) == ()


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", range(3, 8))
def test_one_step_of_one_power_on_is_said_with_run_moment_and_size(seed: int) -> None:
    moves = np.zeros((RUNS, ROWS))
    moves[7, 5:] = 1.2 * MG
    data = prepared(measured(seed, moves), spec("      in_run: 0.1 mg\n").unit)
    found = [diagnose_sensor(data, "accelerometer", ("bias",), 1)]
    step = stepped_run(found, data)
    assert step is not None
    assert (step.run, step.channel, step.between) == (7, "accelerometer_x", (300.0, 360.0))
    assert step.size == pytest.approx(1.2 * MG, rel=0.3)  # four records a side of 0.1 mg: 0.07 mg one sigma
    assert data.table.run[step.rows].tolist() == [7] * 4


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", range(2, 8))
def test_steps_in_every_power_on_are_no_step_of_one(seed: int) -> None:
    data = prepared(measured(seed, 0.2 * MG * steps(np.random.default_rng(seed))))
    assert stepped_run([diagnose_sensor(data, "accelerometer", ("bias",), 1)], data) is None


def drift(sigma: float) -> Array:
    """(RUNS, ROWS) m/s², a straight line in every power-on, so many sigma of white noise over all rows."""
    t = np.arange(ROWS) - (ROWS - 1) / 2.0
    return np.asarray(np.tile(sigma * WHITE * t / np.sqrt(RUNS * (t @ t)), (RUNS, 1)))


def effects(seed: int, moves: Array | float) -> list[tuple[str, tuple[str, ...]]]:
    found = diagnose(measured(seed, moves), spec("      in_run: 0.5 mg\n"))
    return [(e.effect, e.channels) for e in found.effects]


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.further("seed", range(4, 10))
def test_a_drift_of_five_and_a_half_sigma_stands_before_a_budget_that_would_hide_it(seed: int) -> None:
    """The budget's 0.5 mg may drift five times as far; the rows show that nothing of the kind is there."""
    assert effects(seed, drift(5.5)) == [("drift", ("accelerometer_x",))]


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", range(3, 12))
def test_beside_a_walk_no_drift_is_claimed(seed: int) -> None:
    rng = np.random.default_rng([seed, 3])
    assert effects(seed, 0.05 * MG * walk(rng)) == []


@pytest.mark.parametrize("seed", [1, 2])
def test_a_walk_as_large_as_the_rows_allow_takes_a_share_of_a_drift(seed: int) -> None:
    data = prepared(measured(seed, drift(7.0)))
    w = begin(data, "accelerometer", ("bias",)).pool.state[0]
    time_on = data.table.time_on
    alone = left_of(w, time_on[:, None], time_on, 600.0)
    walking = prepared(measured(seed, 0.1 * MG * walk(np.random.default_rng(seed)) + drift(7.0)))
    w = begin(walking, "accelerometer", ("bias",)).pool.state[0]
    assert 0.0 < left_of(w, time_on[:, None], time_on, 600.0) < 0.8 * alone < 0.8
