"""Diagnoses of campaigns from plain NumPy, for the tests of the engine."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from planner.diagnosis import UnitDiagnosis
from planner.learn.diagnosis.prepared import prepared
from planner.learn.diagnosis.search import Found
from planner.learn.diagnosis.sensor import SensorFound, diagnose_sensor
from planner.learn.dwells_to_diagnosis import diagnose
from planner.measured import DwellTable
from planner.protocols import Sensor
from planner.spec.load import spec_from_bytes
from planner.spec.model import Spec
from tests.learn.world import Hidden, Layout, Noise, campaign, sized

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


def _label(found: Found, b: int) -> tuple[str, str]:
    block = found.pool.blocks[b]
    return block.name, "".join("xyz"[a] for a in block.columns)
