"""Faults of records that no noise model may swallow: one power-on off on a channel, days, times, copies."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.records.not_as_said import screened
from planner.diagnose.records.one_channel_off import _Channel
from planner.diagnose.records.still_thermometer import still_thermometer
from planner.diagnose.records.times_of_records import OutOfOrder, out_of_order
from planner.dwells.table_rows import rows_of
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from tests.diagnose.labs.unit import campaign
from tests.specs import shipped

SECONDS = 86400.0


@cache
def whole(seed: int, tails: float = 0.0) -> DwellTable:
    return campaign(seed, centrifuge=False, tails=tails)[0]


@cache
def turned(seed: int, tails: float = 0.0) -> DwellTable:
    """Gyros at rest and turned, without the ramps."""
    table = whole(seed, tails)
    return replace(rows_of(table, table.temperature_rate == 0.0), acc=None)


def said_of(table: DwellTable) -> UnitDiagnosis:
    return diagnose(table, shipped("small_uav").spec)


def turns(table: DwellTable) -> np.ndarray:
    assert table.ref_rate is not None
    return np.asarray(np.linalg.norm(table.ref_rate, axis=1) > np.radians(1.0))


# ---------------------------------------------------------------- one power-on, one or two channels


@pytest.mark.parametrize(("seed", "fault"), [(93002, "rate")])
@pytest.mark.further(
    ("seed", "fault"),
    [(93001, "axes"), *((s, f) for s in (93003, 93004, 93005) for f in ("axes", "rate", "sign"))],
)
def test_a_power_on_that_is_off_on_a_channel_is_said(seed: int, fault: str) -> None:
    """It was "nothing is missing", or a scale factor that scatters forty times its budget."""
    table = turned(seed)
    assert table.gyro is not None
    assert table.ref_rate is not None
    runs = np.unique(table.run[turns(table)])
    run = int(runs[len(runs) // 3])
    mine = (table.run == run)[:, None]
    own = int(np.argmax(np.abs(table.ref_rate[table.run == run]).max(axis=0)))
    other = np.arange(3) == (own + 1) % 3
    wrong = {
        "axes": table.gyro[:, [own if k == own else 3 - own - k for k in range(3)]],
        "rate": table.gyro * np.where(np.arange(3) == own, 1.003, 1.0),
        "sign": np.where(other, np.abs(table.gyro), table.gyro),
    }[fault]
    found = said_of(replace(table, gyro=np.where(mine, wrong, table.gyro)))
    runs = {r.run for r in found.rows_left_out if f"run {r.run} is off on gyro" in r.guess}
    assert run in runs
    assert len(runs) <= 2  # of two at one temperature either may be it
    assert not found.reference_suspects  # it may as well be the sensor's
    assert not found.effects
    assert not found.unknown


@pytest.mark.parametrize(("seed", "tails"), [(93011, 2.5)])
@pytest.mark.further(("seed", "tails"), [(s, t) for s in (93012, 93013, 93014) for t in (0.0, 2.5)])
def test_no_power_on_of_a_plain_campaign_is_off_on_a_channel(seed: int, tails: float) -> None:
    found = said_of(turned(seed, tails))
    assert not [s for s in found.reference_suspects if not s.expected]
    assert found.kept is None


# ---------------------------------------------------------------- days, times, temperatures


def days_of_records(seed: int) -> DwellTable:
    """A power-on every eight hours, and days that run on within each."""
    table = whole(seed)
    return replace(table, day=table.run / 3.0 + table.time_on / SECONDS)


@pytest.mark.parametrize("seed", range(93020, 93026))
def test_power_ons_in_the_order_of_their_numbers_are_not_asked_about(seed: int) -> None:
    for table in (whole(seed), days_of_records(seed)):
        assert out_of_order(table) is None
        assert still_thermometer(table) == ()


@pytest.mark.parametrize("seed", range(93020, 93024))
def test_days_that_changed_places_are_found(seed: int) -> None:
    table = days_of_records(seed)
    runs = np.unique(table.run)
    one, two = int(runs[4]), int(runs[-5])
    first = {run: table.day[table.run == run].min() for run in (one, two)}
    shift = np.where(table.run == one, first[two] - first[one], 0.0)
    shift = np.where(table.run == two, first[one] - first[two], shift)
    swapped = replace(table, day=table.day + shift)
    assert out_of_order(swapped) == OutOfOrder((one, two), "day")
    assert [s.hypothesis for s in screened(swapped).suspects] == ["wrong_label"]


def test_a_time_since_power_on_that_reaches_back_before_other_power_ons_is_found() -> None:
    table = days_of_records(93020)
    run = int(np.unique(table.run)[9])
    late = np.where(table.run == run, table.time_on + 2.0 * SECONDS, table.time_on)
    found = out_of_order(replace(table, time_on=late))
    assert found == OutOfOrder((run,), "time since power-on")


def test_numbers_that_are_no_order_say_nothing() -> None:
    table = days_of_records(93021)
    runs = np.unique(table.run)
    other = np.random.default_rng(3).permutation(runs)
    assert out_of_order(replace(table, run=other[np.searchsorted(runs, table.run)])) is None


# ---------------------------------------------------------------- copies


def test_a_power_on_that_was_written_twice_is_a_finding() -> None:
    """It was a note among others, and the verdict was that nothing is missing."""
    table = turned(93001)
    run = int(np.unique(table.run)[5])
    rows = np.flatnonzero(table.run == run)
    twice = rows_of(table, np.concatenate([np.arange(len(table)), rows]))
    again = np.where(np.arange(len(twice)) >= len(table), table.run.max() + 1, twice.run)
    found = said_of(replace(twice, run=again))
    said = [r for r in found.rows_left_out if f"repeats a record of run {run} " in r.guess]
    assert len(said) == len(rows)
    assert not found.effects


def test_a_channel_of_which_nothing_is_declared_is_judged_by_its_means() -> None:
    """No column at all: what a power-on reads is then what it is off by."""
    starts = np.array([0, 4, 8])
    y = np.concatenate([np.tile([1.0, -1.0], 4), np.full(4, 50.0)])
    one = _Channel(np.empty((12, 0)), y, starts, np.zeros(12), np.ones(12))
    assert np.argmax(one.drops(np.ones(3, dtype=bool))) == 2
    np.testing.assert_allclose(one.off(2)[0], 50.0)
