"""The report of a plan by information: what is promised, by which family, and nothing that did not decide."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from rich.console import Console

from planner.nouns.plan import Plan
from planner.report.blocks import Report, Table, Text
from planner.report.charts.campaigns import campaigns_picture
from planner.report.console import show
from planner.report.page import html
from planner.report.subjects.plan import plan_report
from tests.report import sample
from tests.report.test_html import parsed, words


def report(plan: Plan | None = None) -> Report:
    return plan_report(
        plan or sample.informed_plan(), constraints=sample.constraints("percentile"), service_life_s=1.8e6
    )


def tables(found: Report) -> dict[str, Table]:
    """First word of the caption -> table."""
    blocks = [b for part in found.sections for b in part.blocks if isinstance(b, Table)]
    return {b.caption.split(":")[0]: b for b in blocks}


def printed(plan: Plan) -> list[str]:
    out = io.StringIO()
    show(report(plan), Console(file=out, width=100))
    return out.getvalue().splitlines()


def test_hours_then_promise_then_the_campaign_then_what_binds() -> None:
    lines = printed(sample.informed_plan())
    text = "\n".join(lines)
    order = ["29.85 h", "position: ", "What every test does", "What uses the limits:", "Among campaigns of"]
    places = [text.index(one) for one in [*order, "Allowed sensor errors"]]
    assert places == sorted(places)
    assert "at the worst temperature" in text


def test_a_gap_says_how_much_shorter_another_could_be() -> None:
    (first,) = report().sentences
    assert first.startswith("The shortest found. Not proved")
    assert "up to 20.00" in first
    assert "Proved" not in first
    (among,) = next(part for part in report().sections if part.id == "proof").blocks
    assert among == Text("Among campaigns of static and rates at 25 temperatures.")
    proved = report(replace(sample.informed_plan(), proved=True, gap=0.0))
    assert proved.sentences[0].startswith("Proved the shortest")


def test_one_repeat_has_no_half_width_and_is_not_made_by_hand() -> None:
    found = report(replace(sample.informed_plan(), reasons=()))
    assert not any("by hand" in sentence for sentence in found.sentences)
    by_hand = replace(sample.informed_plan(), objective="nothing: the plan is made by hand")
    assert "Made by hand" in report(by_hand).sentences[0]


def test_every_family_has_its_row_and_each_requirement_one_that_binds() -> None:
    table = tables(report())["What is promised under each family of temperature curves"]
    cosines, kink = table.rows
    assert cosines[0] == "cosines: a sum of cosines"
    assert cosines[1:5] == ("20", "66.7\u202f%", "18", "90.0\u202f%")
    assert (cosines[5], kink[5]) == ("horizontal", "position")
    one = replace(sample.informed_plan(), families={"kink": {0: 26.0, 1: 15.0}})
    assert "which the spec names" in words(html(report(one)))


def test_half_widths_stand_beside_and_decide_nothing() -> None:
    text = words(html(report()))
    assert "it decides nothing here" in text
    assert "Repeats use the student quantile" not in text
    assert "Cressie" in text
    assert "NSGA-II" in text
    assert "Allowed region" not in text  # its sizes are sigmas of independent errors


def test_worth_says_what_is_unobservable_and_prices_have_a_sign_where_there_is_one() -> None:
    found = tables(report())
    assert found["What every visit buys"].rows[0][4] == "unobservable"
    assert [row[1] for row in found["Prices"].rows] == ["−0.17", "0.00"]


def test_the_pareto_set_is_named_for_those_who_cannot_see_it() -> None:
    picture = campaigns_picture(sample.informed_plan())
    assert picture is not None
    assert picture.alt.startswith("8 campaigns")
    assert "4.908" in picture.alt.split("The plan: ")[1]
    page = html(report())
    parsed(page)
    assert page == html(report())


@pytest.mark.parametrize("front", [(), ({"time_s": 1.0, "power_on_s": 1.0, "0": 1e9, "1": 1.0},)])
def test_no_picture_of_what_nobody_asks_for(front: tuple[dict[str, float], ...]) -> None:
    plan = sample.informed_plan()
    assert plan.genetic is not None
    assert campaigns_picture(replace(plan, genetic=replace(plan.genetic, front=front))) is None
