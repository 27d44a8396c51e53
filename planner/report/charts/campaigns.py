"""Hours against what is promised: the campaigns that the genetic algorithm kept, the plan, the limit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.nouns.array import Array
from planner.nouns.plan import Achieved, Plan
from planner.report.blocks import Picture
from planner.report.charts import theme
from planner.report.numbers import digits, hours, in_unit, quantity, when

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import PathCollection
    from matplotlib.figure import Figure

_FURTHEST = 4.0  # limits: campaigns beyond promise nothing that anybody asks for
_SIDE_BY_SIDE = 2


def campaigns_picture(plan: Plan) -> Picture | None:
    """One panel a requirement: figure over hours, power-on hours by colour. None without two campaigns."""
    points = _points(plan)
    if len(points) < 2 or not plan.requirements:
        return None
    first = plan.requirements[0]
    reached = [in_unit(x, first.unit) for x in (points[:, 2].max(), points[:, 2].min())]
    promised = f"{quantity(first.achieved, first.unit)} of {quantity(first.limit, first.unit)}"
    alt = (
        f"{len(points)} campaigns, none better than another in hours, in what it promises and in power-on "
        f"hours together: from {hours(points[:, 0].min())} h and {digits(reached[0], 3)} {first.unit} to "
        f"{hours(points[:, 0].max())} h and {digits(reached[1], 3)} {first.unit} of {first.error}. The plan: "
        f"{hours(plan.objective_value)} h and {promised}"
    )
    caption = (
        "Campaigns that the genetic algorithm kept (NSGA-II): none is better in hours, promise and power-on "
        "together. Colour: hours that the unit is powered. Work of one batch, without waiting."
    )
    return Picture("campaigns", alt, caption, lambda: _draw(plan, points))


def _points(plan: Plan) -> Array:
    """(n, 2 + requirements) s, powered s, figures in SI; what is far beyond a limit is left out."""
    if plan.genetic is None:
        return np.zeros((0, 2))
    keys = ["time_s", "power_on_s", *map(str, range(len(plan.requirements)))]
    rows = [[point[key] for key in keys] for point in plan.genetic.front if all(k in point for k in keys)]
    found = np.array(rows, dtype=float).reshape(-1, len(keys))
    limits = np.array([r.limit for r in plan.requirements])
    return np.asarray(found[(found[:, 2:] <= _FURTHEST * limits).all(axis=1)])


def _draw(plan: Plan, points: Array) -> Figure:
    count = len(plan.requirements)
    room = theme.Room(above=0.3)
    figure, panels = theme.grid_of_panels(count, _SIDE_BY_SIDE, 2.6, room, head=0.3, beside=theme.BAR)
    for i, axes in enumerate(panels):
        shown = _panel(axes, plan, plan.requirements[i], points[:, [0, 1, 2 + i]])
    theme.colour_bar(figure, shown, panels, "powered, h")
    theme.shared_legend(figure, panels, 3)
    return figure


def _panel(axes: Axes, plan: Plan, achieved: Achieved, points: Array) -> PathCollection:
    from matplotlib.colors import LinearSegmentedColormap

    time, powered = points[:, 0] / 3600, points[:, 1] / 3600
    reached = [in_unit(x, achieved.unit) for x in points[:, 2]]
    colours = LinearSegmentedColormap.from_list("powered", theme.SHORT_TO_LONG)
    shown = axes.scatter(time, reached, c=powered, cmap=colours, s=26, label="a campaign", zorder=2)
    limit = in_unit(achieved.limit, achieved.unit)
    axes.axhline(limit, color=theme.INK, linestyle="--", linewidth=1.1, label="the limit")
    chosen = (plan.objective_value / 3600, in_unit(achieved.achieved, achieved.unit))
    axes.plot(*chosen, "D", color=theme.RED, markersize=8, label="the plan", zorder=3)
    axes.set_title(f"{achieved.error} {when(achieved.at)}")
    axes.set_xlabel("campaign, h")
    axes.set_ylabel(f"{achieved.error.replace('_', ' ')}, {achieved.unit}")
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0.05)
    return shown
