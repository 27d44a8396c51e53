"""The chart of `planner compare`: bars add up to the hours of the benches, shares are promised over limit."""

from __future__ import annotations

from typing import Any

import pytest

from planner.report.charts.comparison import comparison_picture
from planner.report.comparison import Comparison, compare
from planner.report.page import html
from planner.report.subjects.compare import comparison_report
from tests.shipped_plans import shipped_document

NAMES = ("published_one_bench", "published_two_benches", "published_optimum")


@pytest.fixture(scope="module")
def found() -> Comparison:
    return compare([shipped_document(name) for name in NAMES])


def bars(axes: Any) -> list[tuple[float, float]]:
    """(end, width) of every bar."""
    return [(bar.get_x() + bar.get_width(), bar.get_width()) for bar in axes.patches]


def test_bars_end_where_the_work_of_all_benches_does_and_lines_where_the_campaign_does(
    found: Comparison,
) -> None:
    hours, promises = comparison_picture(found).draw().axes
    work = [
        sum(step["end_s"] - step["start_s"] for step in shipped_document(name)["steps"]) for name in NAMES
    ]
    for number, seconds in enumerate(work):
        own = [bar for bar in hours.patches if round(bar.get_y() + bar.get_height() / 2) == number]
        assert max(bar.get_x() + bar.get_width() for bar in own) == pytest.approx(seconds / 3600)
    ends = [segment[0][0] for segment in hours.collections[0].get_segments()]
    assert ends == pytest.approx([time / 3.6e9 for time in found.time_us])
    (asked,) = found.requirements
    assert [width for _, width in bars(promises)] == pytest.approx(
        [100 * a / limit for a, limit in zip(asked.achieved, asked.limit, strict=True)]
    )


def test_the_page_has_it_with_what_it_shows_in_words(found: Comparison) -> None:
    page = html(comparison_report(found))
    assert "At a glance" in page
    assert "published plan, one bench 185.67 h and" in page
