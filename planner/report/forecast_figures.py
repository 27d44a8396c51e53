"""Pictures of drift: every channel with its band, and the load of every unit over time."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.fleet.drift import ChannelForecast, FleetForecast, UnitDate
from planner.records import Array
from planner.report import theme
from planner.report.readable import readable_unit
from planner.units import unit_factor

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ACROSS = 3
_TOP = 2.0  # times the limit: further up nothing is told


def channels_figure(unit: str, channels: Sequence[ChannelForecast], fleet: FleetForecast) -> str:
    """A panel per channel of one unit."""
    text = f"Measured values and forecast of {len(channels)} channels of {unit}"
    safe = "".join(ch if ch.isalnum() else "-" for ch in unit)
    return theme.drawn(f"channels-{safe}", text, lambda: _draw_channels(channels, fleet))


def loads_figure(units: Sequence[UnitDate], fleet: FleetForecast) -> str:
    """Median and upper level of the share of the limit over time."""
    text = f"Share of the limit over time of {len(units)} units"
    return theme.drawn("load-over-time", text, lambda: _draw_loads(units, fleet))


def _draw_channels(channels: Sequence[ChannelForecast], fleet: FleetForecast) -> Figure:
    across = min(_ACROSS, len(channels))
    rows = -(-len(channels) // across)
    figure = theme.new_figure(1.9 * rows + 0.3)
    panels = figure.subplots(rows, across, squeeze=False).ravel()
    for axes, c in zip(panels, channels, strict=False):
        _channel(axes, c, fleet)
    for axes in panels[len(channels) :]:
        axes.set_visible(False)
    return figure


def _channel(axes: Axes, c: ChannelForecast, fleet: FleetForecast) -> None:
    s, start = c.series, fleet.history.start
    shown = readable_unit(s.display, float(np.abs(s.value).max()))
    shown = "%" if shown in ("", "1") else shown
    scale = unit_factor(shown)[0]
    days = when(s.day, start)
    if np.isfinite(s.sigma).all():
        axes.errorbar(days, s.value / scale, s.sigma / scale, fmt="none", ecolor=theme.GREY, linewidth=0.8)
    axes.plot(days, s.value / scale, "o", color=theme.INK, markersize=2.8)
    if c.forecast is not None:
        later = when(s.day[-1] + c.ahead, start)
        half = c.forecast.half_width(fleet.confidence)
        low, high = (c.forecast.mean - half) / scale, (c.forecast.mean + half) / scale
        axes.fill_between(later, low, high, color=theme.BLUE, alpha=0.18, linewidth=0)
        axes.plot(later, c.forecast.mean / scale, color=theme.BLUE, linewidth=1.4)
    axes.axhline(c.correction / scale, color=theme.MUTED, linewidth=0.8, linestyle="--")
    axes.set_title(f"{s.error} {s.term}: {c.method.replace('_', ' ')}", fontsize=8.5)
    axes.set_ylabel(shown)
    time_axis(axes, start)


def _draw_loads(units: Sequence[UnitDate], fleet: FleetForecast) -> Figure:
    figure = theme.new_figure(3.8)
    axes = figure.subplots()
    start = fleet.history.start
    for i, u in enumerate(units):
        colour, style = theme.SERIES[i % 8], ("-", "--")[i // 8 % 2]
        days = when(u.days, start)
        axes.plot(
            days, np.minimum(100 * u.upper, 100 * _TOP), style, color=colour, linewidth=1.6, label=u.unit
        )
        axes.plot(days, np.minimum(100 * u.middle, 100 * _TOP), ":", color=colour, linewidth=1.2)
        if u.day is not None:
            at = int(np.abs(u.days - u.day).argmin())
            axes.plot([days[at]], [min(100 * u.upper[at], 100 * _TOP)], "o", color=colour, markersize=6)
    axes.axhline(100.0, color=theme.INK, linewidth=1.2)
    axes.set_ylabel("share of the limit, %")
    lowest = min(100 * float(u.middle.min()) for u in units)
    axes.set_ylim(
        max(0.0, lowest - 10.0),
        min(100 * _TOP, 1.08 * max(100.0, *(100 * float(u.upper.max()) for u in units))),
    )
    time_axis(axes, start)
    if start is None:
        axes.set_xlabel("day")
    figure.legend(loc="outside upper left", ncols=6)
    return figure


def when(days: Array, start: date | None) -> Any:
    """Days, or the dates that belong to them."""
    if start is None:
        return days
    return np.array([np.datetime64(start) + np.timedelta64(round(24 * d), "h") for d in days])


def time_axis(axes: Axes, start: date | None) -> None:
    """Few ticks across, dates where day 0 has one."""
    if start is None:
        axes.locator_params(axis="x", nbins=5)
        return
    from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

    locator = AutoDateLocator(minticks=3, maxticks=6)  # type: ignore[no-untyped-call]  # matplotlib.dates has no types
    locator.intervald[1] = [1, 2, 3, 4, 6, 12]  # months: two years fit into six ticks
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]  # matplotlib.dates has no types
