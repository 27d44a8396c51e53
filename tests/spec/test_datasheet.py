"""A spec from a data sheet's figures: every term lands in its key, and what the sheet lacks is marked."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest

from planner.errors import InputError
from planner.spec.datasheet import datasheet_spec, terms
from planner.spec.load import spec_from_bytes
from planner.spec.model import Spec
from planner.units import to_si
from tests.outcome import Run
from tests.specs import SHIPPED

CLASSES = sorted((SHIPPED / "from_datasheets").glob("*.yaml"))
LEAST = {"gyro-bias-instability": "2 deg/h", "accelerometer-bias-repeatability": "1 mg"}


def spec_of(**figures: str) -> Spec:
    flags = {name.replace("_", "-"): text for name, text in figures.items()}
    return spec_from_bytes(datasheet_spec(LEAST | flags).encode(), Path("sheet.yaml")).spec


def budgeted(spec: Spec, key: str) -> object:
    sensor, effect, part = key.split(".")
    return getattr(getattr(spec.unit, sensor)[effect], part)


PLAIN = [flag for flag, term in terms().items() if term.key and term.how == "as_is"]


@pytest.mark.parametrize("flag", PLAIN)
def test_a_figure_stands_in_its_key_as_it_was_given(flag: str) -> None:
    term = terms()[flag]
    whole = {term.flag: term.example} | (
        {f"{flag.rpartition('-')[0]}-error": "1 %"} if flag.endswith("factor-repeatability") else {}
    )
    found = budgeted(spec_of(**{name.replace("-", "_"): text for name, text in whole.items()}), term.key)
    assert getattr(found, "text", None) == term.example


def test_a_coefficient_is_the_size_over_half_the_range() -> None:
    spec = spec_of(gyro_bias_temperature_coefficient="0.002 deg/s/K", coldest="-40 degC", hottest="60 degC")
    table = spec.unit.gyro["bias"].residual_table
    assert table is not None
    assert table[1] == pytest.approx(np.radians(0.002 * 50.0), rel=1e-3)  # three digits are written
    assert spec.plan.temperatures.range == (-40.0, 60.0)
    assert "bias_temperature" in spec.effects


def test_nonlinearity_is_the_cubic_whose_best_line_misses_so_much() -> None:
    """By the straight line that is best in Chebyshev's sense, tried on a grid of slopes."""
    spec = spec_of(gyro_nonlinearity="100 ppm", gyro_range="250 deg/s")
    c, x = spec.unit.gyro["scale_factor_nonlinearity"].systematic_size, np.linspace(-1.0, 1.0, 2001)
    cubic = c * (250.0 / 500.0) ** 2 * x**3
    missed = min(np.abs(cubic - slope * x).max() for slope in np.linspace(0.0, cubic[-1], 4001))
    assert missed == pytest.approx(100e-6, rel=5e-3)


def test_noise_is_a_random_walk_or_a_density() -> None:
    spec = spec_of(gyro_arw="0.3 deg/sqrt(h)", accelerometer_vrw="100 micro-g/sqrt(Hz)")
    assert spec.unit.white("gyro") == pytest.approx(np.radians(0.3) / 60.0)
    assert spec.unit.white("accelerometer") == pytest.approx(to_si("100 micro-g", "g"))


def test_what_is_not_on_the_sheet_is_marked() -> None:
    text = datasheet_spec(LEAST | {"gyro-scale-factor-error": "500 ppm"})
    assert "run_to_run: 20 deg/h    # ASSUMED: not on the sheet, 10 × bias instability" in text
    assert "run_to_run: 50 ppm    # ASSUMED" in text


def test_every_fault_of_the_figures_is_said_at_once() -> None:
    with pytest.raises(InputError) as refused:
        datasheet_spec({"gyro-bias-instabilty": "1 deg/h", "gyro-arw": "3 mg", "gyro-bias-error": "-1 deg/s"})
    said = {fault.path: fault.message for fault in refused.value.faults}
    assert "did you mean" in said["--gyro-bias-instabilty"]
    assert {"--gyro-arw", "--gyro-bias-error", "--gyro-bias-instability"} <= set(said)


@pytest.mark.parametrize("path", CLASSES, ids=lambda path: path.stem)
def test_a_shipped_class_is_what_its_command_makes(path: Path, run: Run, tmp_path: Path) -> None:
    top, text = path.read_text().split("#\n# A spec for planner", 1)
    command = top[top.index("# planner init") :].replace("\\\n#", "").removeprefix("# planner ")
    words = ["made.yaml" if word == "THIS_FILE" else word for word in shlex.split(command)]
    words[1] = str(tmp_path / "made.yaml")
    assert run(*words).code == 0
    assert (tmp_path / "made.yaml").read_text() == f"# A spec for planner{text}"
    assert run("check", path).code == 0


def test_without_figures_every_term_is_listed(run: Run, tmp_path: Path) -> None:
    found = run("init", tmp_path / "spec.yaml", "--from-datasheet")
    assert found.code == 2
    assert all(f"--{flag} " in found.err for flag in terms())
    assert run("init", tmp_path / "spec.yaml", "--gyro-arw", "1").code == 2  # without --from-datasheet


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("accel-vrw", "accelerometer-vrw"),
        ("acc-bias-turn-on", "accelerometer-bias-repeatability"),
        ("gyroscope-arw", "gyro-arw"),
    ],
)
def test_words_that_data_sheets_use_are_told_how_they_are_said_here(said: str, meant: str) -> None:
    with pytest.raises(InputError) as refusal:
        datasheet_spec(LEAST | {said: "1 mg"})
    (fault,) = refusal.value.faults
    assert f"did you mean '{meant}'" in fault.message
