"""Whatever stands where a file is asked for: which file, what is wrong with it, what to give instead."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.outcome import Run
from tests.specs import ROOT

SPEC = str(ROOT / "requirements_specs" / "close_the_loop.yaml")
COMMANDS = (
    "check {}",
    "plan {}",
    "migrate {}",
    "why {}",
    "compare {} {}",
    "export {} --format csv",
    "verify {spec} {}",
    "reproduce {}",
    "simulate {spec} --settings {} -o data.csv",
    "calibrate {} --spec {spec}",
    "diagnose {} --spec {spec}",
    "update {spec} --diagnosis {} -o spec2.yaml",
    "look {}",
    "reduce {} -o data.csv",
    "apply {} data.csv -o out.csv",
    "accept {} --spec {spec}",
    "forecast {} --spec {spec}",
    "sensitivity {spec} --trajectory {}",
)


@pytest.mark.parametrize("kind", ["absent", "folder", "empty", "binary"])
@pytest.mark.parametrize("command", COMMANDS)
def test_a_file_that_is_none_is_named_with_what_is_wrong_and_what_to_do(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, kind: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    Path("empty").touch()
    Path("binary").write_bytes(bytes(range(128, 256)) * 4 + bytes(64))
    outcome = run(*command.format(*[kind] * 2, spec=SPEC).split(), "--json")
    assert outcome.code == 2
    (fault,) = outcome.envelope["faults"]
    assert kind in fault["file"] + fault["message"]
    assert fault["code"]
    assert fault["remedy"]
    said = {"absent": "does not exist|no such", "folder": "is a folder|does not exist", "empty": "empty"}
    assert re.search(said.get(kind, "text|binary|no calibration|no format"), fault["message"])
