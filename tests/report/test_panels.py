"""Panels written straight as SVG: every dot where its values say, nothing beyond the edges, readable axes."""

from __future__ import annotations

import re
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.report.charts.panels import Axes, Band, Bars, Dots, Line, Mark, Scale, Sheet, around


def sheet(marks: list[Mark], x: Scale, y: Scale) -> Sheet:
    return Sheet([[Axes(x, y, marks, "x & y", "y", "a title")]], 1, 120.0, titled=True)


def dots(svg: str) -> list[tuple[float, float]]:
    """Centres of all dots of a sheet."""
    return [(float(x), float(y)) for x, y in re.findall(r"M([-\d.]+) ([-\d.]+)h0", svg)]


def test_dots_are_where_their_values_say_and_none_is_beyond_the_edges() -> None:
    x, y = np.array([0.0, 5.0, 10.0, 5.0, np.nan]), np.array([-1.0, 0.0, 1.0, 9.0, 0.0])
    made = sheet([Dots(x, y, "#000", 1.0)], Scale(0.0, 10.0), Scale(-1.0, 1.0))
    (panel,) = made.panels()
    corners = [
        (panel.left, panel.bottom),
        ((panel.left + panel.right) / 2, (panel.top + panel.bottom) / 2),
        (panel.right, panel.top),
    ]
    np.testing.assert_allclose(dots(made.svg("d", "dots")), corners, atol=0.06)


def test_a_sheet_is_well_formed_and_explains_each_label_once() -> None:
    n = np.arange(4.0)
    marks: list[Mark] = [
        Band(-1.0, 1.0, "#ccc", 0.5, label="band"),
        Line(n, n, "#111", label="a < b"),
        Line(n, n, "#111", label="a < b"),
        Dots(n, n, "#222", 1.0, label="dots"),
        Bars(n, n - 1.0, n + 99.0, "#333"),
    ]
    made = sheet(marks, around(n), Scale(-2.0, 5.0))
    tree = ElementTree.fromstring(made.svg("s", "an & alt"))
    texts = [t.text for t in tree.iter("{http://www.w3.org/2000/svg}text")]
    assert [texts.count(label) for label in ("band", "a < b", "dots", "x & y", "a title")] == [1] * 5
    (panel,) = made.panels()
    tops = [float(t) for t in re.findall(r"V([-\d.]+)", made.svg("s", ""))]
    assert min(tops) >= panel.top - 0.06  # a bar of 99 ends at the edge


@given(
    st.floats(-1e6, 1e6),
    st.floats(1e-6, 1e6),
    st.sampled_from([None, 1e-3, 1.0, 40.0]),
    st.sampled_from([0.4, 1.0]),
)
def test_scales_rise_and_ticks_lie_on_them(
    low: float, wide: float, linear: float | None, share: float
) -> None:
    scale = Scale(low, low + wide, linear, share)
    at = scale.at(np.linspace(low, low + wide, 41))
    assert (np.diff(at) >= -1e-9).all()
    assert at[0] == pytest.approx(0.0, abs=1e-9)
    values = [v for v, _ in scale.ticks()]
    assert all(low - 1e-6 * wide <= v <= low + wide * (1.0 + 1e-6) for v in values)
    assert len(values) <= 8
    names = [name for _, name in scale.ticks()]
    if wide > 1e-9 * abs(low):
        assert all(a != b for a, b in pairwise(names))


def test_a_logarithmic_scale_has_decades_of_one_length() -> None:
    scale = Scale(1.0, 1000.0, linear=1.0, share=1e-9)
    np.testing.assert_allclose(
        scale.at(np.array([1.0, 10.0, 100.0, 1000.0])), [0, 1 / 3, 2 / 3, 1], atol=1e-6
    )
