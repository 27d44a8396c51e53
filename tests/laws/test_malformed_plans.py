"""A plan that was changed and sealed again is made, or refused with what is wrong and where; nothing else."""

from __future__ import annotations

import contextlib
import copy
import json
import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.bench_run import limits
from planner.bench_run.job import job_from
from planner.campaign.design import design
from planner.catalog import exports
from planner.errors import InputError
from planner.export.header import plan_sha256
from planner.fleet.plan_allowances import plan_allowances
from planner.nouns.plan_file import steps_of
from planner.protocols import ExportOptions
from planner.recordings.plan_records import records_of
from planner.recordings.plan_references import references_of
from planner.report.comparison import compare
from tests.export.samples import cut, small
from tests.outcome import Run
from tests.specs import shipped as spec_of

USES = {
    **{
        f"export {name}": lambda d, form=form: form.files(d, ExportOptions())
        for name, form in exports().items()
    },
    "export acutrol macro": lambda d: exports()["acutrol"].files(d, ExportOptions("macro")),
    "compare": lambda d: compare([d, plan()]),
    "run": lambda d: limits.check(job_from(d, arm_m=1.5)),
    "simulate": lambda d: design(steps_of(d), spec_of("published_one_bench").spec),
    "reduce": lambda d: (records_of(d), references_of(d, 0.8)),
    "accept": plan_allowances,
}


@cache
def plan() -> dict[str, Any]:
    """Sixty steps of a shipped campaign, with motions of every kind."""
    return cut("published_one_bench", 60)


def places(tree: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every place in a tree, but the seal."""
    inside = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in inside:
        if (*path, key) != ("plan_sha256",):
            yield (*path, key)
            yield from places(value, (*path, key))


@cache
def in_steps() -> tuple[tuple[Any, ...], ...]:
    return tuple(place for place in places(plan()) if place[0] in ("steps", "benches"))


@cache
def elsewhere() -> tuple[tuple[Any, ...], ...]:
    return tuple(place for place in places(plan()) if place[0] not in ("steps", "benches"))


scalars = (
    st.none()
    | st.booleans()
    | st.integers(-(10**20), 10**20)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=6)
    | st.sampled_from(
        ["rate_table", "move", "record", "power_off", "rate_1_dps", "acceleration_g", 1e308, -0.0]
    )
)
values = scalars | st.lists(scalars, max_size=3) | st.dictionaries(st.text(max_size=4), scalars, max_size=3)


@st.composite
def mutated(draw: st.DrawFn) -> dict[str, Any]:
    """One to three places changed, taken out, renamed, doubled or swapped; sealed again."""
    tree = copy.deepcopy(plan())
    for _ in range(draw(st.integers(1, 3))):
        path = draw(st.sampled_from(in_steps()) | st.sampled_from(elsewhere()))
        holder = at(tree, path[:-1])
        if holder is None or not has(holder, path[-1]):
            continue  # an earlier change took it away
        mutate(draw, holder, path[-1])
    return tree | {"plan_sha256": plan_sha256(tree)}


def at(tree: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        if not has(tree, key):
            return None
        tree = tree[key]
    return tree if isinstance(tree, dict | list) else None


def has(holder: Any, key: Any) -> bool:
    if isinstance(holder, dict):
        return key in holder
    return isinstance(holder, list) and isinstance(key, int) and key < len(holder)


def mutate(draw: st.DrawFn, holder: Any, key: Any) -> None:
    match draw(st.sampled_from(["value", "like", "like", "out", "rename", "twice", "swap"])):
        case "like" if isinstance(holder[key], int | float) and abs(holder[key]) < 1e300:
            holder[key] = holder[key] * draw(st.sampled_from([-1, 0, 0.5, 2, 1000])) + draw(
                st.integers(-5, 5)
            )
        case "like" if isinstance(holder[key], str):
            holder[key] = draw(
                st.sampled_from(["rate_table", "move", "cool_down", "remove", "", holder[key]])
            )
        case "out":
            del holder[key]
        case "rename" if isinstance(holder, dict):
            holder[draw(st.text(max_size=8))] = holder.pop(key)
        case "twice" if isinstance(holder, list):
            holder.insert(key, holder[key])
        case "swap" if isinstance(holder, list):
            other = draw(st.integers(0, len(holder) - 1))
            holder[key], holder[other] = holder[other], holder[key]
        case _:
            holder[key] = draw(values)


@pytest.mark.parametrize("use", USES)
def test_the_plan_itself_is_good_for_every_use(use):
    USES[use](copy.deepcopy(plan()))


@given(mutated())
@settings(max_examples=150)
def test_a_changed_plan_is_used_or_refused(document):
    for use in USES.values():
        with contextlib.suppress(InputError):
            use(document)


STEP = 12
WRONG = {
    "start_s": ("start_s", None, "Field required"),
    "no number": ("end_s", "late", "end_s: Input should be a valid number"),
    "motion": ("motion", 5, "motion: Input should be a valid dictionary"),
    "axis": ("motion", {"rate_9_dps": 1.0}, "motion.rate_9_dps"),
    "temperature": ("temperature_degc", "cold", "temperature_degc: Input should be a valid number"),
    "backwards": ("start_s", 0.0, "start_s: 0 s, before the step that stands before it"),
    "for ever": ("end_s", 1e300, "end_s: Input should be less than"),
}


@pytest.mark.parametrize("name", WRONG)
@pytest.mark.parametrize("use", [use for use in USES if use != "accept"])
def test_a_fault_says_which_step_and_key(use, name):
    key, value, words = WRONG[name]
    document = copy.deepcopy(plan())
    step = document["steps"][STEP]
    step.pop(key)
    if value is not None:
        step[key] = value
    with pytest.raises(InputError) as caught:
        USES[use](document)
    assert f"steps.{step['id']}.{key}" in str(caught.value)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "arguments",
    [
        *(("export", "plan.json", "--format", form) for form in exports()),
        ("run", "plan.json", "--dry-run"),
        ("compare", "plan.json", "plan.json"),
    ],
    ids=" ".join,
)
def test_the_commands_refuse_a_sealed_plan_that_is_none(tmp_path, run: Run, arguments):
    document = small([("record", 10.0, {"motion": {"rate_1_dps": 5.0}})])
    document["steps"][0]["motion"] = [5]
    document["plan_sha256"] = plan_sha256(document)
    (tmp_path / "plan.json").write_text(json.dumps(document))
    outcome = run(*arguments)
    assert outcome.code == 2
    assert "steps.table/0/record.motion: Input should be a valid dictionary" in outcome.err
    assert "Traceback" not in outcome.err


def test_the_longest_campaign_still_has_a_calendar():
    """Three centuries from the last year that a campaign may begin in: a date that calendars hold."""
    document = small([("install", 60.0, {}), ("remove", 60.0, {"start_s": 1e10 - 60.0, "end_s": 1e10})])
    options = ExportOptions(start="2200-01-01T08:00")
    assert exports()["ics"].files(document, options).files
    assert math.isclose(1e10 / (365.25 * 86400), 317, rel_tol=1e-2)
