"""White noise as data sheets write it, and what is no noise density."""

from __future__ import annotations

import math
import re

import pytest

from planner.simulate.campaign import Settings
from planner.simulate.settings import settings_of
from tests.spec.example import EXAMPLE, faults, loaded


def with_noise(text: str, sensor: str = "gyro") -> str:
    return EXAMPLE.replace(
        "  service_life: 500 h\n", f"  service_life: 500 h\n  noise: {{{sensor}: {text}}}\n"
    )


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.1 deg/sqrt(h)", math.radians(0.1) / 60.0),
        ("0.1 deg/√h", math.radians(0.1) / 60.0),
        ("0.1 deg/√(h)", math.radians(0.1) / 60.0),
        ("0.002 deg/sqrt(s)", math.radians(0.002)),
        ("0.002 deg/s/sqrt(Hz)", math.radians(0.002)),
        ("7.2 deg/h/√Hz", math.radians(0.002)),
    ],
)
def test_a_gyros_noise(text: str, value: float) -> None:
    assert loaded(with_noise(text)).spec.unit.white("gyro") == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.06 m/s/sqrt(h)", 0.001),
        ("0.001 m/s^2/sqrt(Hz)", 0.001),
        ("100 micro-g/√Hz", 9.80665e-4),
        ("0.1 mg/sqrt(Hz)", 9.80665e-4),
    ],
)
def test_an_accelerometers_noise(text: str, value: float) -> None:
    spec = loaded(with_noise(text, "accelerometer")).spec
    assert spec.unit.white("accelerometer") == pytest.approx(value, rel=1e-12)
    assert spec.unit.white("gyro") == 0.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0.1 deg/s", "no noise density, which ends in /sqrt(h) or /sqrt(Hz); write e.g. '0.1 deg/sqrt(h)'"),
        ("0.1", "no noise density"),
        ("0.1 deg/s/sqrt(h)", "'0.1 deg/s' has the wrong unit; expected one like deg"),
        ("0.1 deg/sqrt(Hz)", "expected one like deg/s"),
        ("0.1 m/s/sqrt(h)", "expected one like deg"),
        ("-0.1 deg/sqrt(h)", "must not be less than 0"),
        ("nan deg/sqrt(h)", "not a finite number"),
        ("much/sqrt(h)", "not a number with a unit"),
    ],
)
def test_what_is_no_noise_is_refused_with_its_place(text: str, words: str) -> None:
    (fault,) = faults(with_noise(text))
    assert fault.path == "unit.noise.gyro"
    assert words in fault.message
    assert fault.line == 9


def test_an_unknown_sensor_is_named() -> None:
    (fault,) = faults(with_noise("0.1 deg/sqrt(h)", "gyros"))
    assert "did you mean 'gyro'?" in fault.message


def test_without_it_the_plan_counts_none_and_the_simulation_its_own() -> None:
    spec = loaded(EXAMPLE).spec
    assert spec.unit.white("gyro") == spec.unit.white("accelerometer") == 0.0
    assert settings_of(spec).white == Settings().white


def test_the_simulation_takes_the_specs_noise_for_the_sensors_that_have_it() -> None:
    white = settings_of(loaded(with_noise("0.06 deg/sqrt(h)")).spec).white
    assert white["gyro"] == pytest.approx(math.radians(0.001))
    assert white["accelerometer"] == Settings().white["accelerometer"]


@pytest.mark.parametrize(
    ("record", "noise", "remarks"),
    [("10 s", "", 0), ("2 s", "", 1), ("2 s", "0.01 deg/sqrt(h)", 0), ("2 s", "0 deg/sqrt(h)", 0)],
)
def test_short_records_without_a_word_of_noise_are_remarked(record: str, noise: str, remarks: int) -> None:
    """0.003 deg/s/√Hz is half of 0.002 deg/s after 9 s; what the spec gives, a zero too, is counted."""
    text = with_noise(noise) if noise else EXAMPLE
    made = loaded(re.sub(r"record: [^,\n]*", f"record: {record}", text))
    said = [w.message for w in made.warnings if w.code == "P332" and "gyro" in w.message]
    assert len(said) == 2 * remarks  # of both tests that calibrate its bias
