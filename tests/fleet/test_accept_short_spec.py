"""`accept` asks a spec only for what its answer needs: with a plan, neither benches nor tests."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import planner
from planner.dwells.dwell_files import write_dwells
from planner.errors import InputError
from tests.diagnose.labs.unit import campaign
from tests.verify.plans import flown, plan_of


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """A unit's dwell table, and the plan that it is held against."""
    data, plan = tmp_path / "data.csv", tmp_path / "plan.json"
    write_dwells(campaign(2)[0], data)
    plan.write_text(json.dumps(plan_of("flown").document), encoding="utf-8")
    return data, plan


def test_without_benches_and_tests_a_plan_gives_the_same_answer(files: tuple[Path, Path]) -> None:
    data, plan = files
    short = {key: value for key, value in flown().items() if key not in ("benches", "tests")}
    answers = [planner.accept(data, spec=spec, plan=plan).to_dict()["units"] for spec in (short, flown())]
    assert answers[0] == answers[1]
    assert answers[0]


def test_without_a_plan_the_refusal_names_what_planning_needs(files: tuple[Path, Path]) -> None:
    short = {key: flown()[key] for key in ("planner", "unit", "effects")}
    for plan, lacking in ((files[1], {"requirement", "trajectory"}), (None, None)):
        with pytest.raises(InputError) as raised:
            planner.accept(files[0], spec=short, plan=plan)
        paths = {fault.path for fault in raised.value.faults}
        assert paths == (lacking or {"requirement", "trajectory", "benches", "tests"})
