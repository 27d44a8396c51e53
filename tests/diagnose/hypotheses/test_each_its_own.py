"""Three channels that lack one effect, each by its own size, are no fault of the bench.

What a reference lacks is the same on each: a share of the rate, or the Earth's rate that its rests have.
Campaigns of plain NumPy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.references.earth_in_turns import as_at_rest
from planner.nouns.array import Array
from tests.diagnose.hall import EARTH, LATITUDE, Hall, axes_apart, days, hidden, read
from tests.diagnose.worlds import whole

LARGEST = 0.02  # deg/s
EFFECTS: dict[str, Callable[[Array], Array]] = {
    "scale_factor_asymmetry": np.abs,
    "scale_factor_nonlinearity": lambda u: u**3 / 300.0**2,
}


def two_axes(seed: int) -> Hall:
    """A table with two axes: turns about x and y are about a level one, over which gravity averages out."""
    hall = axes_apart(seed, 4, (-300.0, -150.0, -60.0, 60.0, 150.0, 300.0))
    lying = hall.turns & (hall.turn[:, 2] == 0.0)
    return replace(hall, up=np.where(lying[:, None], 0.0, hall.up))


@pytest.mark.parametrize("name", EFFECTS)
@pytest.mark.parametrize("seed", [61])
@pytest.mark.further("seed", [62, *range(63, 71)])
@pytest.mark.parametrize("make", [two_axes, lambda seed: axes_apart(seed, 4)], ids=["lying", "upright"])
def test_an_effect_of_all_gyros(name: str, seed: int, make: Callable[[int], Hall]) -> None:
    """Asymmetries of .04 % were a table's rate of that size beside one asymmetry, of the size of the rest."""
    hall, rng = make(seed), np.random.default_rng([seed, 7])
    sizes = LARGEST * rng.permutation([1.0, rng.uniform(0.35, 0.75), -rng.uniform(0.25, 0.75)])
    table = read(hall, seed)
    for axis, size in enumerate(sizes):
        table = hidden(table, "gyro", axis, size * EFFECTS[name](hall.rate[:, axis]) / 300.0)
    found = whole(table)
    assert not found.reference_suspects
    ((effect, channels),) = {(e.effect, tuple(sorted(e.channels))) for e in found.effects}
    assert (effect, channels) == (name, ("gyro_x", "gyro_y", "gyro_z"))
    said = {t.channel: t for e in found.effects for t in e.terms}
    assert [np.sign(said[f"gyro_{a}"].value) for a in "xyz"] == np.sign(sizes).tolist()


@pytest.mark.parametrize("seed", [91])
@pytest.mark.further("seed", [92, *range(93, 99)])
def test_g_sensitivities_of_all_gyros(seed: int) -> None:
    """Beside those of two gyros the Earth's rate, in five coefficients, was what the third one has."""
    hall, rng = axes_apart(seed, 4), np.random.default_rng([seed, 7])
    table = read(hall, seed)
    for axis in range(3):
        table = hidden(table, "gyro", axis, 2e-3 * hall.up @ rng.normal(size=3))
    found = whole(table)
    assert {(e.effect, tuple(sorted(e.channels))) for e in found.effects} == {
        ("g_sensitivity", ("gyro_x", "gyro_y", "gyro_z"))
    }
    assert not found.reference_suspects


SQUARES: dict[str, Callable[[Array, int], Array]] = {
    "scale_factor_asymmetry": lambda u, axis: np.abs(u[:, axis]),
    "cross_coupling": lambda u, axis: u[:, (axis + 1) % 3] ** 2,
}


@pytest.mark.parametrize("name", SQUARES)
@pytest.mark.parametrize("seed", [73])
@pytest.mark.further("seed", [74, *range(75, 83)])
def test_an_effect_of_all_accelerometers(name: str, seed: int) -> None:
    """What six faces show of it twelve leaning faces would as well, in four times the coefficients.

    |f|² is g² at rest, so that three squares and the bias are one: the square that is there says it alone.
    """
    hall, rng = axes_apart(seed, 4), np.random.default_rng([seed, 7])
    table, sizes = read(hall, seed), 4e-4 * rng.permutation([1.0, 0.6, -0.8])
    for axis, size in enumerate(sizes):
        table = hidden(table, "accelerometer", axis, size * SQUARES[name](hall.up, axis))
    found = whole(table)
    assert not found.reference_suspects
    told = {(e.effect, c) for e in found.effects for c in e.channels}
    assert told == {(name, f"accelerometer_{a}") for a in "xyz"}


@pytest.mark.parametrize(("seed", "size"), [(84, 2e-4)])
@pytest.mark.further(("seed", "size"), [(85, 4e-4), (86, 2e-3)])
@pytest.mark.parametrize("channels", [1, 3])
def test_a_misalignment_that_grows_with_temperature_is_no_cube_of_the_input(
    seed: int, size: float, channels: int
) -> None:
    """From sixty sigma on it leans the input of all candidates, and a cube of ±1 is ±1 but for that part.

    It had been nonlinearities of accelerometers, or gravity off by half of it.
    """
    hall = days(seed)
    table = read(hall, seed)
    for axis in range(channels):
        leans = (hall.temperature - 20.0) / 40.0 * hall.up[:, (axis + 1) % 3]
        table = hidden(table, "accelerometer", axis, (1.0 - 0.3 * axis) * size * leans)
    found = whole(table)
    told = {(e.effect, c) for e in found.effects for c in e.channels}
    assert told == {("misalignment_temperature", f"accelerometer_{a}") for a in "xyz"[:channels]}
    assert not found.reference_suspects


def test_the_rests_say_what_turns_may_lack() -> None:
    low, high = as_at_rest(read(two_axes(71), 71))
    up, level = EARTH * np.sin(LATITUDE), EARTH * np.cos(LATITUDE)
    assert low[0] < up < high[0]
    assert high[0] - low[0] < 0.5 * up
    assert np.all((low[1:] < -level) & (high[1:] > level) & (high[1:] < 1.5 * level))
