"""Local gravity, a table's rate, a thermometer's offset: what no record tells from the sensor is said so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.findings.common_scale import (
    common_scale,
    scale_factors,
    uniform_mean_tail,
    untold_scale,
)
from planner.diagnose.search.sensor import SensorFound, diagnose_sensor
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Sensor
from tests.diagnose.labs.unit import campaign
from tests.specs import shipped

SPEC = shipped("small_uav").spec  # scale factors within ± 0.5 % before calibration


def searched(table: DwellTable, sensor: Sensor) -> SensorFound:
    return diagnose_sensor(prepared(table), sensor, tuple(SPEC.effects), 1)


def off(seed: int, sensor: Sensor, share: float, centrifuge: bool = False) -> SensorFound:
    """A campaign whose sensor reads (1 + share) times what it did: by no record told from its reference."""
    table, _ = campaign(seed, centrifuge=centrifuge)
    field = "gyro" if sensor == "gyro" else "acc"
    return searched(replace(table, **{field: getattr(table, field) * (1.0 + share)}), sensor)


@pytest.mark.parametrize(
    ("seed", "sensor", "share"), [(93001, "accelerometer", 0.02), (93002, "gyro", -0.015)]
)
@pytest.mark.further(("seed", "sensor", "share"), [(93003, "accelerometer", -0.01), (93004, "gyro", 0.03)])
def test_a_reference_that_is_off_beyond_the_budget_is_named_with_the_record_that_would_tell(
    seed: int, sensor: Sensor, share: float
) -> None:
    """They were silent: 2 % of local gravity went into three scale factors of 2 %."""
    found = off(seed, sensor, share)
    suspect = common_scale(found, SPEC)
    assert suspect is not None
    assert suspect.hypothesis == ("local_gravity" if sensor == "accelerometer" else "table_rate")
    assert suspect.low <= share <= suspect.high
    assert suspect.separated_by == 0.0
    assert suspect.alias == "scale_factor"
    assert suspect.record
    assert untold_scale(found) is not None


@pytest.mark.parametrize(("seed", "sensor"), [(93005, "accelerometer"), (93006, "gyro")])
def test_scale_factors_within_their_budget_make_no_suspect(seed: int, sensor: Sensor) -> None:
    found = off(seed, sensor, 1e-3)
    assert common_scale(found, SPEC) is None
    untold = untold_scale(found)
    assert untold is not None
    assert "would tell" in untold.why


def test_three_that_are_large_alike_and_within_their_budget_make_no_suspect() -> None:
    """The table's rate was 1.08 %, "p < 0.001", and its interval -0.05 … 2.2 %: once in a thousand units."""
    one = off(93009, "gyro", 0.0)
    kappa, _ = scale_factors(one, SPEC.unit.gyro)
    table, _ = campaign(93009, centrifuge=False)
    assert table.gyro is not None
    near = 0.0049 - kappa  # of ± 0.5 %
    three = searched(replace(table, gyro=table.gyro * (1.0 + near)), "gyro")
    known, _ = scale_factors(three, SPEC.unit.gyro)
    assert uniform_mean_tail(float(known.mean()) / 0.005, 3) < 1e-3
    assert common_scale(three, SPEC) is None


def test_one_channel_out_of_its_budget_is_no_reference() -> None:
    table, _ = campaign(93007, centrifuge=False)
    assert table.acc is not None
    one = searched(replace(table, acc=table.acc * [1.05, 1.0, 1.0]), "accelerometer")
    assert common_scale(one, SPEC) is None


def test_where_a_centrifuge_agrees_with_gravity_the_sensor_is_off() -> None:
    found = off(93008, "accelerometer", 0.02, centrifuge=True)
    assert common_scale(found, SPEC) is None
    assert untold_scale(found) is None


@pytest.mark.parametrize("seed", [93015, 93017])
@pytest.mark.further("seed", [93011, 93012, 93013, 93014, 93016, 93018])
def test_errors_that_a_table_does_not_tell_apart_are_as_large_as_budgeted(seed: int) -> None:
    """In turns at 1 g a scale factor over acceleration is one more: of 2 % the gyros' own had only half."""
    unit = shipped("high_g").spec
    table, _ = campaign(seed, centrifuge=False)
    assert table.gyro is not None
    off = prepared(replace(table, gyro=table.gyro * 1.02), unit.unit)
    suspect = common_scale(diagnose_sensor(off, "gyro", tuple(unit.effects), 1), unit)
    assert suspect is not None
    assert suspect.low <= 0.02 <= suspect.high
    assert suspect.low <= suspect.value <= suspect.high


def test_the_law_of_a_mean_of_uniform_numbers() -> None:
    """P(|mean of three| >= x) = 2 (3 (1 - x) / 2)³ / 6 near the end; by a million draws elsewhere."""
    assert uniform_mean_tail(0.9, 3) == pytest.approx(2 * 0.15**3 / 6)
    assert uniform_mean_tail(0.0, 3) == pytest.approx(1.0)
    assert uniform_mean_tail(1.2, 3) == 0.0
    drawn = np.abs(np.random.default_rng(1).uniform(-1, 1, (1_000_000, 3)).mean(axis=1))
    assert uniform_mean_tail(0.4, 3) == pytest.approx(np.mean(drawn >= 0.4), abs=2e-3)
    rng = np.random.default_rng(2)
    known_to = np.abs(rng.uniform(-1, 1, (1_000_000, 3)).mean(axis=1) + rng.normal(0.0, 0.5, 1_000_000))
    assert uniform_mean_tail(0.9, 3, 0.5) == pytest.approx(np.mean(known_to >= 0.9), abs=2e-3)


def test_an_offset_of_the_thermometer_is_among_what_no_record_shows() -> None:
    table, _ = campaign(93009, centrifuge=False)
    found = diagnose(replace(table, acc=None), SPEC)
    assert {u.effect for u in found.untestable} >= {"thermometer_offset", "table_rate"}
    assert found.verdict == "clean"
