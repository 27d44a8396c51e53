"""Shapes that no effect has, of which nothing was said: their variable is told, clean units stay clean.

Each was seen far above the noise by who knew it, and passed for noise here: a wave over the days for the
spread of power-ons, a loop over the force for white noise; or nobody asked, or a veto was not due.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.search.sensor import diagnose_sensor
from planner.nouns.array import Array
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.units import STANDARD_GRAVITY_MPS2
from tests.diagnose.hall import FACES, Hall, Log, days, hidden, read
from tests.diagnose.labs.unit import campaign
from tests.diagnose.worlds import DECLARED, named, unnamed, whole

TURNS = (-300.0, -200.0, -120.0, -60.0, -20.0, 20.0, 60.0, 120.0, 200.0, 300.0)  # deg/s


def _said(table: DwellTable, channel: str) -> set[str]:
    """Names and variables, all on the one channel."""
    found: UnitDiagnosis = whole(table)
    assert not found.reference_suspects
    assert not found.rows_left_out
    assert all(x.channels == (channel,) for x in (*found.effects, *found.unknown))
    return {e.effect for e in found.effects} | {u.varies_with for u in found.unknown}


def _faces(seed: int, power_ons: int = 42) -> Hall:
    """Two power-ons a day, six faces each, at one of five temperatures."""
    rng, log = np.random.default_rng([seed, 52]), Log()
    for k in range(power_ons):
        log.on(rng.uniform(5.0, 20.0))
        degc = (-45.0, -15.0, 20.0, 40.0, 60.0)[k if k < 5 else rng.integers(5)] + 0.3 * rng.normal()
        for i in rng.permutation(6):
            log.record(*FACES[i], degc)
        log.day += 0.3 + rng.uniform(0.0, 0.2)
    return log.hall()


def _each_axis_once(seed: int) -> Hall:
    """Nine power-ons of faces at three temperatures; each axis turns in one more, ten rates in any order."""
    rng, log = np.random.default_rng([seed, 51]), Log()
    for degc in (-40.0, 20.0, 60.0):
        for _ in range(3):
            log.on(rng.uniform(8.0, 50.0))
            for i in rng.permutation(6):
                log.record(*FACES[i], degc)
            log.day += rng.uniform(0.1, 0.4)
    for axis in range(3):
        log.on(rng.uniform(8.0, 50.0))
        for turn in rng.permutation(TURNS):
            log.record(axis, 1.0, 20.0, turn=turn)
        log.day += 0.05
    return log.hall()


def _came_from(hall: Hall, axis: int) -> Array:
    """(n,) ±1 as the force on an axis last rose or fell within the power-on."""
    x = np.zeros(len(hall.run))
    for i in range(1, len(x)):
        if hall.run[i] == hall.run[i - 1]:
            change = hall.up[i, axis] - hall.up[i - 1, axis]
            x[i] = np.sign(change) if abs(change) > 0.1 else x[i - 1]
    return x


@pytest.mark.parametrize("seed", [1, 3])
@pytest.mark.further("seed", [4, 6, 7])
def test_a_quick_wave_over_many_power_ons_goes_with_the_days(seed: int) -> None:
    """Three waves over all the days were the quickest asked; and each column cost the log of all rows."""
    hall = _faces(seed)
    waves = np.random.default_rng(seed).uniform(4.0, 5.5) * hall.day / np.ptp(hall.day)
    table = replace(read(hall, seed), gyro=None)
    said = _said(
        hidden(table, "acc", seed % 3, 2.2e-3 * np.sin(2.0 * np.pi * waves + seed)),
        f"accelerometer_{'xyz'[seed % 3]}",
    )
    assert said == {"day"}


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4, 5])
def test_an_accelerometer_that_reads_by_where_it_came_from_goes_with_the_force(seed: int) -> None:
    """Faces in any order: it was white noise of three times the true one, and the unit clean."""
    hall, axis = days(seed, 10), seed % 3
    table = replace(read(hall, seed), gyro=None)
    said = _said(hidden(table, "acc", axis, 2e-4 * _came_from(hall, axis)), f"accelerometer_{'xyz'[axis]}")
    assert said == {"specific_force"}


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.further("seed", [4, 5, 6])
def test_what_one_power_on_alone_can_show_of_a_rate_is_told_where_its_records_repeat_it(seed: int) -> None:
    """It rested on one power-on alone, as everything does of an axis that turns in one; four rows went."""
    hall, axis = _each_axis_once(seed), seed % 3
    table = replace(read(hall, seed), acc=None)
    shape = 7e-4 * np.sqrt(np.abs(hall.turn[:, axis]))
    assert _said(hidden(table, "gyro", axis, shape), f"gyro_{'xyz'[axis]}") == {"rate"}


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4, 5])
def test_a_spike_in_the_one_power_on_that_turns_an_axis_is_nothing_that_goes_with_its_rate(seed: int) -> None:
    hall, axis = _each_axis_once(seed), seed % 3
    table = replace(read(hall, seed), acc=None)
    struck = np.flatnonzero(hall.turn[:, axis] == TURNS[seed])
    found = whole(hidden(table, "gyro", axis, 0.012 * np.isin(np.arange(len(hall.run)), struck)))
    assert not found.effects
    assert not found.unknown


@pytest.mark.parametrize("seed", [2])
@pytest.mark.further("seed", [3, 4, 5, 6, 7])
def test_an_accelerometer_that_sticks_at_small_forces_is_told_beside_loads(seed: int) -> None:
    """0.5 mg: curves of gravity were asked only where no record is loaded, powers of the load say nothing."""
    table, _ = campaign(seed)
    axis = seed % 3
    assert table.ref_acc is not None
    force = table.ref_acc[:, axis] / STANDARD_GRAVITY_MPS2
    sticks = hidden(replace(table, gyro=None), "acc", axis, -5e-4 * np.clip(force / 1e-3, -1.0, 1.0))
    found = diagnose_sensor(prepared(sticks), "accelerometer", DECLARED, 1).found
    assert not named(found)
    assert unnamed(found) == {("specific_force", "xyz"[axis])}


@pytest.mark.parametrize("hall", [_faces, _each_axis_once])
@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", range(2, 7))
def test_where_nothing_hides_nothing_is_said(hall: Callable[[int], Hall], seed: int) -> None:
    found = whole(read(hall(seed), seed))
    assert not found.effects
    assert not found.unknown
