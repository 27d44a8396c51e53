"""Gantt chart of the campaign over the temperature of its chambers, on one time axis.

A campaign has up to hundreds of thousands of steps and a page about a thousand columns: time is cut into
columns, and in a column the height of a bar is shared by what happens in it, in proportion to the time.
Steps longer than a column look as in any Gantt chart, and the drawing's size does not grow with the plan.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from datetime import timedelta
from typing import TYPE_CHECKING, Literal

import numpy as np

from planner.nouns.array import Array
from planner.nouns.plan import Plan
from planner.nouns.step import Step
from planner.quantities import DAY_S, WEEKDAYS, week_seconds
from planner.report.blocks import Picture
from planner.report.charts import theme
from planner.report.time_spent import action_of, action_order

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 900
MOST_DAYS = 16  # midnights that are named
MOST_LOADS = 16  # of units, whose begin on a bench is marked
FEW_DAYS = 3  # up to which the hours between them are, too
Place = Literal["upper left", "lower left"]
_LETTERS = 115  # across the figure, in a legend
_HEIGHT = 0.38  # of a lane; a bench has two: what is done, and for which test


def campaign_picture(plan: Plan) -> Picture:
    """For every bench one lane of actions and one of tests; below, temperature over time."""
    benches = list(dict.fromkeys(step.bench for step in plan.steps))
    tests = list(dict.fromkeys(step.test for step in plan.steps if step.test))
    alt = (
        f"Gantt chart of {len(plan.steps)} steps on {', '.join(benches)} over {plan.time_s / 3600:.2f} h, "
        "with the chamber temperature below"
    )
    caption = (
        f"{len(plan.steps)} steps. Upper lane of a bench: what is done; lower lane: for which test. "
        f"Steps shorter than {plan.time_s / COLUMNS / 60:.1f} min share the height by their time."
    )
    if plan.start is not None:
        caption += " Pale behind the lanes: people are there."
    return Picture("campaign", alt, caption, lambda: _draw(plan, benches, tests))


def column_shares(
    steps: Sequence[Step], edges: Array, names: Sequence[str], name_of: Callable[[Step], str | None]
) -> Array:
    """(names, columns) share of each column of time that steps of each name fill. edges: (columns + 1,) s."""
    width = edges[1] - edges[0]
    filled = np.zeros((len(names), len(edges) - 1))
    index = {name: i for i, name in enumerate(names)}
    known = [step for step in steps if name_of(step) in index]
    if not known:
        return filled
    row = np.array([index[str(name_of(step))] for step in known])
    # time of a name before each edge, from which differences give the time within each column
    start = np.array([step.start_s for step in known])
    end = np.array([step.end_s for step in known])
    for i in range(len(names)):
        own = row == i
        filled[i] = np.diff(_time_before(edges, start[own], end[own])) / width
    return np.minimum(filled, 1.0)


def temperature_track(steps: Sequence[Step]) -> Array:
    """(n, 2) time s and temperature degC of one bench's chamber: straight on ramps, level elsewhere."""
    points: list[tuple[float, float]] = []
    for step in steps:
        if step.temperature_degc is None:
            continue
        if step.swept_degc is not None:
            points += zip((step.start_s, step.end_s), step.swept_degc, strict=True)
            continue
        before = points[-1][1] if points else None
        if before is None or step.action != "ramp":
            points.append((step.start_s, step.temperature_degc))
        elif points[-1][0] < step.start_s:
            points.append((step.start_s, before))
        points.append((step.end_s, step.temperature_degc))
    return _corners(np.array(points).reshape(-1, 2))


def _corners(points: Array) -> Array:
    """Without the points that lie between two equal temperatures."""
    if len(points) < 3:
        return points
    level = points[:, 1]
    inner = (level[1:-1] == level[:-2]) & (level[1:-1] == level[2:])
    keep = np.concatenate([[True], ~inner, [True]])
    return np.asarray(points[keep])


def _time_before(edges: Array, start: Array, end: Array) -> Array:
    """(edges,) how long the intervals, sorted and apart, have lasted in total before each edge."""
    order = np.argsort(start, kind="stable")
    start, end = start[order], end[order]
    total = np.concatenate([[0.0], np.cumsum(end - start)])
    begun = np.searchsorted(start, edges, side="right")
    last = np.maximum(begun - 1, 0)
    over = np.maximum(end[last] - edges, 0.0) if len(end) else np.zeros(len(edges))
    return np.asarray(total[begun] - np.where(begun > 0, over, 0.0))


def _draw(plan: Plan, benches: Sequence[str], tests: Sequence[str]) -> Figure:
    tracks = {b: temperature_track([s for s in plan.steps if s.bench == b]) for b in benches}
    warm = {bench: track for bench, track in tracks.items() if len(track)}
    actions, colours = _actions(plan), dict(zip(tests, test_colours(tests), strict=True))
    heights = [0.62 * len(benches) + 0.2, 1.6][: 2 if warm else 1]
    above = 0.3 if len(warm) > 1 else 0.1  # a legend of the chambers
    room = theme.Room(left=max(theme.letters([*benches, "tests"]), 0.75), above=above, below=0.1)
    foot = _high(colours) + (0.4 if plan.start is None else 0.75)  # days have dates
    figure, panels = theme.fixed_panels(heights, 1, room, head=_high(actions), foot=foot, share="x")
    axes = [line[0] for line in panels]
    _lanes(axes[0], plan, benches, tests)
    if warm:
        _temperatures(axes[1], warm)
    axes[-1].set_xlabel("time from the start, h")
    axes[-1].set_xlim(0.0, max(plan.time_s, 1.0) / 3600.0)
    if plan.start is not None:
        _days(axes, plan)
    _legend(figure, "action", actions, "upper left")
    _legend(figure, "test", colours, "lower left")
    return figure


def _days(every: Sequence[Axes], plan: Plan) -> None:
    """Midnights and weekdays on the axis of time, and the hours of people behind the lanes."""
    begun = week_seconds(str(plan.start))
    midnights = np.arange(np.ceil(begun / DAY_S), (begun + plan.time_s) / DAY_S + 1e-9)
    midnights = midnights[:: max(1, -(-len(midnights) // MOST_DAYS))]
    if len(midnights):
        labels = [_day_label(plan, int(m)) for m in midnights]
        every[-1].set_xticks((midnights * DAY_S - begun) / 3600.0, labels)
        every[-1].set_xlabel(f"midnight before each day; the campaign begins {plan.start}")
    if plan.time_s <= FEW_DAYS * DAY_S:
        first, last = 6 * int(np.ceil(begun / 21600.0)), int((begun + plan.time_s) / 3600.0)
        between = [hour for hour in range(first, last + 1, 6) if hour % 24]
        labels = [f"{hour % 24:02d}:00" for hour in between]
        every[-1].set_xticks([hour - begun / 3600.0 for hour in between], labels, minor=True)
    for turn in range(int((begun + plan.time_s) // plan.shifts_period_s) + 1):
        for opens, closes in plan.shifts:
            span = ((x + turn * plan.shifts_period_s - begun) / 3600.0 for x in (opens, closes))
            low, high = (float(np.clip(x, 0.0, plan.time_s / 3600.0)) for x in span)
            if high > low:
                every[0].axvspan(low, high, color=theme.GRID, alpha=0.5, linewidth=0, zorder=0)


def _day_label(plan: Plan, day: int) -> str:
    """`tue`, with its date where the plan knows it; day: counted from Monday of the first week, 0."""
    name = WEEKDAYS[day % 7]
    if plan.first_day is None:
        return name
    date = plan.first_day + timedelta(days=day - plan.first_day.weekday())
    return f"{name}\n{date:%d.%m.}" + ("\noff" if date in dict(plan.days_off) else "")


def _lanes(axes: Axes, plan: Plan, benches: Sequence[str], tests: Sequence[str]) -> None:
    edges = np.linspace(0.0, max(plan.time_s, 1.0), COLUMNS + 1)
    actions = action_order(map(action_of, plan.steps))
    for row, bench in enumerate(benches):
        steps = [step for step in plan.steps if step.bench == bench]
        _lane(axes, edges, column_shares(steps, edges, actions, action_of), -row, action_colours(actions))
        shares = column_shares(steps, edges, tests, lambda s: s.test)
        _lane(axes, edges, shares, -row - 0.42, test_colours(tests))
        _begins(axes, steps, -row + _HEIGHT)
    axes.set_ylim(-len(benches) + 0.45, 0.62)
    positions = [y - row for row in range(len(benches)) for y in (_HEIGHT / 2, _HEIGHT / 2 - 0.42)]
    axes.set_yticks(positions, [label for bench in benches for label in (bench, "tests")])
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="y", visible=False)


def _begins(axes: Axes, steps: Sequence[Step], top: float) -> None:
    """The number of each load of units above the lane, where it begins; nothing where there is one batch."""
    begins: dict[int, float] = {}
    for step in steps:
        if step.batch is not None:
            begins[step.batch] = min(begins.get(step.batch, step.start_s), step.start_s)
    for number, begin in begins.items() if len(begins) <= MOST_LOADS else ():
        name = f"load {number}" if len(begins) <= MOST_LOADS // 2 else str(number)
        axes.plot([begin / 3600.0] * 2, [top - _HEIGHT, top + 0.1], color=theme.INK, linewidth=0.8)
        axes.annotate(
            name,
            (begin / 3600.0, top),
            (3, 2),
            textcoords="offset points",
            fontsize=9.0,
            annotation_clip=False,
        )


def action_colours(actions: Sequence[str]) -> list[str]:
    """One colour per action, the same in every report."""
    return [theme.ACTION_COLOURS.get(action, theme.GREY) for action in actions]


def test_colours(tests: Sequence[str]) -> list[str]:
    """One colour per test, in the order in which they begin."""
    return [theme.TESTS[i % len(theme.TESTS)] for i in range(len(tests))]


def _lane(axes: Axes, edges: Array, shares: Array, bottom: float, colours: Sequence[str]) -> None:
    below = np.zeros(shares.shape[1])
    for share, colour in zip(shares, colours, strict=True):
        above = below + share
        _blocks(axes, edges / 3600.0, bottom + _HEIGHT * below, bottom + _HEIGHT * above, colour)
        below = above


def _blocks(axes: Axes, edges: Array, low: Array, high: Array, colour: str) -> None:
    """One compound path of rectangles; neighbours of equal height are merged."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    low, high = low.round(3), high.round(3)
    change = np.flatnonzero((np.diff(low) != 0) | (np.diff(high) != 0)) + 1
    first = np.concatenate([[0], change])
    after = np.concatenate([change, [len(low)]])
    keep = high[first] > low[first]
    first, after = first[keep], after[keep]
    if not len(first):
        return
    x0, x1, y0, y1 = edges[first], edges[after], low[first], high[first]
    corners = np.stack(
        [np.stack(p, axis=1) for p in ((x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0))], axis=1
    )
    codes = np.tile([Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY], len(first))
    patch = PathPatch(Path(corners.reshape(-1, 2), codes), facecolor=colour, edgecolor="none", linewidth=0)
    axes.add_artist(patch)  # as a patch its every corner would be looked at for limits, which are set anyway


def _temperatures(axes: Axes, tracks: Mapping[str, Array]) -> None:
    styles = ("-", "--", ":", "-.")
    for i, (bench, track) in enumerate(tracks.items()):
        colour = (theme.INK, theme.RED, theme.BLUE, theme.GREEN)[i % 4]
        axes.plot(track[:, 0] / 3600, track[:, 1], styles[i % 4], color=colour, linewidth=1.3, label=bench)
    axes.set_ylabel("chamber, °C")
    if len(tracks) > 1:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(tracks))
    axes.margins(y=0.12)


def _actions(plan: Plan) -> dict[str, str]:
    """Names of the actions -> their colour."""
    actions = action_order(map(action_of, plan.steps))
    merged: dict[str, list[str]] = {}
    for action, colour in zip(actions, action_colours(actions), strict=True):
        merged.setdefault(colour, []).append(action.replace("_", " "))
    return {", ".join(names): colour for colour, names in merged.items()}


def _columns(names: Collection[str]) -> int:
    widest = max(map(len, names)) + 8  # letters that the patch and the gaps around it are as wide as
    return max(1, min(len(names), _LETTERS // widest))


def _high(names: Collection[str]) -> float:
    """Inches of a legend of these names, with its title."""
    return 0.18 + theme.lines(len(names), _columns(names)) if names else 0.0


def _legend(figure: Figure, title: str, colours: Mapping[str, str], place: Place) -> None:
    from matplotlib.patches import Patch

    if not colours:
        return
    handles = [Patch(facecolor=colour, label=name) for name, colour in colours.items()]
    figure.legend(handles=handles, loc=place, ncols=_columns(colours), title=title, alignment="left")
