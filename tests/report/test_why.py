"""`planner why` answers of every plan: prices of its visits, or what asks for their repeats."""

from __future__ import annotations

from functools import cache

import pytest

from planner.api.comparing import WhyAnswer, why
from planner.report.blocks import Table
from tests.shipped_plans import shipped_document


@cache
def answer_of(name: str) -> WhyAnswer:
    """What `planner why` says of a shipped plan: of one by information it prices every visit, for seconds."""
    return why(shipped_document(name))


def tables(name: str) -> dict[str, Table]:
    blocks = (b for r in answer_of(name).reports for s in r.sections for b in s.blocks)
    return {block.caption.split(",")[0]: block for block in blocks if isinstance(block, Table)}


@pytest.mark.parametrize("name", ["published_optimum", "published_one_bench"])
def test_a_published_plan_says_what_asks_for_its_repeats(name: str) -> None:
    """One row a visit; the error named is the one with the least room between what is needed and reached."""
    document = shipped_document(name)
    rows = tables(name)["What asks for the repeats of every visit"].rows
    assert len(rows) == sum(len(t["temperatures_degc"]) for t in document["tests"] if t["calibrates"])
    for reason in document["reasons"]:
        mine = [r for r in document["reasons"] if r["test"] == reason["test"]]
        tightest = max(mine, key=lambda r: r["half_width"] / r["needed_half_width"])
        named = {row[3] for row in rows if row[0] == reason["test"]}
        assert tightest["error"] in named
    hours = tables(name)["Hours of every test"].rows
    assert [row[0] for row in hours] == [
        t["test"] for t in sorted(document["tests"], key=lambda t: -t["time_s"])
    ]
    answer = answer_of(name)
    assert len(answer.rows()) == len(document["reasons"])
    assert "plan: {method: information}" in answer.reports[0].sentences[-1]


def test_a_plan_by_information_prices_its_visits_instead() -> None:
    answer = answer_of("small_uav")
    assert "What asks for the repeats of every visit" not in tables("small_uav")
    assert answer.rows() == answer.to_dict()["worth"]
