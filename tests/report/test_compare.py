"""Comparison of plans: reasons sum to the difference, exactly; broken documents are refused."""

from __future__ import annotations

import io
import json
import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

from planner.errors import InputError
from planner.export.json import plan_document, step_document
from planner.report.comparison import compare, comparison_document
from planner.report.console import show
from planner.report.subjects.compare import comparison_report
from tests.report import sample

seconds = st.floats(0.0, 1e6, allow_nan=False)
tests_of_a_plan = st.dictionaries(
    st.sampled_from(["gyro_drift", "static", "rates"]),
    st.tuples(
        st.lists(st.integers(1, 9), min_size=1, max_size=4), seconds, st.sampled_from(["table", "arm"])
    ),
    max_size=3,
)


def document(
    tests: dict[str, Any], shared: list[tuple[str, float]], rest: float, limit: float
) -> dict[str, Any]:
    """A plan.json with steps one after another and `rest` seconds that no step covers."""
    clock = sample.Clock()
    for action, length in shared:
        clock.add("table", action, length)
    rows = []
    for name, (repeats, length, bench) in tests.items():
        clock.add(bench, "record", length, test=name)
        rows.append(row_of(name, repeats, length, bench))
    requirement = {"error": "position", "limit": limit, "achieved": limit * 0.9, "unit": "m", "rule": "rss"}
    return {
        "spec": {"name": "drawn", "sha256": "00" * 32},
        "requirements": [requirement | {"at": "end", "met": True, "shares": {}}],
        "allowances": {},
        "tests": rows,
        "steps": list(map(step_document, clock.steps)),
        "time_s": max(clock.now + rest, 0.0),
        "power_on_s": 0.0,
        "gap": 0.0,
    }


def row_of(name: str, repeats: list[int], length: float, bench: str) -> dict[str, Any]:
    """A test of plan.json, its temperatures 10 K apart."""
    return {
        "test": name,
        "bench": bench,
        "calibrates": [],
        "motions": 1,
        "temperatures_degc": [10.0 * i for i in range(len(repeats))],
        "repeats": repeats,
        "time_s": length,
        "power_on_s": 0.0,
    }


documents = st.builds(
    document,
    tests_of_a_plan,
    st.lists(st.tuples(st.sampled_from(["install", "soak", "ramp"]), seconds), max_size=4),
    st.floats(-10.0, 1e5),
    st.floats(1.0, 50.0),
)


@settings(deadline=None, max_examples=60)
@given(st.lists(documents, min_size=2, max_size=4))
def test_reasons_and_headings_sum_to_the_whole_exactly(plans: list[dict[str, Any]]) -> None:
    comparison = compare(plans)
    for i, difference in enumerate(comparison.differences, start=1):
        assert sum(reason.added_us for reason in difference.reasons) == difference.added_us
        assert difference.added_us == comparison.time_us[i] - comparison.time_us[0]
    for group in (comparison.benches, comparison.tests, comparison.actions):
        totals = [sum(spent.time_us[i] for spent in group) for i in range(len(plans))]
        assert totals == list(comparison.time_us)


@settings(deadline=None, max_examples=30)
@given(documents, documents)
def test_the_way_back_is_the_opposite(a: dict[str, Any], b: dict[str, Any]) -> None:
    there, back = compare([a, b]).differences[0], compare([b, a]).differences[0]
    assert there.added_us == -back.added_us
    assert {r.what: r.added_us for r in there.reasons} == {r.what: -r.added_us for r in back.reasons}


@settings(deadline=None, max_examples=30)
@given(documents, documents)
def test_printed_hours_add_up(a: dict[str, Any], b: dict[str, Any]) -> None:
    text = printed([a, b])
    block = text[text.index(" against drawn (1):") :].splitlines()[1:]
    lines = [line.replace("−", "-") for line in block if line.startswith("  ") and line.endswith(" h")]
    values = [round(100 * float(line.removesuffix(" h").split()[-1])) for line in lines]
    assert sum(values[:-1]) == values[-1]


def test_a_plan_is_the_same_as_itself() -> None:
    one = plan_document(sample.plan())
    comparison = compare([one, json.loads(json.dumps(one))])
    assert not comparison.differ
    assert all(not difference.reasons for difference in comparison.differences)


def test_another_limit_is_a_difference_though_the_hours_are_equal() -> None:
    comparison = compare([plan_document(sample.plan(limit=limit)) for limit in (30.0, 31.0)])
    assert comparison.differ
    assert comparison.requirements[0].limit == (30.0, 31.0)


def test_published_acceleration_is_explained() -> None:
    """K 2.6: 15 → 5 temperatures and repeats of one drift test, 1200 s a repeat: 15·15·1200 − 5·5·1200 s."""
    long, short = (
        document({"gyro_drift": ([n] * n, n * n * 1200.0, "table")}, [("soak", 3600.0 * n)], 0.0, 10.0)
        for n in (15, 5)
    )
    difference = compare([long, short]).differences[0]
    found = {reason.what: (reason.why, reason.added_us) for reason in difference.reasons}
    assert found["gyro_drift"] == ("15 → 5 temperatures, 15 → 5 repeats", -200 * 1200 * 10**6)
    assert found["table soak"] == ("1 as before, 15.00 → 5.00 h each on average", -36_000 * 10**6)


def test_new_and_dropped_tests_are_named() -> None:
    a = document({"static": ([3], 60.0, "table")}, [], 0.0, 10.0)
    b = document({"rates": ([3], 50.0, "table")}, [], 0.0, 10.0)
    assert {r.what: r.why for r in compare([a, b]).differences[0].reasons} == {
        "static": "dropped",
        "rates": "new",
    }


WRONG: list[dict[str, Any]] = [
    {"steps": [{"bench": "x"}]},
    {"steps": [{"bench": "x", "action": "soak", "start_s": 0.0, "end_s": math.nan}]},
    {"steps": 3},
    {"time_s": math.inf},
    {"tests": [{"test": "a", "bench": "b", "temperatures_degc": 1, "repeats": []}]},
    {"requirements": [{"error": "position"}]},
    {"allowances": {"gyro.bias": 1.0}},
]


@pytest.mark.parametrize(
    "broken", [{}, [], {"spec": {}}, *({**document({}, [], 0.0, 1.0), **w} for w in WRONG)]
)
def test_what_is_no_plan_is_refused(broken: Any) -> None:
    with pytest.raises(InputError, match="plan 2"):
        compare([document({}, [], 0.0, 1.0), broken])


def test_one_plan_cannot_be_compared() -> None:
    with pytest.raises(InputError, match="two plans"):
        compare([document({}, [], 0.0, 1.0)])


def printed(plans: list[dict[str, Any]]) -> str:
    out = io.StringIO()
    show(comparison_report(compare(plans)), Console(file=out, width=120))
    return out.getvalue()


def test_printing_is_plain_and_shows_markup_as_text() -> None:
    text = printed([plan_document(sample.plan()), plan_document(sample.plan(repeats=5, name="b [red]"))])
    assert "\x1b" not in text
    assert "b [red] against small UAV" in text
    assert "static: 8 → 5 repeats: −7.39 h" in text


def test_json_is_plain_data_in_seconds_that_add_up_to_the_microsecond() -> None:
    comparison = compare([plan_document(sample.plan()), plan_document(sample.plan(repeats=5))])
    data = json.loads(json.dumps(comparison_document(comparison), allow_nan=False))
    reasons = [reason["added_s"] for reason in data["differences"][0]["reasons"]]
    assert round(1e6 * sum(reasons)) == round(1e6 * (data["time_s"][1] - data["time_s"][0]))
    assert not [key for key in data if key.endswith("_us")]
    assert data["differ"] is True
