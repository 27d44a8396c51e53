"""Before and after of a calibration, channel by channel: the residual on runs that the fit has not seen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from planner.nouns.calibration import Calibration, Residual
from planner.report.charts import theme
from planner.report.subjects.calibration import UNITS
from planner.units import from_si

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def before_after_svg(calibration: Calibration) -> str:
    """One panel a sensor with two bars a channel, logarithmic. Same calibration, same bytes."""
    words = "; ".join(
        f"{s.sensor} {r.channel} {from_si(r.before, UNITS[s.sensor]):.3g} to "
        f"{from_si(r.after, UNITS[s.sensor]):.3g} {UNITS[s.sensor]}"
        for s in calibration.sensors
        for r in s.residuals
    )
    alt = f"Residual before and after calibration: {words}"
    return theme.drawn("before-after", alt, lambda: _draw(calibration)) + "\n"


def _draw(calibration: Calibration) -> Figure:
    room = theme.Room(
        left=theme.letters(r.channel for s in calibration.sensors for r in s.residuals), above=0.3
    )
    figure, panels = theme.grid_of_panels(len(calibration.sensors), 1, 1.0, room)
    for axes, sensor in zip(panels, calibration.sensors, strict=True):
        _bars(axes, sensor.residuals, UNITS[sensor.sensor])
        axes.set_title(f"{calibration.unit}, {sensor.sensor}", loc="left")
    return figure


def _bars(axes: Axes, residuals: Sequence[Residual], unit: str) -> None:
    held_out = all(r.held_out for r in residuals)
    for k, r in enumerate(residuals):
        for offset, value, colour in ((-0.2, r.before, theme.RED), (0.2, r.after, theme.BLUE)):
            shown = from_si(value, unit)
            axes.barh(k + offset, shown, 0.36, color=colour)
            axes.annotate(
                f"{shown:.3g}",
                (shown, k + offset),
                (3, 0),
                textcoords="offset points",
                va="center",
                fontsize=8.5,
            )
    axes.set_yticks(range(len(residuals)), [r.channel for r in residuals])
    axes.invert_yaxis()
    if all(min(r.before, r.after) > 0 for r in residuals):
        axes.set_xscale("log")
    axes.margins(x=0.12)
    if axes.get_xscale() == "log":
        theme.readable_log(axes.xaxis)
    where = "on runs held out" if held_out else "of the rows that were fitted"
    axes.set_xlabel(f"residual RMS, {unit}: before (red), after (blue) {where}")
