"""Pictures of a batch: the loads with their intervals, and the units in the folded allowed region."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.acceptance import UnitAcceptance, counts
from planner.report import theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {"accepted": theme.GREEN, "rejected": theme.RED, "undecided": theme.ORANGE}
MARKERS = {"accepted": "o", "rejected": "X", "undecided": "s"}
NAMED = 40  # units whose names fit beside the axis
_SHOWN = 3.0  # times the limit: what lies beyond is drawn at the edge


def loads_figure(units: Sequence[UnitAcceptance]) -> str:
    """A dot and its interval per unit, in the order given."""
    found = ", ".join(f"{n} {verdict}" for verdict, n in counts(units).items())
    return theme.drawn("loads", f"Share of the limit of every unit: {found}", lambda: _draw_loads(units))


def region_figure(units: Sequence[UnitAcceptance], adds: bool) -> str:
    """Units by the shares of gyros and accelerometers; adds: shares add, else their squares do."""
    text = "Allowed region folded into the shares of gyros and accelerometers, with every unit in it"
    return theme.drawn("folded", text, lambda: _draw_region(units, adds))


def _draw_loads(units: Sequence[UnitAcceptance]) -> Figure:
    figure = theme.new_figure(1.0 + 0.19 * min(max(len(units), 6), NAMED))
    axes = figure.subplots()
    place = np.arange(len(units))
    for verdict, colour in COLOURS.items():
        own = [i for i, u in enumerate(units) if u.verdict == verdict]
        if not own:
            continue
        low, load, high = (
            np.array([min(100 * getattr(units[i], name), 100 * _SHOWN) for i in own])
            for name in ("low", "load", "high")
        )
        axes.hlines(place[own], low, high, color=colour, linewidth=1.6 if len(units) <= NAMED else 0.5)
        size = 5.0 if len(units) <= NAMED else 2.0
        axes.plot(load, place[own], MARKERS[verdict], color=colour, markersize=size, label=verdict)
    axes.axvline(100.0, color=theme.INK, linewidth=1.2)
    axes.invert_yaxis()
    axes.set_xlabel("share of the limit, %")
    axes.set_xlim(left=0.0)
    if len(units) <= NAMED:
        axes.set_yticks(place, [u.unit for u in units])
    else:
        axes.set_ylabel("units, the fullest first")
    axes.grid(axis="y", visible=False)
    figure.legend(loc="outside upper left", ncols=3)
    return figure


def _draw_region(units: Sequence[UnitAcceptance], adds: bool) -> Figure:
    figure = theme.new_figure(4.4)
    axes = figure.subplots()
    reserve = float(np.median([u.sensors[2] for u in units]))
    free = max(1.0 - reserve, 0.1)
    top = 200 * (free if adds else np.sqrt(free))  # what lies further out is drawn at the edge
    _edge(axes, reserve, adds)
    for verdict, colour in COLOURS.items():
        own = [u for u in units if u.verdict == verdict]
        if own:
            shares = np.array([u.sensors[:2] for u in own])
            shares = np.minimum(100 * (shares if adds else np.sqrt(shares)), top)
            axes.plot(*shares.T, MARKERS[verdict], color=colour, markersize=5, label=verdict, alpha=0.8)
            for u, (x, y) in zip(own, shares, strict=True):
                if len(units) <= NAMED:
                    axes.annotate(u.unit, (x, y), (4, 3), textcoords="offset points", fontsize=7.5)
    axes.set_xlim(0.0, None)
    axes.set_ylim(0.0, 1.05 * top)
    axes.set_xlabel("gyros, % of the limit")
    axes.set_ylabel("accelerometers, % of the limit")
    figure.legend(loc="outside upper left", ncols=4)
    return figure


def _edge(axes: Axes, reserve: float, adds: bool) -> None:
    free = max(1.0 - reserve, 0.0)
    angle = np.linspace(0.0, np.pi / 2, 61)
    if adds:
        x, y = np.array([0.0, 100 * free]), np.array([100 * free, 0.0])
    else:
        x, y = (100 * np.sqrt(free) * f(angle) for f in (np.cos, np.sin))
    corner = np.concatenate([[0.0], x, [0.0]]), np.concatenate([[0.0], y, [0.0]])
    axes.fill(*corner, facecolor=theme.BLUE, alpha=0.14, linewidth=0)
    axes.plot(x, y, color=theme.BLUE, linewidth=1.6, label="edge: what flights add is taken off")
