"""What goes with gravity in many attitudes and has no equation here: its variable is told, and no powers."""

from __future__ import annotations

import numpy as np
import pytest

from planner.diagnose.channels.channel import channel
from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.scores import delta
from planner.diagnose.search.sensor import begin
from planner.diagnose.shapes.narrow import gravity_along_axes
from planner.nouns.array import Array
from planner.protocols import Sensor
from tests.diagnose.hall import Hall, Log, Noise, anywhere, axes_apart, hidden, read, two_axes
from tests.diagnose.worlds import DECLARED, told_on_y

ACC = Noise(5e-5, 2e-4)


def _found(hall: Hall, seed: int, sensor: Sensor, shape: Array) -> tuple[set[str], set[str]]:
    """Names and variables of what the shape (n,), g or deg/s, on one channel is found to be."""
    return told_on_y(hidden(read(hall, seed, acc=ACC), sensor, 1, shape), sensor, seed)


def _faces_and_tilts(seed: int) -> Hall:
    """Nine power-ons at one temperature: six faces, turns about every axis, twelve rests in any attitude."""
    rng, log = np.random.default_rng([seed, 23]), Log()
    for _ in range(9):
        log.on(rng.uniform(8.0, 50.0))
        log.on_the_table(rng, 20.0)
        for _ in range(12):
            log.record(0, 1.0, 20.0)
            log.rows[-1][5:11] = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2].ravel().tolist()
        log.day += rng.uniform(0.1, 0.6)
    return log.hall()


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3, 4, 5])
def test_an_accelerometer_that_does_not_move_at_small_forces_has_no_powers_for_names(seed: int) -> None:
    """It was a scale factor over acceleration and a cubic, two effects for one bend."""
    hall = anywhere(seed)
    names, variables = _found(hall, seed, "accelerometer", -2e-3 * np.clip(hall.up[:, 1] / 0.1, -1.0, 1.0))
    assert not names
    assert "specific_force" in variables


@pytest.mark.parametrize(("sensor", "size"), [("accelerometer", 2e-3), ("gyro", 1e-2)])
@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3, 4])
def test_the_root_of_a_force_is_no_product_of_two(sensor: Sensor, size: float, seed: int) -> None:
    """It was a product of forces, and of a gyro a sensitivity to one that no force has."""
    hall = anywhere(seed)
    names, variables = _found(hall, seed, sensor, size * np.sqrt(np.abs(hall.up[:, 0])))
    assert not names
    assert variables == {"specific_force"}


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3, 4, 5])
def test_what_a_gyro_shows_from_half_a_g_on_is_no_sensitivity_to_the_force(seed: int) -> None:
    """It was that, and what was left of it an orientation: two claims for one curve."""
    hall = _faces_and_tilts(seed)
    f = hall.up[:, 0]
    shape = 6e-3 * np.sign(f) * np.maximum(np.abs(f) - 0.5, 0.0)
    assert _found(hall, seed, "gyro", shape) == (set(), {"specific_force"})


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3])
def test_a_sensitivity_to_the_force_keeps_its_name_beside_curves_of_it(seed: int) -> None:
    hall = _faces_and_tilts(seed)
    assert _found(hall, seed, "gyro", 4e-3 * hall.up[:, 0]) == ({"g_sensitivity"}, set())


@pytest.mark.parametrize(
    ("power", "name"), [("asymmetry", "scale_factor_asymmetry"), ("cube", "scale_factor_nonlinearity")]
)
@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3])
def test_an_equation_of_the_library_keeps_its_name(power: str, name: str, seed: int) -> None:
    hall = anywhere(seed)
    x = hall.up[:, 1]
    shape = 5e-4 * (np.abs(x) if power == "asymmetry" else x**3)
    assert _found(hall, seed, "accelerometer", shape) == ({name}, set())


def test_on_six_faces_there_is_no_curve_to_ask_for() -> None:
    for hall, curves in ((axes_apart(1), 0), (anywhere(1), 4)):
        table = read(hall, 1)
        assert table.acc is not None
        c = channel("accelerometer", 1, table.conditions(), table.acc[:, 1], DECLARED)
        assert len(gravity_along_axes(c, table)) == curves


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3])
def test_no_curve_is_what_a_lean_leaves_of_a_straight_line(seed: int) -> None:
    """It was κ over temperature times a lean, as large as you like, and explained all of a misalignment's."""
    hall = two_axes(seed)
    shape = 2e-3 * hall.up[:, 2] * (hall.temperature - 20.0) / 60.0
    table = hidden(read(hall, seed, acc=ACC), "accelerometer", 1, shape)
    pool = begin(prepared(table), "accelerometer", DECLARED).pool
    told = dict.fromkeys(("misalignment_temperature", "specific_force"), 0.0)
    for b, block in enumerate(pool.blocks):
        if block.name in told and 1 in block.columns:
            told[block.name] = max(told[block.name], delta(pool, [b]))
    assert told["misalignment_temperature"] > 50.0 * told["specific_force"] > 0.0
