"""Pictures of a flight's error over its time: by sensor error, by axis, and of several flights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.plan.error_over_flight import ErrorOverFlight
from planner.report.blocks import Picture
from planner.report.charts import theme
from planner.report.numbers import quantity
from planner.units import from_si

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_CURVES = 7  # of sensor errors; a figure with more is a thicket
_SEEN = 0.01  # of the total: what always is less lies on the axis
_STYLES = ("-", "--", ":", "-.")
_COLOURS = tuple(c for c in theme.SERIES if c != theme.RED)  # which is the limit's


def over_flight_picture(
    found: ErrorOverFlight, name: str, caption: str, limit: float | None = None
) -> Picture | None:
    """By sensor error and by axis, the total in both; limit: SI, a line. None without an error."""
    if len(found.time_s) < 3 or not found.total[-1] > 0:
        return None
    largest = sorted(found.by_error, key=lambda e: -found.by_error[e][-1])
    axis = max(found.by_axis, key=lambda a: found.by_axis[a][-1])
    alt = (
        f"{found.error.replace('_', ' ')} error over {found.time_s[-1]:g} s of flight: "
        f"{quantity(float(found.total[-1]), found.unit)} at the end; most from {largest[0]}, axis {axis}"
    )
    seen = [e for e in largest if found.by_error[e].max() > _SEEN * found.total.max()][:_MOST_CURVES]
    if len(seen) < len(largest):
        caption = (
            f"{caption} By sensor error: the largest{'' if len(seen) == _MOST_CURVES else ', above 1 %'}."
        )
    return Picture(name, alt, caption, lambda: _draw(found, seen, limit))


def flights_picture(flights: Mapping[str, ErrorOverFlight], caption: str) -> Picture | None:
    """Total of several flights over the time that all of them last, one curve a flight, logarithmic."""
    if len(flights) < 2:
        return None
    said = ", ".join(f"{n} {quantity(float(f.total[-1]), f.unit)}" for n, f in flights.items())
    first = next(iter(flights.values()))
    alt = f"{first.error.replace('_', ' ')} error over the time of flight: {said}"
    return Picture("flights", alt, caption, lambda: _draw_flights(flights))


def _draw(found: ErrorOverFlight, errors: Sequence[str], limit: float | None) -> Figure:
    figure, [panels] = theme.fixed_panels([2.45], 2, theme.Room(above=0.3, between=0.1), share="y")
    for axes, title, curves in (
        (panels[0], "by sensor error", {e: found.by_error[e] for e in errors}),
        (panels[1], "by axis of the unit", found.by_axis),
    ):
        _curves(axes, found, curves)
        if limit is not None:
            axes.axhline(
                from_si(limit, found.unit), color=theme.RED, linestyle="--", linewidth=1.2, label="limit"
            )
        axes.set_title(title)
        axes.set_xlabel("time of flight, s")
        axes.legend(loc="best", **theme.FRAMED)  # a limit far above the curves crosses the upper left corner
    panels[0].set_ylabel(f"{found.error.replace('_', ' ')} error, {found.unit}")
    return figure


def _curves(axes: Axes, found: ErrorOverFlight, curves: Mapping[str, Array]) -> None:
    keep = thinned(len(found.time_s))
    for k, (name, values) in enumerate(curves.items()):
        shown = from_si(1.0, found.unit) * values[keep]
        style, colour = _STYLES[k // len(_COLOURS) % len(_STYLES)], _COLOURS[k % len(_COLOURS)]
        axes.plot(found.time_s[keep], shown, style, color=colour, linewidth=1.4, label=name)
    total = from_si(1.0, found.unit) * found.total[keep]
    axes.plot(found.time_s[keep], total, color=theme.INK, linewidth=1.8, label="all")


def _draw_flights(flights: Mapping[str, ErrorOverFlight]) -> Figure:
    figure, [[axes]] = theme.fixed_panels([2.4])
    for k, (name, found) in enumerate(flights.items()):
        keep = thinned(len(found.time_s))
        shown = from_si(1.0, found.unit) * found.total[keep]
        axes.plot(
            found.time_s[keep],
            np.where(shown > 0, shown, np.nan),
            color=theme.SERIES[k % 8],
            linewidth=1.5,
            label=name,
        )
    first = next(iter(flights.values()))
    axes.set_yscale("log")
    theme.plain_decades(axes.yaxis)
    axes.set_xlabel("time of flight, s")
    axes.set_ylabel(f"{first.error.replace('_', ' ')} error, {first.unit}")
    axes.legend(loc="lower right")
    return figure


def thinned(count: int) -> NDArray[np.int64]:
    """Indices of at most 300 instants, the last one among them: as many as the figure has points across."""
    return np.unique(np.linspace(0, count - 1, min(count, 300)).astype(int))
