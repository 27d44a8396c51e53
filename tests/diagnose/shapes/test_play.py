"""What has play, goes with the size of a force or with one force in few attitudes: its variable is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.channel import channel
from planner.diagnose.shapes.narrow import play
from planner.nouns.array import Array
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import FACES, Hall, Log, axes_apart, days, hidden, read
from tests.diagnose.worlds import DECLARED, whole

UP_AND_DOWN = (20.0, 60.0, 150.0, 300.0, 300.0, 150.0, 60.0, 20.0)
BOTH_WAYS = (0.0, *UP_AND_DOWN, *(-x for x in UP_AND_DOWN), 0.0)


def _said(table: DwellTable) -> set[str]:
    """Names and variables of what is found."""
    found: UnitDiagnosis = whole(table)
    assert not found.rows_left_out
    return {e.effect for e in found.effects} | {u.varies_with for u in found.unknown}


def _behind(hall: Hall, u: Array, width: float) -> Array:
    """What a stop pushes along when the input reaches either side of its play, less the input."""
    out, at = np.zeros(len(u)), 0.0
    for i, x in enumerate(u):
        at = 0.0 if i == 0 or hall.run[i] != hall.run[i - 1] else at
        if x - at > width:
            at = x - width
        elif at - x > width:
            at = x + width
        out[i] = at - x
    return out


def _edges(seed: int, visits: int = 4) -> Hall:
    """Three temperatures; rests on six faces and six edges in any order; turns in power-ons apart."""
    rng, log = np.random.default_rng([seed, 71]), Log()
    edges = [np.roll([1.0, s, 0.0], k) / np.sqrt(2.0) for k in range(3) for s in (1.0, -1.0)]
    ups = [*(sign * np.eye(3)[axis] for axis, sign in FACES), *edges]
    for _ in range(visits):
        for degc in (-40.0, 20.0, 60.0):
            log.on(rng.uniform(8.0, 50.0))
            for i in rng.permutation(12):
                log.record(0, 1.0, degc)
                level = np.linalg.qr(np.column_stack([ups[i], rng.normal(size=(3, 2))]))[0][:, 1]
                log.rows[-1][5:11] = [*ups[i], *level]
            for axis in range(3):
                log.on(rng.uniform(8.0, 50.0))
                for turn in (-180.0, -45.0, 45.0, 180.0):
                    log.record(axis, 1.0, degc, turn=turn)
            log.day += rng.uniform(0.1, 0.6)
    return log.hall()


@pytest.mark.parametrize("seed", [601])
@pytest.mark.further("seed", [602, 603, 604, 605])
def test_a_gyro_with_play_goes_with_the_rate_alone(seed: int) -> None:
    """It went with the time since power-on and the rate, along which the rates rise and fall."""
    hall = axes_apart(seed, 2, BOTH_WAYS)
    shape = _behind(hall, hall.turn[:, seed % 3], 50.0 + 10.0 * (seed % 4))
    table = replace(read(hall, seed), acc=None)
    assert _said(hidden(table, "gyro", seed % 3, 4e-5 * shape)) == {"rate"}


def test_play_follows_a_stop_in_the_order_of_the_records() -> None:
    hall = days(611, 12)
    c = channel("gyro", 1, read(hall, 611).conditions(), np.zeros(len(hall.run)), DECLARED)
    u = np.where(np.abs(hall.rate[:, 1]) > 1.0, hall.rate[:, 1], 0.0)
    (columns,) = play(c, read(hall, 611))
    for column, share in zip(columns.T, (0.1, 0.2, 0.3), strict=True):
        assert np.degrees(column) == pytest.approx(_behind(hall, u, share * np.abs(u).max()), abs=1e-9)


@pytest.mark.parametrize(("sensor", "size"), [("gyro", 4e-3), ("acc", 6e-4)])
@pytest.mark.parametrize("seed", [621])
@pytest.mark.further("seed", [622, 623, 624])
def test_the_modulus_of_a_force_on_faces_and_edges_is_no_product_of_two(
    sensor: str, size: float, seed: int
) -> None:
    """It was the products of forces, of which six follow it to four sigma of twenty."""
    hall = _edges(seed)
    other = {"gyro": "acc", "acc": "gyro"}[sensor]
    table = replace(read(hall, seed), **{other: None})
    shape = size * np.abs(hall.up[:, (seed + 1) % 3])
    assert _said(hidden(table, sensor, seed % 3, shape)) == {"specific_force"}


@pytest.mark.parametrize("seed", [631])
@pytest.mark.further("seed", [632, 633])
def test_a_square_of_a_force_on_faces_and_edges_keeps_its_name(seed: int) -> None:
    hall = _edges(seed)
    table = replace(read(hall, seed), acc=None)
    axis = seed % 3
    said = _said(hidden(table, "gyro", axis, 5e-3 * hall.up[:, axis] ** 2))
    assert said == {"g_squared_sensitivity"}
