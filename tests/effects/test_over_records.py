"""What an effect adds to a record is the mean of what it adds at every instant of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import catalog
from planner.effects._dependence import random_conditions
from planner.nouns.conditions import Conditions, Swinging, in_records, joined
from planner.protocols import Sensor

G = 9.80665


def turns(n: int = 4) -> Swinging:
    """A rest, and n whole turns about the level x axis and about one that is half upright."""
    half = np.sqrt(0.5)
    axes = np.array([[1.0, 0.0, 0.0], [half, half, 0.0]] * (n // 2))
    rate = np.vstack([np.zeros(3), np.linspace(1.0, 2.0, n)[:, None] * axes])
    force = np.vstack([[0.0, 0.0, G], (axes @ [0.0, 1.0, 0.0])[:, None] * axes * G])
    duration = np.append(30.0, 2.0 * np.pi / np.linspace(1.0, 2.0, n))
    zero = np.zeros(n + 1)
    found = in_records(Conditions(rate, force, zero + 20.0, zero, zero + 60.0, zero), duration)
    assert isinstance(found, Swinging)
    return found


@pytest.mark.parametrize("sensor", ["gyro", "accelerometer"])
def test_every_effect_of_a_sensor_is_averaged(sensor: Sensor) -> None:
    here = turns()
    rows = np.arange(len(here.day))
    means = Conditions(**{k: v for k, v in vars(here).items() if k != "swing"})
    bent = set()
    for name, effect in catalog.effects().items():
        if sensor not in effect.sensors or effect.bench_only or getattr(effect, "history", False):
            continue
        found = effect.regressors(sensor, here)
        each = effect.regressors(sensor, here.at_instants(rows))
        assert found == pytest.approx(each.reshape(len(rows), -1, *found.shape[1:]).mean(axis=1), abs=1e-9)
        assert found[0] == pytest.approx(effect.regressors(sensor, means)[0], abs=1e-12), (
            "nothing swings at rest"
        )
        if not np.allclose(found, effect.regressors(sensor, means)):
            bent.add(name)
    assert {"vibration_rectification", "cross_coupling", "load_curve"} & bent
    assert not {"bias", "scale_factor", "misalignment", "g_sensitivity"} & bent, "linear in the force"


@pytest.mark.parametrize("sensor", ["gyro", "accelerometer"])
def test_what_says_that_it_is_linear_in_the_force_is(sensor: Sensor) -> None:
    """h(f + s) + h(f − s) = 2 h(f) to rounding, on rows of all that a bench can be: of nothing else."""
    rng = np.random.default_rng(7)
    here = random_conditions(rng, 400)
    s = rng.uniform(-5.0, 5.0, (400, 3))
    more, less = (replace(here, specific_force=here.specific_force + sign * s) for sign in (1.0, -1.0))
    flagged = set()
    for name, effect in catalog.effects().items():
        if sensor in effect.sensors and getattr(effect, "linear_in_force", False):
            flagged.add(name)
            both = effect.regressors(sensor, more) + effect.regressors(sensor, less)
            assert both == pytest.approx(2.0 * effect.regressors(sensor, here), rel=1e-12, abs=1e-9), name
    assert flagged == {
        "scale_factor", "scale_factor_temperature", "misalignment", "misalignment_temperature",
        *(("g_sensitivity", "g_sensitivity_temperature") if sensor == "gyro" else ()),
    }  # fmt: skip


def test_the_square_of_gravity_is_the_same_in_every_turn() -> None:
    square = catalog.effects()["vibration_rectification"].regressors("gyro", turns())[:, 0, 0]
    assert square == pytest.approx(G**2, rel=1e-9)


def test_records_one_behind_the_other_keep_what_swings() -> None:
    here, still = turns(), turns().at(np.array([0]))
    plain = Conditions(**{k: v for k, v in vars(still).items() if k != "swing"})
    both = joined([plain, here])
    assert isinstance(both, Swinging)
    np.testing.assert_array_equal(both.swing[1:], here.swing)
    assert not both.swing[0].any()
    assert type(joined([plain, plain])) is Conditions
