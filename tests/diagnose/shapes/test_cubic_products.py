"""Products of three forces go with the force in tilted attitudes; products of two keep their name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.channel import channel
from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import diagnose_sensor
from planner.diagnose.shapes.narrow import cubic_products
from planner.dwells.table_rows import rows_of
from planner.nouns.array import Array
from planner.protocols import Sensor
from planner.units import STANDARD_GRAVITY_MPS2
from tests.diagnose.hall import Hall, Noise, anywhere, days, hidden, read, tumbles
from tests.diagnose.references.test_arm import campaign
from tests.diagnose.worlds import DECLARED, named, told_on_y, unnamed

ACC = Noise(5e-5, 2e-4)


def _found(hall: Hall, seed: int, sensor: Sensor, shape: Array) -> tuple[set[str], set[str]]:
    return told_on_y(hidden(read(hall, seed, acc=ACC), sensor, 1, shape), sensor, seed)


@pytest.mark.parametrize(("sensor", "size"), [("accelerometer", 6e-4), ("gyro", 4.5e-3)])
@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3, 4, 5])
def test_a_product_of_three_forces_goes_with_the_force(sensor: Sensor, size: float, seed: int) -> None:
    """Nothing was said at 32 sigma, or it went with the ways up and the time since power-on as well."""
    hall = anywhere(seed)
    names, variables = _found(hall, seed, sensor, size * hall.up[:, 0] ** 2 * hall.up[:, 2])
    assert not names
    assert variables == {"specific_force"}


@pytest.mark.parametrize(("sensor", "size"), [("accelerometer", 4e-4), ("gyro", 3e-3)])
@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3])
def test_a_product_of_two_forces_keeps_its_name(sensor: Sensor, size: float, seed: int) -> None:
    hall = anywhere(seed)
    names, variables = _found(hall, seed, sensor, size * hall.up[:, 0] * hall.up[:, 2])
    assert names == {"cross_coupling" if sensor == "accelerometer" else "g_product_sensitivity"}
    assert not variables


def _asked(hall: Hall, sensor: Sensor) -> int:
    table = read(hall, 1)
    readings = table.gyro if sensor == "gyro" else table.acc
    assert readings is not None
    c = channel(sensor, 0, table.conditions(), readings[:, 0], DECLARED)
    return sum(x.shape[1] for x in cubic_products(c, table))


@pytest.mark.parametrize("sensor", ["gyro", "accelerometer"])
def test_six_faces_show_none_and_a_head_that_goes_around_each_axis_no_product_of_all(sensor: Sensor) -> None:
    """About an axis two forces are there at a time: six products with a square, none of all three."""
    assert _asked(days(1, 8), sensor) == 0
    assert _asked(tumbles(1), sensor) == 6
    assert _asked(anywhere(1), sensor) == 7


def test_what_is_asked_is_no_lean_of_an_accelerometer() -> None:
    """Each column has a part that no straight line in the forces has."""
    table = read(anywhere(1), 1)
    assert table.acc is not None
    c = channel("accelerometer", 0, table.conditions(), table.acc[:, 0], DECLARED)
    lines = np.column_stack([np.ones(len(table)), c.model.conditions.specific_force])
    (products,) = cubic_products(c, table)
    for x in products.T:
        left = x - lines @ np.linalg.lstsq(lines, x, rcond=None)[0]
        assert np.linalg.norm(left) > 0.05 * np.linalg.norm(x)


def _on_an_arm(seed: int, shape: Callable[[Array], Array]) -> tuple[set[str], set[str]]:
    """What is said of an accelerometer x with a shape of the forces, g; z is up mostly."""
    table = campaign(seed, 0.0, bends=0.0)
    assert table.acc is not None
    assert table.ref_acc is not None
    f = table.ref_acc / STANDARD_GRAVITY_MPS2
    rare = np.unique(table.run[(np.abs(f[:, 0]) > 2.0) & (np.abs(f[:, 1]) > 0.5)])[1:]
    added = STANDARD_GRAVITY_MPS2 * shape(f)[:, None] * np.eye(3)[0]
    few = rows_of(replace(table, acc=table.acc + added), ~np.isin(table.run, rare))
    found = diagnose_sensor(prepared(few), "accelerometer", DECLARED, seed).found
    assert all(channels == "x" for _, channels in named(found) | unnamed(found))
    return {name for name, _ in named(found)}, {name for name, _ in unnamed(found)}


@pytest.mark.parametrize(("seed", "size"), [(1, 3e-7), (2, 1e-6)])
@pytest.mark.further(("seed", "size"), [(3, 3e-7), (4, 1e-6), (5, 1e-6), (6, 3e-7)])
def test_a_product_of_three_forces_that_is_half_one_of_two_goes_with_the_load(seed: int, size: float) -> None:
    """It was a cross-coupling, or a rectified vibration, and something else that goes with the load."""
    assert _on_an_arm(seed, lambda f: size * f[:, 0] ** 2 * f[:, 2]) == (set(), {"specific_force"})


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4, 5, 6])
def test_the_square_of_a_load_keeps_its_name_beside_it(seed: int) -> None:
    assert _on_an_arm(seed, lambda f: 5e-7 * f[:, 0] ** 2) == ({"cross_coupling"}, set())
