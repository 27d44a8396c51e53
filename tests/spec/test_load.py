"""Loading: the example of the interfaces, whole files that are no spec, all faults at once in plain words."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from planner.errors import InputError
from planner.spec.load import load_spec
from planner.spec.model import PercentileRule
from planner.spec.temperature_residual import MeasuredCurve
from tests.spec.example import EXAMPLE, changed, faults, loaded, place


def test_the_example_of_the_interfaces_loads_in_si() -> None:
    spec = loaded(EXAMPLE).spec
    bias = spec.unit.gyro["bias"]
    assert bias.systematic is not None
    assert bias.systematic.si == pytest.approx(0.03 * 0.017453292519943295, rel=1e-14)
    assert isinstance(spec.unit.accelerometer["bias"].temperature_residual, MeasuredCurve)
    assert spec.plan.confidence == 0.95
    assert spec.benches["rate_table"].chamber is not None
    assert spec.benches["rate_table"].chamber.range == (-65.0, 85.0)
    assert spec.tests["rates"].calibrates == ("gyro.scale_factor",)
    assert spec.unit.service_life == 500 * 3600


def test_the_example_warns_of_what_adds_nothing_only() -> None:
    warnings = {fault.path for fault in loaded(EXAMPLE).warnings}
    assert warnings == {
        "effects[4]",  # misalignment has no budget
        "unit.accelerometer.scale_factor",  # no test calibrates it
        "plan.temperatures.candidates",  # 7 .. 20 are in none of the residual tables
    }


def test_a_loaded_spec_knows_its_file_and_digest(tmp_path: Path) -> None:
    file = tmp_path / "campaign.yaml"
    file.write_text(EXAMPLE, encoding="utf-8")
    found = load_spec(file)
    assert found.sha256 == hashlib.sha256(file.read_bytes()).hexdigest()
    assert found.path == file
    assert found.folder == tmp_path


def test_every_form_of_a_rule_and_a_moment() -> None:
    text = changed(("rule: worst_case}", "rule: {percentile: 95 %}, at: 30 s}"))
    requirement = loaded(text).spec.requirement[0]
    assert requirement.rule == PercentileRule.model_validate({"percentile": "95 %"})
    assert requirement.at == 30.0


def test_one_requirement_needs_no_list() -> None:
    text = changed(
        ("  - {error: position, limit: 10 m, rule: worst_case}", "  {error: position, limit: 10 m}")
    )
    assert len(loaded(text).spec.requirement) == 1
    wrong = text.replace("10 m}", "10}")
    (fault,) = faults(wrong)
    assert (fault.path, fault.line, fault.column) == ("requirement.limit", *place(wrong, "10}"))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "empty"),
        (b"# nothing but a comment\n", "empty"),
        (b"- planner: 1\n", "list"),
        (b"42\n", "single value"),
        (b"planner\n", "single value"),
        (b"\x7fELF\x02\x01\x01\x00\x00", "binary"),
    ],
)
def test_what_is_no_spec_at_all(tmp_path: Path, data: bytes, words: str) -> None:
    file = tmp_path / "spec.yaml"
    file.write_bytes(data)
    with pytest.raises(InputError) as refusal:
        load_spec(file)
    (fault,) = refusal.value.faults
    assert fault.file == str(file)
    assert words in fault.message


def test_files_that_cannot_be_opened(tmp_path: Path) -> None:
    for path, words in (
        (tmp_path / "absent.yaml", "does not exist"),
        (tmp_path, "is a folder"),
        (tmp_path / "x.yaml" / "y.yaml", "does not exist"),
        (Path("nul\0name.yaml"), "cannot be read"),
    ):
        with pytest.raises(InputError) as refusal:
            load_spec(path)
        assert words in refusal.value.faults[0].message


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser reads every file")
def test_an_unreadable_file(tmp_path: Path) -> None:
    file = tmp_path / "spec.yaml"
    file.write_text(EXAMPLE, encoding="utf-8")
    file.chmod(0)
    with pytest.raises(InputError, match="cannot be read"):
        load_spec(file)


def test_an_endless_file_is_refused() -> None:
    with pytest.raises(InputError, match="bytes"):
        load_spec(Path("/dev/zero"))


def test_all_faults_come_at_once_in_the_order_of_the_file() -> None:
    """One of every kind: form of a field, unknown key, unit of another dimension, contradiction."""
    text = changed(
        ("limit: 10 m", "limit: 10 deg"),
        ("in_run: 0.001 deg/s", "in_run: 1 g"),
        ("units: 4", "units: four"),
        ("calibrates: gyro.scale_factor", "calibrates: gyro.scale_facto"),
        ("confidence: 95 %", "confidense: 95 %"),
        ("least: 2, most: 60", "least: 61, most: 60"),
    )
    found = [(fault.path, fault.line) for fault in faults(text)]
    assert found == [
        ("requirement[0].limit", place(text, "10 deg")[0]),
        ("unit.gyro.bias.in_run", place(text, "in_run: 1 g")[0]),
        ("benches.rate_table.units", place(text, "units: four")[0]),
        ("tests.rates.calibrates", place(text, "gyro.scale_facto,")[0]),
        ("plan.confidense", place(text, "confidense")[0]),
        ("plan.repeats.least", place(text, "least: 61")[0]),
    ]


def test_a_faulty_part_draws_no_faults_after_it() -> None:
    """Tests on a bench that cannot be read are not told that it is missing, or has no chamber."""
    assert len(faults(changed(("[-65 degC, 85 degC]", "[-65, 85 degC]")))) == 1
    assert len(faults(changed(("run_to_run: 0.002 deg/s", "run_to_run: 2")))) == 1
    assert len(faults(changed(("run_to_run: 0.002 deg/s", "run_to_run: [2]")))) == 1


def test_no_fault_speaks_the_validators_language() -> None:
    """Every kind of wrong value at every place of the example: the sentence is ours."""
    jargon = (
        "Input should",
        "Value error",
        "validat",
        "dict",
        "tuple",
        "str'",
        "NoneType",
        "model",
        "got an",
    )
    wrong = ("[]", "{}", "3", "x", "-1 deg/s", "true", ".nan", "[x, 3]", "{x: 3}", "1e300 m")
    for line in EXAMPLE.splitlines():
        key, colon, rest = line.partition(": ")
        for value in wrong if colon and rest and not rest.startswith("#") else ():
            text = EXAMPLE.replace(line, f"{key}: {value}")
            try:
                loaded(text)
            except InputError as error:
                for fault in error.faults:
                    assert not any(word in fault.message for word in jargon), (value, line, str(fault))


def test_nothing_heavy_is_imported_with_the_package() -> None:
    heavy = {
        "planner.spec": "'pint', 'pydantic', 'numpy'",
        "planner.spec.load": "'pint', 'scipy', 'cvxpy', 'deap'",
    }
    for module, names in heavy.items():
        code = f"import sys, {module}; print([name for name in ({names}) if name in sys.modules])"
        assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"
