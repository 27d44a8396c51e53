"""Gravity round a unit that turns about a level axis: its means are those of the motion, by fine sums."""

from __future__ import annotations

import numpy as np
import pytest

from planner.physics.attitude import unit
from planner.physics.swinging_force import swing

G = 9.80665
Array = np.ndarray


def turned(axis: Array, up: Array, angle: float, count: int = 20_001) -> Array:
    """(count, 3) the force while the unit turns about `axis` by an angle, in steps of equal time."""
    phi = angle * ((np.arange(count) + 0.5) / count - 0.3)[:, None]  # the middle is nowhere in particular
    along = axis * (axis @ up)
    return np.asarray(G * (along + (up - along) * np.cos(phi) - np.cross(axis, up) * np.sin(phi)))


def table(axis: Array, up: Array, angle: float, rate: float = 1.0) -> tuple[Array, Array, Array]:
    """A rest and a turn: rates, mean forces, durations."""
    rates = np.array([np.zeros(3), rate * axis])
    forces = np.array([[0.0, 0.0, G], turned(axis, up, angle).mean(axis=0)])
    return rates, forces, np.array([30.0, angle / rate])


@pytest.mark.parametrize("turns", [0.4, 0.75, 1.0, 1.3, 1.8, 2.5, 3.6, 5.0, 40.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_means_of_squares_and_moduli_are_those_of_the_motion(turns: float, seed: int) -> None:
    """Of whole turns and of few to the mean of INSTANTS; half a degree off upright there is no swing."""
    rng = np.random.default_rng(seed)
    axis, up = unit(rng.normal(size=3)), unit(rng.normal(size=3))
    f = turned(axis, up, 2.0 * np.pi * turns)
    rates, forces, durations = table(axis, up, 2.0 * np.pi * turns)
    found = swing(rates, forces, durations, G)
    assert found is not None
    instants = forces[1] + found[1]
    assert np.linalg.norm(instants, axis=1) == pytest.approx(G, rel=1e-9)
    assert instants.mean(axis=0) == pytest.approx(forces[1], abs=1e-12)
    assert instants.T @ instants / len(instants) == pytest.approx(f.T @ f / len(f), abs=0.01 * G**2)
    assert np.abs(instants).mean(axis=0) == pytest.approx(np.abs(f).mean(axis=0), abs=0.02 * G)
    assert not found[0].any()


def test_without_a_duration_the_arc_is_the_shortest_that_has_the_mean() -> None:
    axis, up = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    rates, forces, durations = table(axis, up, 0.6 * 2.0 * np.pi)
    with_it, without = swing(rates, forces, durations, G), swing(rates, forces, 0.0 * durations, G)
    assert with_it is not None
    assert without == pytest.approx(with_it, abs=0.01 * G)


def test_where_no_gravity_goes_round_there_is_no_swing() -> None:
    up = np.array([0.0, 0.0, 1.0])
    upright = np.array([np.zeros(3), up, up])
    loaded = np.array([up, up, up + np.array([0.4, 0.0, 0.0])])
    assert swing(upright, G * loaded, np.full(3, 30.0), G) is None
    nothing_known = np.zeros((3, 3))
    assert swing(np.eye(3) * [0.0, 1.0, 1.0], nothing_known, np.full(3, 30.0), G) is None
