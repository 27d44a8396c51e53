"""The example of the interfaces, with the parts filled in that it leaves out, and how to look at refusals."""

from __future__ import annotations

from pathlib import Path

import pytest

from planner.errors import Fault, InputError
from planner.spec.load import LoadedSpec, spec_from_bytes

EXAMPLE = """\
planner: 1
name: small UAV, one minute without aiding
requirement:                       # one or more
  - {error: position, limit: 10 m, rule: worst_case}
trajectory: small_uav_1
sensitivities: simulated
unit:
  service_life: 500 h
  gyro:
    bias:
      systematic: 0.03 deg/s
      run_to_run: 0.002 deg/s
      in_run: 0.001 deg/s
      storage: 0.001 deg/s
      temperature_residual: {1: 0.032 deg/s, 3: 0.0085 deg/s, 5: 0.0035 deg/s}
    scale_factor:
      systematic: 0.5 %
      run_to_run: {-55 degC: 0.02 %, 20 degC: 0.01 %, 65 degC: 0.03 %}
      temperature_residual: {1: 0.041 %, 3: 0.015 %, 5: 0.0058 %}
  accelerometer:
    bias:
      systematic: 0.02 g
      run_to_run: 1 mg
      temperature_residual: {curve: {-60 degC: 5 mg, 20 degC: 0 mg, 60 degC: -3 mg}}
    scale_factor: {systematic: 0.5 %, run_to_run: 20 ppm}
effects: [bias, bias_temperature, scale_factor, scale_factor_temperature, misalignment]
benches:
  rate_table:
    axes: 2
    units: 4
    install: 30 min
    limits: {rate: 600 deg/s}
    chamber: {range: [-65 degC, 85 degC], heating: 4 K/min, cooling: 2 K/min, soak: 30 min}
  centrifuge: {install: 30 min, arm: 1.5 m, limits: {acceleration: 100 g}}
tests:
  gyro_drift: {bench: rate_table, calibrates: [gyro.bias], motions: 1, record: 300 s, gap: 15 min}
  static:     {bench: rate_table, calibrates: [gyro.bias, accelerometer.bias], record: 300 s, gap: 15 min}
  rates:      {bench: rate_table, calibrates: gyro.scale_factor, motions: 30, record: 20 s, gap: 1 min}
plan:
  confidence: 95 %
  quantile: student
  temperatures: {range: [-60 degC, 60 degC], candidates: [1, 3, 5, 7, 10, 12, 15, 20]}
  repeats: {least: 2, most: 60}
  fixed: {gyro_drift: {temperatures: 15, repeats: 15}}
"""

NAMED = Path("campaign.yaml")


def changed(*pairs: tuple[str, str]) -> str:
    """The example with every old text, which must stand in it once, replaced by the new one."""
    text = EXAMPLE
    for old, new in pairs:
        assert text.count(old) == 1, f"{old!r} stands {text.count(old)} times in the example"
        text = text.replace(old, new)
    return text


def loaded(text: str, path: Path = NAMED) -> LoadedSpec:
    return spec_from_bytes(text.encode(), path)


def faults(text: str | bytes, path: Path = NAMED) -> tuple[Fault, ...]:
    """What is wrong with a text that must be refused."""
    with pytest.raises(InputError) as refusal:
        spec_from_bytes(text if isinstance(text, bytes) else text.encode(), path)
    assert refusal.value.exit_code == 2
    assert refusal.value.faults
    return refusal.value.faults


def place(text: str, needle: str) -> tuple[int, int]:
    """line, column (from 1) of a text that stands once."""
    assert text.count(needle) == 1, f"{needle!r} stands {text.count(needle)} times"
    before = text[: text.index(needle)]
    return before.count("\n") + 1, len(before) - before.rfind("\n")
