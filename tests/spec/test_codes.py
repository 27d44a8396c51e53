"""Every rule has a code that explains it, and its examples break it or keep it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

import planner
from planner.codes import Rule, rules
from planner.errors import Fault, InputError
from planner.spec.load import spec_from_bytes
from planner.spec.starter import starter_text
from planner.spec.yaml12 import read_yaml
from tests.outcome import Run
from tests.spec.example import changed, faults

SHOWN = [rule for rule in rules().values() if rule.wrong]


def merged(base: Any, part: Any) -> Any:
    """A mapping with the keys of another laid over it."""
    if not isinstance(base, dict) or not isinstance(part, dict):
        return part
    return base | {
        key: value if key == "temperature_residual" else merged(base.get(key), value)
        for key, value in part.items()
    }


def found(fragment: str) -> set[str]:
    """Codes of what is wrong or odd in the starter spec with a fragment laid over it."""
    try:
        part = read_yaml(fragment.encode(), "part").value
        whole = merged(read_yaml(starter_text().encode(), "starter").value, part)
        loaded = spec_from_bytes(yaml.safe_dump(whole).encode(), Path("spec.yaml"))
    except InputError as refusal:
        return {fault.code for fault in refusal.faults}
    return {warning.code for warning in loaded.warnings}


@pytest.mark.parametrize("rule", SHOWN, ids=[rule.code for rule in SHOWN])
def test_the_examples_of_a_rule_break_it_and_keep_it(rule: Rule) -> None:
    assert rule.code in found(rule.wrong)
    beside = {"P243", "P311", "P312", "P332"}  # an error more, or a smaller one, by an example
    assert not rule.right or found(rule.right) <= beside - {rule.code}


def test_every_code_is_explained_and_every_explanation_is_of_use() -> None:
    sources = Path(planner.__file__).parent.rglob("*.py")
    used = {code for file in sources for code in re.findall(r'"(P\d{3})"', file.read_text(encoding="utf-8"))}
    assert used == set(rules())


def test_a_fault_says_its_remedy_in_its_own_words_or_in_its_rules() -> None:
    (own,) = faults(changed(("gap: 1 min", "gap: 60")))
    assert (own.code, own.wrong, own.remedy) == ("P111", "'60' has no unit", "write e.g. '60 s'")
    assert Fault("a.yaml", 1, 1, "name", "is odd", "P101").remedy == rules()["P101"].remedy


def test_a_fault_shows_its_line_with_a_caret_under_the_place() -> None:
    (fault,) = faults(changed(("confidence: 95 %", "confidense: 95 %")))
    place, line, caret = fault.shown.splitlines()
    assert place == str(fault)
    assert place.endswith("[P101]")
    assert line[caret.index("^") :].startswith("confidense")


def test_explain_answers_by_code_and_lists_all(run: Run) -> None:
    assert "sqrt(h)" in run("explain", "p331").out
    assert len(run("explain").out.splitlines()) == len(rules())
    unknown = run("explain", "P999")
    assert unknown.code == 2
    assert "P999" in unknown.err
