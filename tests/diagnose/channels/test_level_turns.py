"""Turns about a level axis: a sensor answers the force at every instant, and not the mean of a record."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions, Swinging
from tests.diagnose.hall import G, Hall, hidden, read, two_axes
from tests.diagnose.worlds import DECLARED, named, unnamed, whole


def _around(hall: Hall, instants: int = 720) -> Array:
    """(n, instants, 3) g, the force through each record; a level turn begins with any side up."""
    f = np.repeat(hall.up[:, None], instants, axis=1)
    phi = 2.0 * np.pi * np.arange(instants) / instants
    for i in np.flatnonzero(~hall.up.any(axis=1)):
        axis = int(np.argmax(np.abs(hall.turn[i])))
        f[i, :, (axis + 1) % 3], f[i, :, (axis + 2) % 3] = np.cos(phi), np.sin(phi)
    return f


@pytest.mark.parametrize("seed", [1, 4])
@pytest.mark.further("seed", [2, 3, 5])
def test_a_scale_factor_asymmetry_has_its_name_alone(seed: int) -> None:
    """Cross-couplings, a rectification of vibration and a tilted base were named beside it, or instead."""
    hall = two_axes(seed)
    table = read(hall, seed)
    for axis in range(3):
        table = hidden(table, "accelerometer", axis, 5e-4 * np.abs(_around(hall)[:, :, axis]).mean(axis=1))
    found = whole(table)
    assert {e.effect for e in found.effects} == {"scale_factor_asymmetry"}
    assert not found.reference_suspects
    sizes = {t.name: (t.low, t.high) for e in found.effects for t in e.terms}
    assert all(low < 1e-3 < high for low, high in sizes.values())


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4, 5])
def test_a_square_of_the_force_along_a_gyros_axis_has_its_name_alone(seed: int) -> None:
    """A rectification of vibration stood beside it, and a variable that has no name."""
    hall = two_axes(seed)
    shape = 3e-3 * (_around(hall)[:, :, 1] ** 2).mean(axis=1)
    table = hidden(read(hall, seed), "gyro", 1, shape)
    found = diagnose_sensor(prepared(table), "gyro", DECLARED, seed).found
    assert named(found) == {("g_squared_sensitivity", "y")}
    assert not unnamed(found)


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3])
def test_level_turns_of_a_plain_unit_are_clean(seed: int) -> None:
    found = whole(read(two_axes(seed), seed))
    assert not found.effects
    assert not found.unknown
    assert not found.reference_suspects


def test_effects_are_asked_at_every_instant_and_those_of_the_bench_of_the_mean() -> None:
    from planner import catalog

    hall = two_axes(1)
    conditions = read(hall, 1).conditions()
    assert isinstance(conditions, Swinging)
    means = Conditions(**{name: x for name, x in vars(conditions).items() if name != "swing"})
    effects = catalog.effects()
    force = _around(hall)
    square = effects["vibration_rectification"].regressors("gyro", conditions)[:, 0, 0]
    assert square == pytest.approx(np.full(len(square), G**2), rel=1e-9)
    modulus = 2.0 * effects["scale_factor_asymmetry"].regressors("accelerometer", conditions)
    assert modulus[:, 1, 1] == pytest.approx(G * np.abs(force[:, :, 1]).mean(axis=1), abs=5e-3 * G)
    for name in ("g_sensitivity", "earth_rate"):
        mean = effects[name].regressors("gyro", means)
        assert effects[name].regressors("gyro", conditions) == pytest.approx(mean, abs=1e-12 * G)
