"""Charts straight to SVG: scales go up, numbers are round and within, what is no number is left out."""

from __future__ import annotations

from xml.etree.ElementTree import fromstring

import numpy as np
import pytest

from planner.report.charts.straight import Chart, Entry, Panel, Scale, around, linear, logarithmic

MIXED = Scale(-200.0, 500.0, (-100.0, 0.0, 100.0), 5.0, 0.4)


@pytest.mark.parametrize("scale", [linear(-0.013, 0.42), linear(1e5, 1.1e5), logarithmic(3e-4, 20.0), MIXED])
def test_a_scale_goes_up_from_end_to_end_and_its_numbers_lie_within(scale: Scale) -> None:
    at = scale.at(np.linspace(scale.low, scale.high, 500))
    assert at[0] == 0.0
    assert at[-1] == 1.0
    assert (np.diff(at) > 0).all()
    assert 2 <= len(scale.ticks) <= 8
    assert all(scale.low <= t <= scale.high for t in scale.ticks)


def test_steps_between_numbers_are_round() -> None:
    assert linear(-0.013, 0.42).ticks == pytest.approx((0.0, 0.1, 0.2, 0.3, 0.4))
    assert linear(-4.0, 4.0).ticks == (-4.0, -2.0, 0.0, 2.0, 4.0)
    assert logarithmic(0.4, 30.0).ticks == (0.5, 1.0, 2.0, 5.0, 10.0, 20.0)


def test_decades_are_alike_beyond_the_linear_part() -> None:
    """From 5 to 50 as far as from 50 to 500; the linear part is 0.4 of that."""
    at = MIXED.at([0.0, 5.0, 50.0, 500.0])
    assert at[3] - at[2] == pytest.approx(at[2] - at[1])
    assert at[1] - at[0] == pytest.approx(0.4 * (at[2] - at[1]))


def test_one_value_has_room_about_it() -> None:
    low, high = around(np.array([3.0, 3.0]))
    assert low < 3.0 < high


def test_a_chart_is_well_formed_says_what_it_shows_and_leaves_out_what_is_no_number() -> None:
    panel = Panel(50.0, 20.0, 200.0, 100.0, linear(0.0, 1.0), linear(0.0, 1.0), "a < b", "across", "up")
    panel.dots([0.5, np.nan, 0.7], [0.5, 0.5, np.inf], "#000000", 2.0)
    panel.intervals(np.array([0.2]), np.array([-1e9]), np.array([0.5]), "#000000")
    svg = Chart([panel], 150.0, [Entry("dots & line", "#000000", "dots")]).svg("n", "what it < shows")
    tree = fromstring(svg)
    title = tree.find("{http://www.w3.org/2000/svg}title")
    assert title is not None
    assert title.text == "what it < shows"
    assert "nan" not in svg
    assert "inf" not in svg
    assert svg.count('h0"') == 1
    assert svg == Chart([panel], 150.0, [Entry("dots & line", "#000000", "dots")]).svg("n", "what it < shows")
