"""A fixture that bends with the chamber, or under load, turns all channels alike: no error of each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.effects._bench_frame import load
from planner.nouns.array import Array
from planner.units import STANDARD_GRAVITY_MPS2
from tests.diagnose.hall import Hall, days, hidden, read
from tests.diagnose.labs.unit import campaign
from tests.diagnose.worlds import whole

TURNED = "mounting"


def _turned(hall: Hall, angle: Array) -> Hall:
    """The unit's own axes turned by small angles (n, 3), rad: v − θ × v, and half the square."""

    def by(v: Array) -> Array:
        once = -np.cross(angle, v)
        return v + once - np.cross(angle, once) / 2.0

    return replace(hall, up=by(hall.up), north=by(hall.north), turn=by(hall.turn))


def _of(seed: int, deg: float) -> Array:
    v = np.random.default_rng([seed, 91]).normal(size=3)
    return np.radians(deg) * v / np.linalg.norm(v)


@pytest.mark.parametrize(("seed", "deg"), [(1, 0.05), (2, 0.15)])
@pytest.mark.further(("seed", "deg"), [(3, 0.1), (4, 0.3), (5, 0.02)])
def test_a_fixture_that_bends_with_the_temperature(seed: int, deg: float) -> None:
    """Six misalignments over temperature of each sensor were said of it, as sure as could be."""
    hall = days(seed, 30)
    warmer = (hall.temperature - 20.0)[:, None] / 50.0
    found = whole(read(hall, seed, felt=_turned(hall, warmer * _of(seed, deg))))
    assert not found.effects
    assert not found.unknown
    (suspect,) = found.reference_suspects
    assert (suspect.hypothesis, suspect.unit) == (TURNED, "deg")
    assert suspect.alias == "misalignment_temperature"
    assert suspect.value == pytest.approx(deg, rel=0.1)
    assert len(suspect.channels) == 6


@pytest.mark.parametrize("seed", [11])
@pytest.mark.further("seed", [12, 13, 14])
def test_angles_that_agree_on_no_turn_are_the_sensors(seed: int) -> None:
    """Package and board: those of every channel are its own."""
    hall, rng = days(seed, 30), np.random.default_rng([seed, 92])
    table = read(hall, seed)
    for axis in range(3):
        for other in range(3):
            if other != axis:
                by = np.radians(0.1) * rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.0)
                shape = by * hall.rate[:, other] * (hall.temperature - 20.0) / 50.0
                table = hidden(table, "gyro", axis, shape)
    found = whole(table)
    assert {e.effect for e in found.effects} == {"misalignment_temperature"}
    assert not found.reference_suspects


@pytest.mark.parametrize(("seed", "deg"), [(93062, 0.02)])
@pytest.mark.further(("seed", "deg"), [(93061, 0.05), (93063, 0.03), (93064, 0.1)])
def test_mounts_that_give_way_under_load(seed: int, deg: float) -> None:
    """Curves over the load of every channel were said of them, beside two mountings that are none."""
    table, _ = campaign(seed)
    assert table.ref_acc is not None
    assert table.ref_rate is not None
    size = np.linalg.norm(load(table.conditions()), axis=1, keepdims=True) / (10.0 * STANDARD_GRAVITY_MPS2)
    angle = size * _of(seed, deg)
    felt = (u - np.cross(angle, u) for u in (table.ref_rate, table.ref_acc))
    found = whole(replace(table, **dict(zip(("ref_rate", "ref_acc"), felt, strict=True))))
    assert not found.effects
    assert {s.hypothesis for s in found.reference_suspects} == {TURNED}
