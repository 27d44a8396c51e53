"""Pictures of a plan, one function each: records in, a picture out, None if there is nothing to draw."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.nouns.allowances import AllowedErrors, GeneticHistory
from planner.nouns.array import Array
from planner.nouns.plan import Plan, TradeOffPoint
from planner.nouns.sensitivities import Sensitivities
from planner.report.blocks import Picture
from planner.report.charts import theme
from planner.report.charts.flight_time import thinned
from planner.report.contributions import PART_NAMES, PARTS, Contribution, is_sum
from planner.report.numbers import digits, display_unit, hours, in_unit, quantity, when
from planner.report.region_of_two import AllowedRegion, four_quadrants
from planner.units import from_si, unit_factor

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_UPRIGHT = 6  # names that fit side by side
_TURNED = 35.0  # degrees, where they do not
_SIDE_BY_SIDE = 2  # panels


def budget_picture(plan: Plan, budgets: Sequence[Sequence[Contribution]]) -> Picture | None:
    """Stacked bars: what every part of every error adds to each requirement; budgets[i] of requirement i."""
    felt = [b for b in budgets if any(c.share > 0 for c in b)]
    if not felt:
        return None
    largest = ", ".join(f"{b[0].error} {100 * b[0].share:.0f} %" for b in felt)
    alt = f"Contribution of each sensor error to each requirement, split into its parts. Largest: {largest}"
    caption = "Contribution of every error, split into its parts."
    return Picture("budget", alt, caption, lambda: _draw_budget(plan, budgets))


def region_picture(plan: Plan, region: AllowedRegion, caption: str) -> Picture:
    """The allowed region of two errors in all four sign combinations, with the plan's point."""
    across, up = region.errors
    ends = [
        quantity(float(region.boundary[i, j]), _unit(plan, e)) for i, j, e in ((0, 0, across), (-1, 1, up))
    ]
    alt = (
        f"Allowed region of {across} and {up}, the other errors as planned: "
        f"up to ±{ends[0]} and ±{ends[1]}; the plan's point lies inside or on its edge"
    )
    return Picture("region", alt, caption, lambda: _draw_region(plan, region))


@dataclass(frozen=True)
class Front:
    """A Pareto set to draw: values (n, len(errors) + 1), allowances in SI, the campaign's seconds or NaN."""

    errors: tuple[str, ...]
    values: Array


def allowed_front(allowed: AllowedErrors | None) -> Front:
    """The Pareto set of the allowed errors, without hours."""
    if allowed is None:
        return _front([], ())
    return _front([dict(zip(allowed.errors, row, strict=True)) for row in allowed.front], allowed.errors)


def campaign_front(plan: Plan) -> Front:
    """The campaigns that the genetic algorithm kept, with their hours."""
    points = plan.genetic.front if plan.genetic else ()
    return _front(points, [a.error for a in plan.allowances])


def front_picture(plan: Plan, front: Front, name: str, caption: str) -> Picture | None:
    """Parallel coordinates: a line is a set of allowances, with its hours if known."""
    if len(front.values) < 2 or len(front.errors) < 2:
        return None
    time = front.values[:, -1]
    timed = bool(np.isfinite(time).all())
    span = f", {hours(time.min())} to {hours(time.max())} hours" if timed else ""
    alt = f"Pareto set: {len(front.values)} sets of allowances of {len(front.errors)} errors{span}"
    return Picture(name, alt, caption, lambda: _draw_front(plan, front.errors, front.values, timed))


def _front(points: Sequence[Mapping[str, float]], errors: Sequence[str]) -> Front:
    """The errors that vary over the points, and their values."""
    varying = [e for e in errors if len({point.get(e, math.nan) for point in points}) > 1]
    known = [e for e in varying if all(e in point for point in points)]
    rows = [[point[e] for e in known] + [point.get("time_s", math.nan)] for point in points]
    return Front(tuple(known), np.array(rows, dtype=float).reshape(-1, len(known) + 1))


@dataclass(frozen=True)
class Run:
    """One run of the genetic algorithm: its fitness in words, `scale` a unit of it, what stands beside it."""

    name: str
    fitness: str
    scale: float
    history: GeneticHistory
    exact: float | None = None
    beside: str = "exact optimum"


def convergence_picture(runs: Sequence[Run]) -> Picture | None:
    """Best and mean fitness against the generation, one panel a run of the genetic algorithm."""
    drawn = [run for run in runs if len(run.history.best) > 1]
    if not drawn:
        return None
    facts = "; ".join(
        f"{run.name}: {run.fitness} {digits(run.history.best[-1] / run.scale)} after {len(run.history.best)}"
        for run in drawn
    )
    alt = f"Convergence of the genetic algorithm. {facts}"
    caption = "Fitness of the best and of the mean individual."
    return Picture("convergence", alt, caption, lambda: _draw_runs(drawn))


def sensitivity_picture(sensitivities: Sensitivities, errors: Sequence[str]) -> Picture | None:
    """Length of the position error per unit of every term of `errors` over the flight, logarithmic."""
    shown = [e for e in errors if any(c.error == e for c in sensitivities.columns)]
    if len(sensitivities.time_s) < 3 or not shown:
        return None
    alt = f"Position error per unit of {', '.join(shown)} against the time of flight, logarithmic scale"
    caption = "Length of the position error per unit of each error, by axis or term."
    return Picture("sensitivity", alt, caption, lambda: _draw_sensitivities(sensitivities, shown))


def trade_off_picture(points: Sequence[TradeOffPoint]) -> Picture | None:
    """Power-on hours over campaign hours."""
    if len(points) < 2:
        return None
    ends = f"{hours(points[0].time_s)} h with {hours(points[0].power_on_s)} h of power-on"
    other = f"{hours(points[-1].time_s)} h with {hours(points[-1].power_on_s)} h"
    alt = f"Trade-off of campaign time and power-on time: from {ends} to {other}"
    caption = "Every point is a plan; none is better in both."
    return Picture("trade-off", alt, caption, lambda: _draw_trade_off(points))


def _draw_trade_off(points: Sequence[TradeOffPoint]) -> Figure:
    figure, [[axes]] = theme.fixed_panels([2.2])
    time, power = ([getattr(p, key) / 3600 for p in points] for key in ("time_s", "power_on_s"))
    axes.plot(time, power, "o-", color=theme.BLUE, linewidth=1.2, markersize=5)
    axes.set_xlabel("campaign, h")
    axes.set_ylabel("power-on of each unit, h")
    axes.margins(0.08)
    return figure


# ---------------------------------------------------------------- budget


def _draw_budget(plan: Plan, budgets: Sequence[Sequence[Contribution]]) -> Figure:
    felt = [[c for c in budget if c.share > 0] for budget in budgets]
    heights = [0.33 * max(len(budget), 2) for budget in felt]
    room = theme.Room(left=theme.letters([c.error for budget in felt for c in budget]), above=0.3)
    figure, panels = theme.fixed_panels(heights, 1, room, foot=0.3)
    for [axes], achieved, budget in zip(panels, plan.requirements, felt, strict=True):
        adds = is_sum(achieved)
        scale = from_si(achieved.achieved, achieved.unit) if adds else 100.0
        _bars(axes, budget, scale)
        axes.set_title(f"{achieved.error} {when(achieved.at)}, {achieved.rule.replace('_', ' ')}")
        axes.set_xlabel(f"contribution, {achieved.unit}" if adds else "share of the squared error, %")
    theme.shared_legend(figure, [axes for [axes] in panels], len(PARTS), loc="lower left")
    return figure


def _bars(axes: Axes, budget: Sequence[Contribution], scale: float) -> None:
    def total(size: float) -> str:
        return digits(size, 3) if size >= 1e-3 * scale else "≈ 0"

    parts = {part: (PART_NAMES[part], [c.parts[i] * scale for c in budget]) for i, part in enumerate(PARTS)}
    theme.stacked_bars(axes, [c.error for c in budget], parts, total)


# ---------------------------------------------------------------- region


def _unit(plan: Plan, error: str) -> str:
    return next(a.unit for a in plan.allowances if a.error == error)


def _draw_region(plan: Plan, region: AllowedRegion) -> Figure:
    units = [_unit(plan, error) for error in region.errors]
    scale = np.array([unit_factor(display_unit(unit))[0] for unit in units])
    outline = four_quadrants(region.boundary / scale)
    point = np.array(region.point) / scale
    figure, [[axes]] = theme.fixed_panels([3.7], room=theme.Room(left=1.0), head=0.3)
    axes.fill(outline[:, 0], outline[:, 1], facecolor=theme.BLUE, alpha=0.16, linewidth=0)
    axes.plot(
        outline[:, 0], outline[:, 1], color=theme.BLUE, linewidth=1.6, label="edge of the allowed region"
    )
    signs = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1)])
    corners = point * signs
    axes.plot(
        corners[:, 0], corners[:, 1], "--", color=theme.RED, linewidth=1.0, label="sizes that the plan allows"
    )
    axes.plot(corners[:4, 0], corners[:4, 1], "o", color=theme.RED, markersize=5, label="the plan")
    axes.axhline(0, color=theme.MUTED, linewidth=0.7)
    axes.axvline(0, color=theme.MUTED, linewidth=0.7)
    axes.set_xlabel(f"{region.errors[0]}, {display_unit(units[0])}")
    axes.set_ylabel(f"{region.errors[1]}, {display_unit(units[1])}")
    axes.margins(0.06)
    theme.shared_legend(figure, [axes], 3)
    return figure


# ---------------------------------------------------------------- front


def _draw_front(plan: Plan, errors: Sequence[str], front: Array, timed: bool) -> Figure:
    planned = {a.error: a.allowed for a in plan.allowances}
    chosen = np.array([planned[e] for e in errors] + [plan.time_s])
    names = [*errors, "time"] if timed else list(errors)
    values, mark = front[:, : len(names)], chosen[: len(names)]
    low = np.minimum(values.min(axis=0), mark)
    high = np.maximum(values.max(axis=0), mark)
    span = np.where(high > low, high - low, 1.0)
    units = ["h" if name == "time" else _unit(plan, name) for name in names]
    labels = [f"{n}, {display_unit(u)}" for n, u in zip(names, units, strict=True)]
    room = theme.Room(left=0.15, below=0.6)
    if len(names) > _UPRIGHT:
        long, turn = theme.letters(labels), math.radians(_TURNED)
        room = theme.Room(left=long * math.cos(turn), below=long * math.sin(turn) + 0.3)
    beside = theme.BAR if timed else 0.0
    figure, [[axes]] = theme.fixed_panels([2.8], 1, room, head=0.3, beside=beside)
    _lines(figure, axes, (values - low) / span, front[:, -1] / 3600 if timed else None)
    axes.plot(range(len(names)), (mark - low) / span, "o-", color=theme.RED, linewidth=2.0, label="this plan")
    _coordinates(axes, labels, units, low, low + span)
    theme.shared_legend(figure, [axes], 1)
    return figure


def _lines(figure: Figure, axes: Axes, scaled: Array, time_h: Array | None) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.colors import LinearSegmentedColormap

    segments = [np.stack([np.arange(len(row)), row], axis=1) for row in scaled]
    timed = time_h is not None and np.ptp(time_h) > 0
    lines = LineCollection(segments, linewidths=0.9, alpha=0.75, colors=None if timed else theme.SKY)
    if timed:
        lines.set_cmap(LinearSegmentedColormap.from_list("hours", theme.SHORT_TO_LONG))
        lines.set_array(time_h)
        theme.colour_bar(figure, lines, [axes], "campaign, h")
    axes.add_collection(lines)


def _coordinates(axes: Axes, labels: Sequence[str], units: Sequence[str], low: Array, high: Array) -> None:
    axes.set_xlim(-0.35, len(labels) - 0.65)
    axes.set_ylim(-0.16, 1.16)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    box = {"facecolor": theme.SURFACE, "edgecolor": "none", "pad": 1.0}
    for i, unit in enumerate(units):
        ends = [in_unit(x, unit) for x in (low[i], high[i])]
        for y, value, side in ((-0.03, ends[0], "top"), (1.03, ends[1], "bottom")):
            axes.text(i, y, digits(value, 3), ha="center", va=side, bbox=box)
    if len(labels) > _UPRIGHT:
        axes.set_xticks(range(len(labels)), labels, rotation=_TURNED, ha="right", rotation_mode="anchor")
    else:
        axes.set_xticks(range(len(labels)), [re.sub("[.,] ?", "\n", label) for label in labels])
    axes.grid(axis="x", color=theme.MUTED)


# ---------------------------------------------------------------- convergence


def _draw_runs(runs: Sequence[Run]) -> Figure:
    figure, panels = theme.fixed_panels([1.8], len(runs), theme.Room(above=0.3), head=0.3)
    for axes, run in zip(panels[0], runs, strict=True):
        _convergence(axes, run)
    theme.shared_legend(figure, panels[0], 3)
    return figure


def _convergence(axes: Axes, run: Run) -> None:
    best, mean = (
        np.array(values, dtype=float) / run.scale for values in (run.history.best, run.history.mean)
    )
    best, mean = (np.where(np.isfinite(values), values, np.nan) for values in (best, mean))
    generation = np.arange(len(best))
    axes.plot(generation, mean, color=theme.GREY, linewidth=1.1, label="mean")
    axes.plot(generation, best, color=theme.BLUE, linewidth=1.6, label="best")
    if run.exact is not None:
        axes.axhline(run.exact / run.scale, color=theme.RED, linestyle="--", linewidth=1.2, label=run.beside)
    if _wants_logarithm(np.concatenate([best, mean])):
        axes.set_yscale("log")
        _plain_decades(axes)
    axes.set_title(run.name)
    axes.set_xlabel("generation")
    axes.set_ylabel(run.fitness)


def _plain_decades(axes: Axes) -> None:
    """Below two decades: ticks at 1, 2, 5 in plain numbers instead of `6 × 10¹`."""
    from matplotlib.ticker import LogLocator, NullLocator

    bottom, top = axes.get_ylim()
    if top / bottom < 100:
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        theme.plain_numbers(axes.yaxis)
    else:
        theme.plain_decades(axes.yaxis)
    axes.yaxis.set_minor_locator(NullLocator())


def _wants_logarithm(values: Array) -> bool:
    finite = values[np.isfinite(values)]
    return len(finite) > 0 and bool(finite.min() > 0 and finite.max() / finite.min() > 8)


# ---------------------------------------------------------------- sensitivities


def _draw_sensitivities(sensitivities: Sensitivities, errors: Sequence[str]) -> Figure:
    room = theme.Room(above=0.3, below=0.3)
    figure, panels = theme.grid_of_panels(len(errors), _SIDE_BY_SIDE, 1.3, room, foot=0.2)
    for axes, error in zip(panels, errors, strict=True):
        _growth(axes, sensitivities, error)
    for axes in panels[-_SIDE_BY_SIDE:]:
        axes.set_xlabel("time of flight, s")
    return figure


_DECADES = 1e-6
SHORT = 6  # letters of a term's name; a table's are longer, and scores: the largest are named


def _growth(axes: Axes, sensitivities: Sensitivities, error: str) -> None:
    which = [i for i, c in enumerate(sensitivities.columns) if c.error == error]
    unit = sensitivities.columns[which[0]].unit
    per_unit = unit_factor(display_unit(unit))[0]
    time = sensitivities.time_s
    keep = thinned(len(time))
    ends = [float(np.linalg.norm(sensitivities.position[-1, :, i])) for i in which]
    largest = [which[k] for k in np.argsort(ends)[:-5:-1]]
    long = any(len(sensitivities.columns[i].axis) > SHORT for i in which)
    named = largest if long else which
    lengths = np.linalg.norm(sensitivities.position[:, :, which], axis=1) * per_unit
    for k, i in enumerate(which):
        visible = np.where(lengths[:, k] > 0, lengths[:, k], np.nan)
        style = (
            ("-", "--", ":", "-.")[(k // len(theme.SERIES)) % 4]
            if len(which) > 8
            else ("-", "--", ":")[k % 3]
        )
        label = sensitivities.columns[i].axis if i in named else None
        axes.plot(time[keep], visible[keep], style, color=theme.SERIES[k % 8], linewidth=1.4, label=label)
    axes.set_yscale("log")
    _readable_decades(axes, lengths)
    axes.set_title(error)
    axes.set_ylabel(f"m per {display_unit(unit)}")
    axes.legend(loc="lower right", ncols=1 if long else 3 if len(which) < 9 else 5, **theme.FRAMED)


def _readable_decades(axes: Axes, lengths: Array) -> None:
    """A tick per decade, at most six decades: what is smaller is at the very start of the flight.

    By the lengths themselves: matplotlib's margin is a part of the decades, of which rounding makes many.
    """
    from matplotlib.ticker import LogLocator, NullLocator

    largest = float(lengths.max())
    if largest > 0:
        axes.set_ylim(0.7 * float(lengths[lengths > _DECADES * largest].min()), 2.0 * largest)
    axes.yaxis.set_major_locator(LogLocator(numticks=7))
    theme.plain_decades(axes.yaxis)
    axes.yaxis.set_minor_locator(NullLocator())
