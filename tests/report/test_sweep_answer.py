"""The answer of a sweep: the knee of a curve that has one, and the cheapest point of every limit."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.report.blocks import Table
from planner.report.page import html
from planner.report.subjects.sweep import sweep_report
from planner.report.subjects.sweep_answer import abscissa, cheapest_of, knee, numbers_of, unit_of


def sweep(hours: dict[float, float], more: dict[float, float] | None = None) -> dict[str, Any]:
    """A sweep of a limit, at one temperature estimator or at two."""
    both = [("lines", hours), *([("smooth", more)] if more else [])]
    points = [
        {
            "values": {"limit": f"{limit:g} m", **({"estimator": name} if more else {})},
            "status": "planned" if time > 0 else "infeasible",
            "time_s": 3600.0 * time,
            "bound_s": 0.0,
            "power_on_s": 0.0,
            "gap": 0.0,
            "requirements": [{"limit": limit, "achieved": limit, "unit": "m"}],
        }
        for name, curve in both
        for limit, time in curve.items()
    ]
    keys = ["limit", *(["estimator"] if more else [])]
    return {"spec": "spec", "keys": keys, "points": points, "wanted": len(points)}


def knee_of(hours: dict[float, float]) -> float | None:
    curve = cheapest_of(sweep(hours), "limit")
    at = knee(curve)
    return None if at is None else curve[at].x


def test_the_knee_is_where_dear_turns_cheap() -> None:
    assert knee_of({5: 20, 6: 12, 7: 8, 8: 7.5, 9: 7.2, 10: 7}) == 7
    # of y = 1/x from 1/a to a the chord is furthest away at its middle slope, x = 1
    assert knee_of({x: 1 / x for x in (0.25, 0.5, 1.0, 2.0, 4.0)}) == 1.0


@pytest.mark.parametrize(
    "hours", [{5: 9, 6: 8, 7: 7, 8: 6}, {5: 9, 6: 9, 7: 9}, {5: 9, 8: 6}, {5: 9, 6: 8.9, 7: 8, 8: 3}]
)
def test_a_straight_line_a_level_one_and_one_that_falls_late_have_none(hours: dict[float, float]) -> None:
    assert knee_of(hours) is None


@given(st.floats(0.1, 1e3), st.floats(0.1, 1e3), st.floats(0, 1e3))
def test_units_of_either_axis_do_not_move_it(wider: float, longer: float, added: float) -> None:
    hours = {1.0: 20.0, 2.0: 9.0, 3.0: 7.0, 4.0: 6.5, 5.0: 6.0}
    scaled = {x * wider: t * longer + added for x, t in hours.items()}
    found = cheapest_of(sweep(scaled), "limit")
    assert knee(found) == knee(cheapest_of(sweep(hours), "limit")) == 1


def test_values_in_several_units_stand_in_one_order() -> None:
    """500 m lies between 0.2 km and 1 km, and 1 km is the same limit as 1000 m."""
    found = sweep({1: 9.0, 2: 8.0, 3: 5.0, 4: 4.0, 5: 3.0})
    for point, text in zip(found["points"], ("1000 m", "1 km", "500 m", "0.2 km", "2 km"), strict=True):
        point["values"]["limit"] = text
    curve = cheapest_of(found, "limit")
    assert [(one.text, one.x) for one in curve] == [
        ("0.2 km", 200),
        ("500 m", 500),
        ("1 km", 1000),
        ("2 km", 2000),
    ]
    assert abscissa(found) == "limit"


@pytest.mark.parametrize(
    ("texts", "numbers", "unit"),
    [
        (("-40 degC", "20 °C", "333.15 K"), [-40.0, 20.0, 60.0], "degC"),
        (("90 %", "0.95 one", "lines"), [90.0, pytest.approx(95.0), None], "%"),
        (("1 mg", "20 deg/h", "0.002 g"), [1.0, None, 2.0], "mg"),
        ((3, 5, 12), [3.0, 5.0, 12.0], ""),
        (("lines", "smooth", "any"), [None, None, None], ""),
    ],
)
def test_numbers_are_told_in_one_unit_and_words_have_none(texts: Any, numbers: Any, unit: str) -> None:
    points = [{"values": {"key": text}} for text in texts]
    found = {"keys": ["key"], "points": points}
    assert numbers_of(found, "key") == numbers
    assert unit_of(found, "key") == unit


def test_the_page_begins_with_it_and_names_the_cheapest_of_each_limit() -> None:
    lines = {5: 20.0, 6: 12.0, 7: 8.0, 8: 7.8, 4: 0.0}
    report = sweep_report(sweep(lines, {5: 18.0, 6: 12.5, 7: 8.5, 8: 7.0}))
    assert report.answer == "The knee is at limit 7 m, 8.00 h: 6 m costs 4.00 h more, 8 m saves 1.00 h"
    assert report.sentences == ("8 of 9 points have a plan, 7.00 to 20.00 h.",)
    blocks = [b for s in report.sections for b in s.blocks if isinstance(b, Table)]
    table = next(b for b in blocks if b.caption.startswith("The cheapest"))
    assert table.rows == (
        ("5 m", "18.00", "smooth"),
        ("6 m", "12.00", "lines"),
        ("7 m", "8.00", "lines"),
        ("8 m", "7.00", "smooth"),
    )
    assert "knee" in html(report)
