"""Pictures of units after their campaign: batches in the allowed region, drift in store, loads over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.fleet.acceptance import UnitAcceptance, counts
from planner.fleet.dates import FleetForecast
from planner.fleet.drift import ChannelForecast
from planner.nouns.array import Array
from planner.report.blocks import Picture
from planner.report.charts import theme
from planner.report.numbers import display_unit
from planner.units import unit_factor

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

VERDICTS = {"accepted": (theme.GREEN, "o"), "rejected": (theme.RED, "X"), "undecided": (theme.ORANGE, "s")}
NAMED = 40  # units whose names fit beside the axis
_SHOWN = 3.0  # times the limit: what lies beyond is drawn at the edge
_ACROSS = 3
_NAMES = 6  # side by side in a legend


# ---------------------------------------------------------------- a batch


def batch_picture(units: Sequence[UnitAcceptance]) -> Picture:
    """A dot and its interval per unit, in the order given."""
    found = ", ".join(f"{n} {verdict}" for verdict, n in counts(units).items())
    caption = "Share of the limit that each unit uses, the fullest first; whiskers: where it surely lies."
    return Picture("loads", f"Share of the limit of every unit: {found}", caption, lambda: _batch(units))


def region_picture(units: Sequence[UnitAcceptance], adds: bool) -> Picture:
    """Units by the shares of gyros and accelerometers; adds: shares add, else their squares do."""
    edge = "a straight line: the parts add" if adds else "a circle: the squares of the parts add"
    caption = (
        "Every unit by what its gyros and its accelerometers take of the limit, each through all of its "
        f"errors. Inside the edge a unit keeps the requirement that binds it; the edge is {edge}."
    )
    alt = "Allowed region folded into the shares of gyros and accelerometers, with every unit in it"
    return Picture("folded", alt, caption, lambda: _region(units, adds))


def _batch(units: Sequence[UnitAcceptance]) -> Figure:
    named = len(units) <= NAMED
    room = theme.Room(left=max(0.75, theme.letters(u.unit for u in units if named)))
    figure, [[axes]] = theme.fixed_panels([0.2 + 0.19 * min(max(len(units), 6), NAMED)], room=room, head=0.3)
    place = np.arange(len(units))
    for verdict, (colour, marker) in VERDICTS.items():
        own = [i for i, u in enumerate(units) if u.verdict == verdict]
        if not own:
            continue
        sizes = np.array([(units[i].low, units[i].load, units[i].high) for i in own])
        low, load, high = 100 * np.minimum(sizes, _SHOWN).T
        axes.hlines(place[own], low, high, color=colour, linewidth=1.6 if named else 0.5)
        axes.plot(load, place[own], marker, color=colour, markersize=5.0 if named else 2.0, label=verdict)
    axes.axvline(100.0, color=theme.INK, linewidth=1.2)
    axes.invert_yaxis()
    axes.set_xlabel("share of the limit, %")
    axes.set_xlim(left=0.0)
    if named:
        axes.set_yticks(place, [u.unit for u in units])
    else:
        axes.set_ylabel("units, the fullest first")
    axes.grid(axis="y", visible=False)
    theme.shared_legend(figure, [axes], 3)
    return figure


def _region(units: Sequence[UnitAcceptance], adds: bool) -> Figure:
    figure, [[axes]] = theme.fixed_panels([3.5], head=0.3)
    free = max(1.0 - float(np.median([u.sensors[2] for u in units])), 0.0)
    top = 200 * (max(free, 0.1) if adds else np.sqrt(max(free, 0.1)))  # what lies further is at the edge
    _edge(axes, free, adds)
    for verdict, (colour, marker) in VERDICTS.items():
        own = [u for u in units if u.verdict == verdict]
        shares = np.array([u.sensors[:2] for u in own]).reshape(-1, 2)
        shares = np.minimum(100 * (shares if adds else np.sqrt(shares)), top)
        if own:
            axes.plot(*shares.T, marker, color=colour, markersize=5, label=verdict, alpha=0.8)
        named = verdict != "accepted" and len(own) <= NAMED  # the accepted ones lie on each other
        for u, at in zip(own if named else (), shares, strict=False):
            axes.annotate(u.unit, at, (4, 3), textcoords="offset points", fontsize=8.5)
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("gyros, % of the limit")
    axes.set_ylabel("accelerometers, % of the limit")
    theme.shared_legend(figure, [axes], 4)
    return figure


def _edge(axes: Axes, free: float, adds: bool) -> None:
    angle = np.linspace(0.0, np.pi / 2, 2 if adds else 61)
    x, y = (100 * (free if adds else np.sqrt(free)) * f(angle) for f in (np.cos, np.sin))
    axes.fill([0.0, *x], [0.0, *y], facecolor=theme.BLUE, alpha=0.14, linewidth=0)
    axes.plot(x, y, color=theme.BLUE, linewidth=1.6, label="edge: what flights add is taken off")


# ---------------------------------------------------------------- drift


def drift_picture(
    unit: str, channels: Sequence[ChannelForecast], fleet: FleetForecast, caption: str
) -> Picture:
    """A panel per channel of one unit: measured values, forecast, band."""
    safe = "".join(ch if ch.isalnum() else "-" for ch in unit)
    alt = f"Measured values and forecast of {len(channels)} channels of {unit}"
    return Picture(f"channels-{safe}", alt, caption, lambda: _drift(channels, fleet))


def _drift(channels: Sequence[ChannelForecast], fleet: FleetForecast) -> Figure:
    room = theme.Room(above=0.3, below=0.4)
    figure, panels = theme.grid_of_panels(len(channels), _ACROSS, 1.3, room)
    for axes, c in zip(panels, channels, strict=True):
        _channel(axes, c, fleet)
    return figure


def _channel(axes: Axes, c: ChannelForecast, fleet: FleetForecast) -> None:
    s, start = c.series, fleet.history.start
    shown = display_unit(s.display)
    scale = unit_factor(shown)[0]
    days = _when(s.day, start)
    if np.isfinite(s.sigma).all():
        axes.errorbar(days, s.value / scale, s.sigma / scale, fmt="none", ecolor=theme.GREY, linewidth=0.8)
    axes.plot(days, s.value / scale, "o", color=theme.INK, markersize=2.8)
    if c.forecast is not None:
        later, mean = _when(s.day[-1] + c.ahead, start), c.forecast.mean / scale
        half = c.forecast.half_width(fleet.confidence) / scale
        axes.fill_between(later, mean - half, mean + half, color=theme.BLUE, alpha=0.18, linewidth=0)
        axes.plot(later, mean, color=theme.BLUE, linewidth=1.4)
    axes.axhline(c.correction / scale, color=theme.MUTED, linewidth=0.8, linestyle="--")
    axes.set_title(f"{s.error} {s.term}: {c.method.replace('_', ' ')}", fontsize=8.5)
    axes.set_ylabel(shown)
    _time_axis(axes, start)


# ---------------------------------------------------------------- loads over time


@dataclass(frozen=True)
class Load:
    """A unit's share of the limit over days: the line, what it is compared with (dotted), marks on it."""

    name: str
    days: Array
    line: Array
    dotted: Array
    marks: tuple[tuple[float, float], ...] = ()


def loads_picture(
    name: str, alt: str, caption: str, loads: Sequence[Load], start: date | None, top: float
) -> Picture:
    """Loads of the units over time; top: shares of the limit above which nothing is told."""
    return Picture(name, alt, caption, lambda: _loads(loads, start, top))


def _loads(loads: Sequence[Load], start: date | None, top: float) -> Figure:
    figure, [[axes]] = theme.fixed_panels([2.7], head=theme.lines(len(loads), _NAMES))
    for i, load in enumerate(loads):
        colour, style = theme.SERIES[i % 8], ("-", "--")[i // 8 % 2]
        days = _when(load.days, start)
        axes.plot(days, 100 * np.minimum(load.dotted, top), ":", color=colour, linewidth=1.2)
        axes.plot(days, 100 * np.minimum(load.line, top), style, color=colour, linewidth=1.6, label=load.name)
        at, height = np.array(load.marks).reshape(-1, 2).T
        axes.plot(_when(at, start), 100 * np.minimum(height, top), "o", color=colour, markersize=5)
    every = 100 * np.concatenate([curve for load in loads for curve in (load.line, load.dotted)])
    axes.axhline(100.0, color=theme.INK, linewidth=1.2)
    axes.set_ylabel("share of the limit, %")
    axes.set_ylim(max(0.0, every.min() - 10.0), min(100 * top, 1.08 * max(100.0, every.max())))
    _time_axis(axes, start)
    if start is None:
        axes.set_xlabel("day")
    theme.shared_legend(figure, [axes], _NAMES)
    return figure


def _when(days: Array, start: date | None) -> Any:
    """Days, or the dates that belong to them."""
    if start is None:
        return days
    return np.datetime64(start) + np.round(24 * days).astype("timedelta64[h]")


def _time_axis(axes: Axes, start: date | None) -> None:
    """Few ticks across, dates where day 0 has one."""
    if start is None:
        axes.locator_params(axis="x", nbins=5)
        return
    from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

    locator = AutoDateLocator(minticks=3, maxticks=6)  # type: ignore[no-untyped-call]  # matplotlib.dates has no types
    locator.intervald[1] = [1, 2, 3, 4, 6, 12]  # months: two years fit into six ticks
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]  # matplotlib.dates has no types
