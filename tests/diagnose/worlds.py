"""Diagnoses of campaigns from plain NumPy, for the tests of the engine."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.hypotheses.estimates import rivals
from planner.diagnose.hypotheses.found import Found
from planner.diagnose.search.sensor import SensorFound, diagnose_sensor
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Sensor
from planner.spec.load import spec_from_bytes
from planner.spec.model import Spec
from tests.calibrate.world import Hidden, Layout, Noise, campaign, sized

# an effect and a channel on which to hide it
ON_GYROS = (
    ("g_sensitivity", "gyro_x"),
    ("g_squared_sensitivity", "gyro_y"),
    ("scale_factor_nonlinearity", "gyro_z"),
    ("scale_factor_asymmetry", "gyro_x"),
    ("scale_factor_acceleration", "gyro_y"),
    ("temperature_rate", "gyro_z"),
    ("warm_up", "gyro_x"),
    ("ageing", "gyro_y"),
    ("bias_step", "gyro_z"),
    ("misalignment_temperature", "gyro_x"),
)
RATE_TABLES = ("temperature_rate_table", "temperature_rate_table_over_time")
DECLARED = ("bias", "bias_temperature", "scale_factor", "scale_factor_temperature", "misalignment")
SPEC = b"""
planner: 1
name: bench campaign
requirement: [{error: position, limit: 1000 m, rule: worst_case}]
trajectory: small_uav_1
unit:
  gyro:
    bias: {systematic: 0.03 deg/s, run_to_run: 0.002 deg/s}
    scale_factor: {systematic: 0.5 %, run_to_run: 0.003 %}
    misalignment: {systematic: 0.3 deg, run_to_run: 0.001 deg}
  accelerometer:
    bias: {systematic: 20 mg, run_to_run: 0.8 mg}
    scale_factor: {systematic: 0.5 %, run_to_run: 0.003 %}
    misalignment: {systematic: 0.3 deg, run_to_run: 0.001 deg}
effects: [bias, bias_temperature, scale_factor, scale_factor_temperature, misalignment]
benches:
  rate_table:
    axes: 2
    units: 1
    limits: {rate: 600 deg/s}
    chamber: {range: [-65 degC, 85 degC], heating: 4 K/min, cooling: 2 K/min, soak: 30 min}
tests:
  static:
    bench: rate_table
    calibrates: [gyro.bias, accelerometer.bias, accelerometer.scale_factor, accelerometer.misalignment]
    motions: 6
    record: 60 s
  rates:
    bench: rate_table
    calibrates: [gyro.scale_factor, gyro.misalignment]
    motions: 6
    record: 20 s
"""


@cache
def spec() -> Spec:
    """A spec that declares what every unit of the world has."""
    return spec_from_bytes(SPEC, Path("bench.yaml")).spec


def whole(table: DwellTable) -> UnitDiagnosis:
    """The diagnosis as the command makes it."""
    return diagnose(table, spec())


def searched(
    seed: int,
    hidden: Sequence[Hidden] = (),
    sensor: Sensor = "gyro",
    *,
    strength: float | None = None,
    layout: Layout | None = None,
    noise: Noise | None = None,
) -> SensorFound:
    """One sensor of one campaign; strength: whitened, of every hidden effect."""
    if strength is not None:
        hidden = [sized(h, strength, seed, layout, noise) for h in hidden]
    return diagnose_sensor(prepared(campaign(seed, hidden, layout, noise)), sensor, DECLARED, seed)


def named(found: Found) -> set[tuple[str, str]]:
    """(effect, channels) of what the library explains."""
    return {_label(found, b) for b in found.library}


def unnamed(found: Found) -> set[tuple[str, str]]:
    """(variable, channels) of what has no name."""
    return {_label(found, b) for b in found.unknown}


def named_on(s: SensorFound, axis: str) -> set[str]:
    """Effects of the library that are believed on a channel."""
    return {name for name, channels in named(s.found) if axis in channels}


def unnamed_on(s: SensorFound, axis: str) -> set[str]:
    """Variables of what has no name on a channel."""
    return {name for name, channels in unnamed(s.found) if axis in channels}


def rivals_of(s: SensorFound) -> set[str]:
    """Effects that are said to be able to stand in the place of those believed."""
    library = [i for i, b in enumerate(s.found.pool.blocks) if not b.generic]
    return {name for b in s.found.library for name, _ in rivals(s.found, b, library)}


def _label(found: Found, b: int) -> tuple[str, str]:
    block = found.pool.blocks[b]
    return block.name, "".join("xyz"[a] for a in block.columns)


def told_on_y(table: DwellTable, sensor: Sensor, seed: int) -> tuple[set[str], set[str]]:
    """Names of effects and variables that are found on channel y, and on no other one."""
    found = diagnose_sensor(prepared(table), sensor, DECLARED, seed).found
    assert all(channels == "y" for _, channels in named(found) | unnamed(found))
    return {name for name, _ in named(found)}, {name for name, _ in unnamed(found)}
