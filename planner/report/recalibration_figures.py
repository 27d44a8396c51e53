"""The picture of a schedule: the share of the limit over time, with the visits and without them."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.recalibration import StorePlan
from planner.report import theme
from planner.report.forecast_figures import time_axis, when

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TOP = 150.0  # per cent of the limit


def schedule_figure(plans: Sequence[StorePlan], start: date | None) -> str:
    """Loads of the units over time with their visits."""
    visits = sum(len(p.visits) for p in plans)
    text = f"Share of the limit over time of {len(plans)} units with {visits} visits, and without them"
    return theme.drawn("schedule", text, lambda: _draw(plans, start))


def _draw(plans: Sequence[StorePlan], start: date | None) -> Figure:
    figure = theme.new_figure(3.6)
    axes = figure.subplots()
    for i, p in enumerate(plans):
        colour = theme.SERIES[i % len(theme.SERIES)]
        days = when(p.days, start)
        name = "with the visits" if p.unit == "spec" else p.unit
        axes.plot(days, np.minimum(100 * p.without, _TOP), ":", color=colour, linewidth=1.0)
        axes.plot(days, np.minimum(100 * p.load, _TOP), color=colour, linewidth=1.6, label=name)
        at = when(np.array([v.day for v in p.visits]), start)
        after = [100 * v.load_after for v in p.visits]
        axes.plot(at, after, "o", color=colour, markersize=5)
    axes.axhline(100.0, color=theme.INK, linewidth=1.2)
    axes.set_ylabel("share of the limit, %")
    lowest = min(100 * float(np.min(p.load)) for p in plans)
    axes.set_ylim(
        max(0.0, lowest - 10.0), min(_TOP, 5.0 + max(105.0, *(100 * float(p.without.max()) for p in plans)))
    )
    time_axis(axes, start)
    if start is None:
        axes.set_xlabel("day")
    figure.legend(loc="outside upper left", ncols=6)
    return figure
