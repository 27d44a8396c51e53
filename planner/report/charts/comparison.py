"""Plans side by side: what their hours go into, and what share of each limit they promise."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.nouns.array import Array
from planner.report.blocks import Picture
from planner.report.charts import theme
from planner.report.comparison import Comparison
from planner.report.numbers import hours, percent
from planner.report.plan_facts import MICROSECONDS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LONGEST_NAME = 28
_HOUR_US = 3600 * MICROSECONDS
_BAR = 0.7
_NAMES = 5  # side by side in a legend


def comparison_picture(c: Comparison) -> Picture:
    """Bars of hours by action, a mark where each campaign ends; beside them the share of each limit."""
    shares = _shares(c)
    told = [
        f"{name} {hours(time / MICROSECONDS)} h"
        + (f" and {percent(float(np.nanmax(of)))} of its limits" if np.isfinite(of).any() else "")
        for name, time, of in zip(c.plans, c.time_us, shares.T, strict=True)
    ]
    caption = (
        "Left: hours of all benches by what is done, and a line where the campaign ends; benches that work "
        "side by side add up to more. Right: what each plan promises of each limit, 100 % is all of it."
    )
    return Picture(
        "comparison", f"Hours and promises of the plans: {'; '.join(told)}", caption, lambda: _draw(c)
    )


def _shares(c: Comparison) -> Array:
    """(requirements, plans) achieved / limit; NaN where a plan does not have the requirement."""
    rows = [
        [
            np.nan if a is None or not limit else a / limit
            for a, limit in zip(r.achieved, r.limit, strict=True)
        ]
        for r in c.requirements
    ]
    return np.array(rows, dtype=float).reshape(-1, len(c.plans))


def _draw(c: Comparison) -> Figure:
    height = 0.6 + 0.42 * len(c.plans) + 0.12 * len(c.plans) * len(c.requirements)
    names = [_short(name) for name in c.plans]
    room = theme.Room(left=theme.letters(names), between=0.2)
    figure, [[left, right]] = theme.fixed_panels(
        [height], 2, room, head=theme.lines(len(c.actions) + len(c.requirements) + 2, _NAMES), share="y"
    )
    places = np.arange(float(len(c.plans)))
    _hours(left, c, places)
    _promises(right, c, places)
    left.set_yticks(places, names)
    left.invert_yaxis()  # shared: the first plan stands on top in both
    for axes in (left, right):
        axes.grid(visible=False, axis="y")
    theme.shared_legend(figure, [left, right], _NAMES)
    return figure


def _hours(axes: Axes, c: Comparison, places: Array) -> None:
    done = np.zeros(len(places))
    for spent in c.actions:
        wide = np.array(spent.time_us) / _HOUR_US
        if not wide.any():
            continue
        colour = theme.ACTION_COLOURS.get(spent.name, theme.GREY)
        label = spent.name.replace("_", " ")
        axes.barh(places, wide, _BAR, left=done, color=colour, label=label)
        done += wide
    ends = np.array(c.time_us) / _HOUR_US
    axes.vlines(
        ends, places - 0.46, places + 0.46, color=theme.INK, linewidth=1.6, label="the campaign's end"
    )
    axes.set_xlim(right=1.03 * max(float(done.max()), float(ends.max()), 1e-3))
    axes.set_xlabel("hours")


def _promises(axes: Axes, c: Comparison, places: Array) -> None:
    shares = 100 * _shares(c)
    thick = _BAR / max(len(shares), 1)
    for i, (r, row) in enumerate(zip(c.requirements, shares, strict=True)):
        at = places - _BAR / 2 + (i + 0.5) * thick
        label = f"{r.error} {r.rule.replace('_', ' ')}"
        axes.barh(at, row, 0.85 * thick, color=theme.TESTS[i % len(theme.TESTS)], label=label)
    axes.axvline(100, color=theme.INK, linestyle="--", linewidth=1.1, label="the limit")
    axes.set_xlabel("of the limit, %")


def _short(name: str) -> str:
    """A name that fits, without its middle: variants of a plan are called the same to the last words."""
    head = _LONGEST_NAME // 3
    return name if len(name) <= _LONGEST_NAME else f"{name[:head]}…{name[head + 1 - _LONGEST_NAME :]}"
