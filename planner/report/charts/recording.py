"""Charts of a raw recording: its signals over time with the rests, and the Allan deviation of one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from planner.nouns.array import Array
from planner.recordings.allan import AllanResult
from planner.recordings.look import Looked
from planner.report.charts.theme import BLUE, GREEN, PALE, RED, Room, fixed_panels, readable_log
from planner.units import from_si, unit_factor

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POINTS = 1200  # of a line: two a pixel
COLOURS = (BLUE, RED, GREEN)


def signals(power_on: Looked) -> Figure:
    """Gyros, accelerometers and temperature, those that there are, over time; rests are shaded."""
    windows = power_on.file.windows
    time = (windows.start + windows.end) / 2
    gyro, acc = power_on.file.recording.has
    shown: list[tuple[str, Array]] = []
    if gyro:
        shown.append(("gyros, deg/s", windows.mean[:, :3] / unit_factor("deg/s")[0]))
    if acc:
        shown.append(("accelerometers, g", windows.mean[:, 3:] / unit_factor("g")[0]))
    if np.isfinite(windows.temperature_degc).any():
        shown.append(("temperature, °C", windows.temperature_degc[:, None]))
    figure, lines = fixed_panels([1.7] * len(shown), room=Room(below=0.1), foot=0.4, share="x")
    panels = [axes for [axes] in lines]
    for axes, (label, values) in zip(panels, shown, strict=True):
        _lines(axes, time, values)
        axes.set_ylabel(label)
        for rest in power_on.rests:
            axes.axvspan(rest.row.start, rest.row.end, color=PALE, alpha=0.5, linewidth=0)
    panels[0].legend(loc="upper right", ncols=3)
    panels[-1].set_xlabel("time, s; rests are shaded")
    return figure


def _lines(axes: Axes, time: Array, values: Array) -> None:
    """Each column as least and largest of stretches, so that no peak is lost in thinning."""
    step = max(1, len(time) // POINTS)
    rows = len(time) // step
    names = "xyz" if values.shape[1] == 3 else ("",)
    for i, name in enumerate(names):
        cut = values[: rows * step, i].reshape(rows, step)
        at = time[: rows * step].reshape(rows, step).mean(axis=1)
        known = np.isfinite(cut).any(axis=1)
        low, high = (f(cut[known], axis=1) for f in (np.nanmin, np.nanmax))
        axes.plot(at[known], (low + high) / 2, color=COLOURS[i], linewidth=0.9, label=name or None)
        if step > 1:
            axes.fill_between(at[known], low, high, color=COLOURS[i], alpha=0.35, linewidth=0)


def allan_chart(results: Sequence[AllanResult]) -> Figure:
    """Allan deviation over the averaging time, gyros and accelerometers beside each other."""
    kinds = [kind for kind in ("gyro", "acc") if any(r.channel.startswith(kind) for r in results)]
    figure, [panels] = fixed_panels([2.4], len(kinds))
    for axes, kind in zip(panels, kinds, strict=True):
        unit = "deg/s" if kind == "gyro" else "g"
        scale = from_si(1.0, unit)
        for result in results:
            if result.channel.startswith(kind):
                colour = COLOURS["xyz".index(result.channel[-1])]
                axes.loglog(result.tau, result.deviation * scale, color=colour, label=result.channel)
                axes.fill_between(
                    result.tau, result.low * scale, result.high * scale, color=colour, alpha=0.2, linewidth=0
                )
        for axis in (axes.xaxis, axes.yaxis):
            readable_log(axis)
        axes.set_xlabel("averaging time, s")
        axes.set_ylabel(f"Allan deviation, {unit}")
        axes.legend(loc="best")
    return figure
