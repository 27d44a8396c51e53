"""The same spec, the same plan: said by `reproduce`, on a plan as it is and on one that was touched."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

import planner
from planner.export.header import sealed
from planner.export.json import DECIDING
from tests.outcome import Run
from tests.specs import small


@pytest.fixture
def made(tmp_path: Path) -> Path:
    (tmp_path / "spec.yaml").write_text(yaml.safe_dump(small(), sort_keys=False))
    planner.plan(tmp_path / "spec.yaml").save(tmp_path / "plans" / "spec")
    return tmp_path / "plans" / "spec" / "plan.json"


def resealed(file: Path, **changes: object) -> None:
    document = json.loads(file.read_text())
    document.pop("plan_sha256")
    file.write_text(json.dumps(sealed(document | changes)))


def test_a_plan_is_made_again_from_the_spec_beside_it(run: Run, made: Path) -> None:
    document = json.loads(made.read_text())
    assert {"python", "numpy", "scipy"} <= set(document["packages"]) <= {"python", *DECIDING}
    found = run("reproduce", "plans/spec", "--json")
    assert (found.code, found.json["same"], found.json["identical"]) == (0, True, True)


def test_another_campaign_or_another_package_is_said(run: Run, made: Path) -> None:
    document = json.loads(made.read_text())
    packages = document["packages"] | {"scipy": "1.0"}
    resealed(made, packages=packages, seed=document["seed"])
    found = run("reproduce", made, "--json")
    assert (found.code, found.json["same"], found.json["identical"]) == (0, True, False)
    assert found.json["packages"]["scipy"]["then"] == "1.0"
    resealed(made, time_s=document["time_s"] + 60)
    again = run("reproduce", made)
    assert again.code == 1
    assert "time_s" in again.out


def test_a_spec_that_was_changed_is_not_the_plans(run: Run, made: Path, tmp_path: Path) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text(spec.read_text() + "# a remark\n")
    assert "give --spec" in run("reproduce", made).err
    found = run("reproduce", made, "--spec", spec)
    assert found.code == 2
    assert "is not the spec of" in found.err
