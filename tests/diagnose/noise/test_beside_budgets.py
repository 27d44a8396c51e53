"""What other budgets let differ from power-on to power-on is no spread of a bias or of a scale factor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.noise.beside_budgets import LARGEST, seen, thinned
from planner.diagnose.noise.components import LEVEL
from planner.diagnose.noise.whitened import Whitened
from planner.diagnose.search.sensor import SensorFound, diagnose_sensor
from planner.nouns.array import Array
from planner.solvers.random_effects import Drift, RandomEffects
from planner.solvers.reml import reml
from planner.solvers.restricted_likelihood import Sample
from tests.diagnose.hall import ACC, Noise, days, hidden, read
from tests.diagnose.noise.test_small_campaigns import claims
from tests.diagnose.worlds import DECLARED
from tests.specs import shipped

UNIT = shipped("small_uav").spec.unit


def faces(seed: int, power_ons: int, acc: Noise) -> SensorFound:
    """The accelerometers in six attitudes and turns, 18 records a power-on."""
    hall = days(seed, power_ons)
    return diagnose_sensor(prepared(read(hall, seed, acc=acc)), "accelerometer", DECLARED, 1)


def mean_estimate(w: Whitened, drawn: Array, rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Mean (K,) of the variances and its standard error: θ of the channel's noise, and what is drawn beside.

    drawn: (n, m) columns, of which every power-on has a normal draw each
    """
    e, theta = w.noise.sample.effects, w.noise.variances.theta
    runs = np.repeat(np.arange(len(e.starts)), e.sizes)
    own = np.sqrt(theta[: len(e.diagonals)] @ e.diagonals)
    both = np.column_stack([*(np.sqrt(theta[len(e.diagonals) :])[:, None] * e.slopes), drawn])
    found = []
    for _ in range(count):
        y = own * rng.normal(size=len(runs)) + np.sum(
            both * rng.normal(size=(len(e.starts), both.shape[1]))[runs], axis=1
        )
        found.append(reml(y, w.noise.sample.basis, e, theta).theta)
    return np.mean(found, axis=0), np.std(found, axis=0) / np.sqrt(count)


def test_what_the_budgets_draw_beside_is_what_the_estimate_makes_of_it() -> None:
    """Misalignments of every power-on, of which noise, level and scale factor each take some."""
    rng = np.random.default_rng(7)
    found = faces(3, 24, ACC)
    w = found.found.pool.state[0]
    budgets = {"misalignment": UNIT.accelerometer["misalignment"]}
    inputs = w.channel.model.conditions.specific_force[:, 1:]
    sigma = budgets["misalignment"].run_to_run_largest
    theta = w.noise.variances.theta
    noise = replace(w.noise, variances=replace(w.noise.variances, free=np.ones(len(theta), bool)))
    one = seen(noise, w.channel, np.zeros(len(w.z)), budgets)
    assert set(one.parts) == {("misalignment", "run_to_run")}
    mean, error = mean_estimate(w, sigma * inputs, rng, 150)
    small = np.diag(one.covariance) < theta**2  # one that often comes out as zero has no mean of its own
    assert small.sum() >= 2
    np.testing.assert_array_less(np.abs(mean - theta - one.taken.sum(axis=1))[small], 4.0 * error[small])
    white = [k for k, name in enumerate(noise.components) if name == "white"]
    assert one.of(white, ("bias", "in_run")) > 0.3 * sigma**2 * np.mean(inputs**2)
    assert one.of(white, ("misalignment", "run_to_run")) == 0.0  # of its own part nothing is taken


def test_a_part_that_the_noise_has_is_that_variance_and_no_other() -> None:
    """A level of every power-on, and a scale factor."""
    found = faces(3, 24, ACC)
    w = found.found.pool.state[0]
    budgets = {name: UNIT.accelerometer[name] for name in ("bias", "scale_factor")}
    one = seen(w.noise, w.channel, 30.0 * np.arange(len(w.z)), budgets)
    for error, component in (("bias", LEVEL), ("scale_factor", "run_to_run_scale_factor")):
        column = one.taken[:, one.parts.index((error, "run_to_run"))]
        at = w.noise.components.index(component)
        assert column[at] == pytest.approx(budgets[error].run_to_run_largest ** 2, rel=0.01)
        np.testing.assert_array_less(
            np.abs(np.delete(column, at)), 1e-3 * np.delete(w.noise.variances.theta, at)
        )


def test_what_wanders_within_a_power_on_has_a_mean_there() -> None:
    """Records that follow each other closely share one draw of a slow process: all of it is a level."""
    found = faces(3, 24, ACC)
    w = found.found.pool.state[0]
    bias = UNIT.accelerometer["bias"]
    at = w.noise.components.index(LEVEL)
    quick, slow = (
        seen(w.noise, w.channel, gap * np.arange(len(w.z)), {"bias": bias}).of([at], ("bias", "run_to_run"))
        for gap in (1e4 * bias.in_run_time, 1e-4 * bias.in_run_time)
    )
    assert slow == pytest.approx(bias.in_run_sigma**2, rel=0.01)
    assert quick < 0.01 * bias.in_run_sigma**2


def test_long_power_ons_are_asked_by_some_of_their_rows() -> None:
    """700 rows of each of nine, as many to be weighed as dense blocks of 256."""
    starts, n = 700 * np.arange(9), 6300
    effects = RandomEffects(
        starts, np.ones((1, n)), np.ones((1, n)), (Drift(np.ones(n), np.arange(n), 50.0),)
    )
    few = thinned(Sample(np.zeros(n), np.ones((n, 1)), effects))
    assert few.effects.sizes.tolist() == [LARGEST] * 9
    assert few.effects.drifts[0].time[:LARGEST:255].tolist() == [0, 699]
    short = Sample(
        np.zeros(12), np.ones((12, 1)), RandomEffects(np.array([0, 6]), np.ones((1, 12)), np.ones((1, 12)))
    )
    assert thinned(short) is short


@pytest.mark.parametrize("seed", [97051, 97052])
@pytest.mark.further("seed", range(97053, 97059))
def test_what_wanders_in_six_power_ons_is_noise(seed: int) -> None:
    """And a drift of as few is none, as the next test has it."""
    found = faces(seed, 6, replace(ACC, within=4.0 * ACC.white))
    assert claims(found) == []


@pytest.mark.parametrize("seed", [97061, 97062])
@pytest.mark.further("seed", range(97063, 97067))
def test_a_drift_of_six_power_ons_keeps_its_name(seed: int) -> None:
    hall = days(seed, 6)
    table = hidden(read(hall, seed), "acc", seed % 3, 20.0 * ACC.white * hall.time_on / hall.time_on.max())
    found = diagnose_sensor(prepared(table), "accelerometer", DECLARED, 1)
    assert [name for name, _ in claims(found)] in (["drift"], ["ageing"])
