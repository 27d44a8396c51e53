"""The plan's hash, its schema, and what a changed plan gets."""

from __future__ import annotations

import csv
import json

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.catalog import exports
from planner.errors import InputError
from planner.export.documents import read_plan, read_sealed_plan
from planner.export.header import check_seal, plan_sha256
from planner.export.json import document_text
from planner.nouns.plan_file import plan_schema, typed_plan
from planner.protocols import ExportOptions
from tests.export.samples import cut, resealed, shipped
from tests.shipped_plans import NAMES

PLAN = "published_one_bench"


def numbers_in(step: dict) -> list[tuple[str, str | None]]:
    """Places of the numbers in a step: (key, axis of its motion)."""
    places = [(k, None) for k, v in step.items() if isinstance(v, int | float)]
    return places + [("motion", axis) for axis in step["motion"] or {}]


@given(st.data())
@settings(deadline=None, max_examples=60)
def test_any_edit_of_a_number_of_a_step_is_seen(data):
    document = cut(PLAN)
    check_seal(document, "plan.json")
    step = data.draw(st.sampled_from(document["steps"]))
    key, axis = data.draw(st.sampled_from(numbers_in(step)))
    holder, name = (step, key) if axis is None else (step["motion"], axis)
    value = data.draw(
        st.floats(allow_nan=False, allow_infinity=False).filter(lambda v: v != holder[name])
        | st.integers(-(10**6), 10**6).filter(lambda v: v != holder[name])
    )
    holder[name] = value
    with pytest.raises(InputError, match="was changed after planner wrote it"):
        check_seal(document, "plan.json")


@given(st.data())
@settings(deadline=None, max_examples=30)
def test_steps_taken_out_doubled_or_swapped_are_seen(data):
    document = cut(PLAN)
    steps = document["steps"]
    i, j = (data.draw(st.integers(0, len(steps) - 1)) for _ in "ij")
    match data.draw(st.sampled_from(["out", "double", "swap"])):
        case "out":
            del steps[i]
        case "double":
            steps.insert(j, steps[i])
        case "swap" if i != j:
            steps[i], steps[j] = steps[j], steps[i]
        case _:
            steps.reverse()
    with pytest.raises(InputError, match="was changed"):
        check_seal(document, "plan.json")


def test_another_layout_of_the_same_plan_keeps_its_hash(tmp_path):
    document = shipped(PLAN)
    file = tmp_path / "plan.json"
    file.write_text(json.dumps(document, indent=7, sort_keys=True, ensure_ascii=True))
    assert read_sealed_plan(file) == document


def test_the_hash_is_of_the_canonical_text():
    """A plan small enough to write its canonical text down by hand."""
    import hashlib

    document = {"steps": [{"end_s": 1.5, "id": "ä"}], "planner": "0", "plan_sha256": "x", "$schema": "y"}
    text = '{"planner":"0","steps":[{"end_s":1.5,"id":"ä"}]}'
    assert plan_sha256(document) == hashlib.sha256(text.encode()).hexdigest()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema_version": 2}, "schema_version 2, this planner knows 1"),
        ({"time_s": float("nan")}, "is not a plan"),
    ],
)
def test_other_versions_and_impossible_figures_are_refused(tmp_path, change, message):
    document = shipped(PLAN) | change
    if message.startswith("schema"):
        document = resealed(document)
    file = tmp_path / "plan.json"
    file.write_text(json.dumps(document))
    with pytest.raises(InputError, match=message):
        read_sealed_plan(file)


def test_a_plan_without_hash_is_refused_but_can_still_be_compared(tmp_path):
    document = cut(PLAN)
    del document["plan_sha256"]
    (tmp_path / "plan.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match="no plan_sha256"):
        read_sealed_plan(tmp_path)
    assert read_plan(tmp_path)["path"] == str(tmp_path)


@pytest.mark.parametrize("name", NAMES)
def test_the_schema_takes_every_shipped_plan(name):
    schema = plan_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    document = shipped(name)
    jsonschema.Draft202012Validator(schema).validate(cut(name, 300))  # a second of its time per 10 000 steps
    assert len(typed_plan(document).steps) == len(document["steps"])


MUTATIONS = {
    "step without an id": lambda d: d["steps"][0].pop("id"),
    "time as text": lambda d: d["steps"][0].update(start_s="0"),
    "negative time": lambda d: d["steps"][0].update(start_s=-1),
    "unknown action": lambda d: d["steps"][0].update(action="dance"),
    "unknown key of a step": lambda d: d["steps"][0].update(speed=1),
    "unknown axis": lambda d: d["steps"][3].update(motion={"rate_7_dps": 1}),
    "motion without unit": lambda d: d["steps"][3].update(motion={"rate_1": 1}),
    "half a unit": lambda d: d["steps"][0].update(units=0.5),
    "no benches": lambda d: d.pop("benches"),
    "bench without axes": lambda d: d["benches"]["rate_table"].pop("axes"),
    "unknown limit": lambda d: d["benches"]["rate_table"]["limits"].update(jerk=1),
    "limit of zero": lambda d: d["benches"]["rate_table"]["limits"].update(rate_dps=0),
    "short hash": lambda d: d.update(plan_sha256="abc"),
    "no spec": lambda d: d.pop("spec"),
    "steps as a mapping": lambda d: d.update(steps={}),
    "repeats of zero": lambda d: d["tests"][0].update(repeats=[0]),
    "met in words": lambda d: d["requirements"][0].update(met="yes"),
}


@pytest.mark.parametrize("name", MUTATIONS)
def test_the_schema_and_the_reader_reject(name):
    document = cut(PLAN)
    MUTATIONS[name](document)
    assert list(jsonschema.Draft202012Validator(plan_schema()).iter_errors(document))
    with pytest.raises(InputError, match="not a plan that planner writes"):
        typed_plan(document)


def test_the_json_export_is_the_plan_and_names_its_schema(tmp_path):
    document = cut(PLAN)
    files = exports()["json"].files(document, ExportOptions()).files
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    made = read_sealed_plan(tmp_path)
    assert made.pop("$schema") in files
    assert made == document
    schema = json.loads((tmp_path / "plan.schema.json").read_text())
    assert not list(jsonschema.Draft202012Validator(schema).iter_errors(json.loads(files["plan.json"])))
    again = exports()["json"].files(read_sealed_plan(tmp_path), ExportOptions()).files
    assert again == files
    assert document_text(document).count('\n  {"id": ') == len(document["steps"])


def test_the_csv_export_has_one_row_a_step_with_units_in_the_names():
    document = shipped(PLAN)
    text = exports()["csv"].files(document, ExportOptions()).files["steps.csv"]
    rows = list(csv.DictReader(text.splitlines()))
    assert len(rows) == len(document["steps"])
    for row, step in zip(rows, document["steps"], strict=True):
        assert row["id"] == step["id"]
        assert float(row["end_s"]) == step["end_s"]
        assert json.loads(row["motion"] or "null") == step["motion"]
        assert int(row["units"]) == step["units"]
        assert row["plan_sha256"] == document["plan_sha256"]
