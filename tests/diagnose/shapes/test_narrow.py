"""Courses of which bins have too many columns: told by a few, with their variable, without a wrong name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.channel import channel
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.shapes.narrow import heading_at_rest
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.hall import Hall, anywhere, axes_apart, days, hidden, read, tumbles
from tests.diagnose.labs.unit import campaign, noise_of
from tests.diagnose.noise.test_few_rows import some
from tests.diagnose.worlds import DECLARED, told_on_y, whole
from tests.specs import shipped

SPEC = shipped("small_uav").spec
MANY = (-400.0, -150.0, -60.0, -20.0, -8.0, 8.0, 20.0, 60.0, 150.0, 400.0)


def _said(table: DwellTable) -> set[str]:
    found: UnitDiagnosis = whole(table)
    assert not found.reference_suspects
    return {e.effect for e in found.effects} | {u.varies_with for u in found.unknown}


@pytest.mark.parametrize("seed", [301])
@pytest.mark.further("seed", [302, *range(303, 307)])
def test_a_wave_over_twenty_power_ons_goes_with_the_days(seed: int) -> None:
    """Nothing was said: four nodes are all that so few power-ons carry, and it passed for their spread."""
    hall = days(seed, 20)
    turns = np.random.default_rng(seed).uniform(1.2, 1.8) * hall.day / np.ptp(hall.day)
    table = replace(read(hall, seed), acc=None)
    assert _said(hidden(table, "gyro", seed % 3, 1e-2 * np.sin(2.0 * np.pi * turns + seed))) == {"day"}


@pytest.mark.parametrize("seed", [311, 312])
@pytest.mark.further("seed", range(313, 317))
def test_a_gyro_that_locks_in_at_small_rates_goes_with_the_rate(seed: int) -> None:
    """y = sign(ω) √(ω² − 6²): it went with the time since power-on and the rate, or was nothing."""
    hall = axes_apart(seed, 2, MANY)
    table = replace(read(hall, seed), acc=None)
    u = hall.turn[:, seed % 3]
    locked = u - np.sign(u) * np.sqrt(np.maximum(u**2 - 36.0, 0.0))
    assert _said(hidden(table, "gyro", seed % 3, 3.5e-4 * locked)) == {"rate"}


@pytest.mark.parametrize("seed", [321])
@pytest.mark.further("seed", [322, 323, 324, 325, 326])
def test_an_axis_that_leans_as_the_case_bends_goes_with_temperature(seed: int) -> None:
    """Bins of the six ways up over the nodes of the table cost more than it explains: nothing was said."""
    hall = tumbles(seed)
    table = replace(read(hall, seed), gyro=None)
    axis = seed % 3
    leans = hall.up[:, (axis + 1) % 3] * ((hall.temperature - 15.0) / 40.0) ** 2
    said = _said(hidden(table, "acc", axis, 8e-5 * leans))
    assert said <= {"temperature", "misalignment_temperature"}
    assert said


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2, 3, 4])
def test_a_step_after_power_on_goes_with_the_time_and_is_no_drift(seed: int) -> None:
    """Bins of the time cost eight columns: it was a drift, or went with the rates that turn later on."""
    hall = days(seed, 18)
    table = replace(read(hall, seed), acc=None)
    assert _said(hidden(table, "gyro", 0, 6e-4 * (hall.time_on > 400.0))) == {"time_on"}


@pytest.mark.parametrize(("seed", "size"), [(334, 2e-4), (338, 3e-4)])
@pytest.mark.further(("seed", "size"), [(s, 3e-4) for s in (334, 337, 341, 342)])
def test_a_wave_after_power_on_goes_with_the_time_and_is_no_table_of_drifts(seed: int, size: float) -> None:
    """Five segments of a table follow it: that was its name, and of a faint one nothing was said."""
    hall = days(seed, 18)
    around = 2.0 * np.pi * 1.6 * hall.time_on / np.ptp(hall.time_on) + seed
    table = replace(read(hall, seed), acc=None)
    assert _said(hidden(table, "gyro", seed % 3, size * np.sin(around))) == {"time_on"}


@pytest.mark.parametrize("seed", [98101, 98102])
@pytest.mark.further("seed", [98104])
def test_a_reading_that_saturates_at_half_of_the_loads_is_no_power_of_them(seed: int) -> None:
    """A corner and a straight line: it was a cubic or a square: bins of the loads had too many columns."""
    table, _ = campaign(seed)
    table, axis = replace(some(table, 30), gyro=None), seed % 3
    assert table.ref_acc is not None
    share = np.abs(table.ref_acc[:, axis]) / np.abs(table.ref_acc[:, axis]).max()
    beyond = np.sign(table.ref_acc[:, axis]) * np.maximum(share - 0.55, 0.0)
    said = diagnose(hidden(table, "acc", axis, -400.0 * noise_of(seed, "acc").white * beyond), SPEC)
    assert not said.effects
    assert {u.varies_with for u in said.unknown} == {"specific_force"}


@pytest.mark.parametrize(("name", "seed"), [("drift", 1), ("warm_up", 2)])
@pytest.mark.further(("name", "seed"), [("drift", 3), ("warm_up", 4)])
def test_what_grows_or_settles_after_power_on_is_no_step(name: str, seed: int) -> None:
    hall = days(seed, 18)
    table = replace(read(hall, seed), acc=None)
    shape = hall.time_on / 500.0 if name == "drift" else 1.5 * np.exp(-hall.time_on / 200.0)
    assert _said(hidden(table, "gyro", 0, 6e-4 * shape)) == {name}


@pytest.mark.parametrize(
    ("layout", "seed", "size"), [(tumbles, 1, 1.2e-3), (tumbles, 2, 1.2e-3), (anywhere, 2, 6e-4)]
)
@pytest.mark.further(
    ("layout", "seed", "size"), [(anywhere, s, z) for s, z in ((1, 1.2e-3), (3, 6e-4), (5, 6e-4))]
)
def test_where_north_lies_at_rest_goes_with_the_orientation(
    layout: Callable[[int], Hall], seed: int, size: float
) -> None:
    """What a magnetic field does to a gyro: it was a g-sensitivity, or nothing where north lies anywhere."""
    hall = layout(seed)
    table = hidden(replace(read(hall, seed), acc=None), "gyro", 1, size * hall.north[:, 2] * ~hall.turns)
    assert told_on_y(table, "gyro", seed) == (set(), {"orientation"})


def test_headings_along_the_axes_are_left_to_bins() -> None:
    for hall, blocks in ((days(1, 8), 0), (tumbles(1), 1), (anywhere(1), 1)):
        table = read(hall, 1)
        c = channel("gyro", 0, table.conditions(), np.zeros(len(table)), DECLARED)
        assert len(heading_at_rest(c, table)) == blocks
