"""Pictures of a verification: flights against the limit, parts of their errors, where lines bend."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from planner.report.blocks import Picture
from planner.report.charts import theme
from planner.report.contributions import PART_NAMES
from planner.report.numbers import digits, quantity
from planner.report.subjects.verify_words import name_of
from planner.units import from_si
from planner.verify.linearity import LinearPoint
from planner.verify.outcome import RequirementOutcome
from planner.verify.residuals import PARTS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BINS = 60
MOST_ERRORS = 8
CLAIMED = 0.01  # the published claim: cross terms are about one per cent
FAR = 20.0  # limits: flights beyond stand in the last bar


def flights_picture(o: RequirementOutcome) -> Picture:
    """How many flights ended with which error, beside limit, prediction and promised percentile."""
    text = (
        f"Distribution of the {o.error.replace('_', ' ')} error over {len(o.lengths)} flights; "
        f"limit {quantity(o.limit, o.unit)}, predicted {quantity(o.achieved, o.unit)}"
    )
    caption = f"{len(o.lengths)} flights; those beyond the scale stand in the last bar."
    return Picture(f"flights-{o.index}", text, caption, lambda: _draw_flights(o))


def _draw_flights(o: RequirementOutcome) -> Figure:
    figure, [[axes]] = theme.fixed_panels([1.9], head=0.3)
    limit, achieved, at = (from_si(x, o.unit) for x in (o.limit, o.achieved, o.at_promise))
    lengths = np.where(np.isfinite(o.lengths), o.lengths, np.inf)
    shown = np.array([from_si(float(x), o.unit) if np.isfinite(x) else np.inf for x in lengths])
    end = 1.08 * max(limit, achieved, min(float(np.max(shown)), FAR * limit))
    axes.hist(np.minimum(shown, end), bins=BINS, range=(0.0, end), color=theme.SKY, label="flights")
    for value, colour, style, label in (
        (
            at,
            theme.BLUE,
            "-",
            "rms of the flights" if o.promised is None else f"{100 * o.promised:g} % of the flights",
        ),
        (achieved, theme.ORANGE, "--", "predicted by the rule"),
        (limit, theme.RED, "-", "limit"),
    ):
        if value <= end:
            axes.axvline(
                value, color=colour, linestyle=style, linewidth=1.6, label=f"{label}: {digits(value, 3)}"
            )
    axes.set_xlim(0.0, end)
    axes.set_xlabel(f"{o.error.replace('_', ' ')} error, {o.unit}")
    axes.set_ylabel("flights")
    theme.shared_legend(figure, [axes], 4)
    return figure


def parts_picture(o: RequirementOutcome) -> Picture:
    """Share of the mean square error of every part of every error."""
    names = _largest(o)
    text = f"What makes the {o.error.replace('_', ' ')} error: " + ", ".join(
        f"{name} {100 * share:.0f} %" for name, share in names[:4]
    )
    caption = f"{name_of(o)}, at the end of the time that it asks for."
    return Picture(f"parts-{o.index}", text, caption, lambda: _draw_parts(o, [name for name, _ in names]))


def _largest(o: RequirementOutcome) -> list[tuple[str, float]]:
    total: dict[str, float] = {}
    for p in o.parts:
        total[p.error] = total.get(p.error, 0.0) + p.share
    ranked = sorted(total.items(), key=lambda item: -item[1])
    return [item for item in ranked if item[1] >= 1e-3][:MOST_ERRORS] or ranked[:1]


def _draw_parts(o: RequirementOutcome, names: Sequence[str]) -> Figure:
    room = theme.Room(left=theme.letters(names))
    figure, [[axes]] = theme.fixed_panels([0.33 * max(len(names), 2)], 1, room, head=0.3)
    parts = {
        part: (
            PART_NAMES[part],
            [sum(100 * p.share for p in o.parts if p.error == name and p.part == part) for name in names],
        )
        for part in PARTS
    }
    theme.stacked_bars(axes, names, parts, lambda size: f"{digits(size, 2)} %")
    axes.set_xlabel("share of the mean square error, %")
    theme.shared_legend(figure, [axes], 5)
    return figure


def linear_picture(points: Sequence[LinearPoint]) -> Picture | None:
    """Nonlinear minus linear over the error, against the size of the errors and the length of the flight."""
    if not points:
        return None
    end = [p for p in points if p.share == 1.0]
    text = "Difference of linear combination and nonlinear flight: " + ", ".join(
        f"errors times {p.factor:g}: {100 * p.apart:.2g} %" for p in end
    )
    caption = "Root mean square over 50 units; left at the end of the flight, right as it goes on."
    return Picture("linear", text, caption, lambda: _draw_linear(points))


def _draw_linear(points: Sequence[LinearPoint]) -> Figure:
    room = theme.Room(between=0.1)
    figure, [[left, right]] = theme.fixed_panels([2.4], 2, room, beside=0.8, share="y")
    end = [p for p in points if p.share == 1.0]
    _curve(left, [p.factor for p in end], [p.apart for p in end], theme.BLUE, "at the end of the flight")
    left.set_xscale("log")
    theme.readable_log(left.xaxis)
    left.set_xlabel("errors after calibration, times")
    left.set_ylabel("nonlinear − linear, share of the error")
    for colour, factor in zip(theme.SERIES, sorted({p.factor for p in points}), strict=False):
        mine = [p for p in points if p.factor == factor]
        _curve(right, [100 * p.share for p in mine], [p.apart for p in mine], colour, f"× {factor:g}")
    right.set_xlabel("of the flight flown, %")
    for axes in (left, right):
        axes.set_yscale("log")
        theme.readable_log(axes.yaxis)
        axes.axhline(CLAIMED, color=theme.RED, linestyle="--", linewidth=1.2)
        axes.annotate(
            "1 %", (0.01, CLAIMED), (0, 3), xycoords=("axes fraction", "data"), textcoords="offset points"
        )
    right.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def _curve(axes: Axes, x: Sequence[float], y: Sequence[float], colour: str, label: str) -> None:
    axes.plot(
        x, [v if v > 0 else np.nan for v in y], "o-", color=colour, markersize=3.5, linewidth=1.4, label=label
    )
