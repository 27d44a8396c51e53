"""Pictures of a diagnosis: added-variable plots, residuals against every variable before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.diagnosis import Diagnosis, Evidence, FoundEffect
from planner.nouns.dwell_table import DwellTable
from planner.report.blocks import Picture
from planner.report.charts import theme
from planner.report.subjects import diagnosis_words as words
from planner.report.subjects.diagnosis_words import short
from planner.units import from_si

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POINTS = 160  # dots a panel: every further one hides behind them, and the page stays small
BINS = 12
LEVELS = 24  # of a variable that is set, not swept: a table and a centrifuge have some twenty rates
FAR_APART = 15.0
STRETCH = 0.1  # of a variable's range
LEAST_DOTS = 5  # whose mean and its error are worth drawing
UNITS = {"gyro": "deg/s", "acc": "g", "accelerometer": "g"}
_PANEL = 1.9
_ACROSS = 2
_LINEAR = 4.0  # sigma


@dataclass(frozen=True)
class Variable:
    """Something that the residual may vary with: (n,) values in the unit of its label.

    key: the variable of an unnamed part that follows it; linear: up to here its scale is, and then
        logarithmic: rates and loads go by factors (None: linear throughout)
    """

    name: str
    label: str
    values: Array
    key: str
    linear: float | None = None


def added_variable_picture(
    effect: str, found: Sequence[FoundEffect], evidence: Sequence[Evidence]
) -> Picture | None:
    """What the reading says against what the effect adds, both cleared of the declared model."""
    channels = [c for e in found if e.effect == effect for c in e.channels]
    shown = [e for e in evidence if effect in e.added and _same(e.channel, channels)]
    if not shown:
        return None
    where = ", ".join(short(e.channel) for e in shown)
    alt = f"Added-variable plot of {words.plain_name(effect)} on {where}: the reading follows what it adds"
    caption = (
        f"{words.headed(effect)}: each dot is a record. Across: what the effect adds to it; up: what was "
        "read; both after the declared model took what it can explain. Dark: means with two standard errors, "
        "which lie on the line when the effect is the whole truth."
    )
    return Picture(f"added-{effect}", alt, caption, lambda: _draw_added(effect, shown))


def residual_picture(evidence: Evidence, table: DwellTable, changed: bool) -> Picture | None:
    """Residual of one channel in sigma against every variable, before and after overlaid."""
    variables = variables_of(evidence.channel, table)
    if not variables or len(evidence.before) != len(table):
        return None
    what = "before and after" if changed else "under the declared model"
    channel = short(evidence.channel)
    alt = f"Residual of {channel} {what} against {', '.join(v.name for v in variables)}"
    caption = f"{channel}: residual over the spread that the noise model expects."
    return Picture(f"residual-{channel}", alt, caption, lambda: _draw_residual(evidence, variables, changed))


def unnamed_picture(
    varies_with: str, channels: Sequence[str], evidence: Sequence[Evidence], table: DwellTable
) -> Picture | None:
    """What is left of the channels once what was found is in the model, against the variable."""
    shown = [
        (e, v)
        for e in evidence
        if _same(e.channel, channels) and len(e.after) == len(table)
        for v in variables_of(e.channel, table)
        if v.key == varies_with
    ]
    if not shown:
        return None
    where = ", ".join(dict.fromkeys(short(e.channel) for e, _ in shown))
    what = words.varies_with(varies_with)
    caption = f"What is left against {what}, over its expected spread."
    alt = f"Residual of {where} against {what}"
    return Picture(f"unnamed-{varies_with}", alt, caption, lambda: _draw_unnamed(shown))


def change_picture(diagnosis: Diagnosis) -> Picture | None:
    """Residual of every channel before and after with intervals, beside the noise floor, within runs in σ."""
    if not diagnosis.residual:
        return None
    text = "; ".join(
        f"{short(r.channel)} {from_si(r.before, r.unit):.3g} to {from_si(r.after, r.unit):.3g} {r.unit}"
        for r in diagnosis.residual
    )
    caption = "Root mean square on rows held out, with 95 % intervals over power-ons; dashed: replicates."
    return Picture("change", f"Residual before and after: {text}", caption, lambda: _draw_change(diagnosis))


def variables_of(channel: str, table: DwellTable) -> list[Variable]:
    """Every variable of the table that takes more than one value, in the units of the dwell table."""
    axis = "xyz".index(channel[-1])
    conditions = table.conditions()
    rate = np.degrees(conditions.rate)
    every = [
        Variable("temperature", "temperature, °C", table.temperature_degc, "temperature"),
        Variable("rate of temperature", "dT/dt, K/min", table.temperature_rate * 60.0, "temperature_rate"),
        Variable("time since power-on", "time since power-on, s", table.time_on, "time_on"),
        Variable("day", "day", table.day, "day"),
        Variable("rate", f"rate about {channel[-1]}, deg/s", rate[:, axis], "rate", 5.0),
        Variable("whole rate", "rate about any axis, deg/s", np.linalg.norm(rate, axis=1), "rate", 5.0),
        *(
            Variable(f"specific force {a}", f"specific force {a}, g", from_si_array(f), "specific_force", 1.0)
            for a, f in zip("xyz", conditions.specific_force.T, strict=True)
        ),
    ]
    return [v for v in every if np.ptp(v.values) > 1e-9 * max(1.0, float(np.abs(v.values).max(initial=0.0)))]


def from_si_array(force: Array) -> Array:
    """m/s² as g."""
    return np.asarray(force / 9.80665)


def _same(channel: str, channels: Sequence[str]) -> bool:
    return short(channel) in {short(c) for c in channels}


# ---------------------------------------------------------------- added variable


def _draw_added(effect: str, shown: Sequence[Evidence]) -> Figure:
    figure, panels = theme.grid_of_panels(len(shown), 3, 2.9)
    for axes, evidence in zip(panels, shown, strict=True):
        _added(axes, evidence, evidence.added[effect])
    return figure


def _added(axes: Axes, evidence: Evidence, points: Array) -> None:
    unit = UNITS[evidence.channel.split("_")[0]]
    points = points[np.isfinite(points).all(axis=1)]  # rows that were not judged have none
    x, y = (np.array([from_si(v, unit) for v in column]) for column in points.T)
    keep = _thinned(x, 4 * POINTS)
    axes.plot(x[keep], y[keep], "o", color=theme.BLUE, alpha=0.45, markersize=2.6, markeredgewidth=0)
    ends = np.array([x.min(), x.max()])
    slope = float(x @ y / (x @ x)) if float(x @ x) > 0 else 0.0
    axes.plot(ends, slope * ends, color=theme.RED, linewidth=1.4)
    at, mean, error = _groups_of(x, y)
    axes.errorbar(
        at, mean, yerr=2.0 * error, fmt="o", color=theme.DARK, markersize=3.6, capsize=2, linewidth=1.0
    )
    axes.axhline(0.0, color=theme.MUTED, linewidth=0.7)
    low, high = np.percentile(y, [0.5, 99.5])  # a spike of 40 sigma must not flatten the rest
    low, high = min(low, float((slope * ends).min())), max(high, float((slope * ends).max()))
    room = 0.12 * max(high - low, 1e-6 * abs(high) + 1e-12)
    axes.set_ylim(low - room, high + room)
    axes.locator_params(axis="x", nbins=4)
    axes.set_title(short(evidence.channel))
    axes.set_xlabel(f"what the effect adds, {unit}")
    axes.set_ylabel(f"reading, {unit}")


# ---------------------------------------------------------------- residual against variables


def _draw_unnamed(shown: Sequence[tuple[Evidence, Variable]]) -> Figure:
    figure, panels = theme.grid_of_panels(len(shown), 2, 2.4, 0.3)
    for axes, (evidence, variable) in zip(panels, shown, strict=True):
        left = np.asarray(evidence.after / np.where(evidence.expected > 0, evidence.expected, np.nan))
        _against(axes, variable, left, left, False)
        reach = max(_LINEAR, 1.1 * _reach([variable], left, left))
        axes.set_ylim(-reach, reach)
        axes.set_title(short(evidence.channel))
        axes.set_ylabel("residual, σ")
    return figure


def _draw_residual(evidence: Evidence, variables: Sequence[Variable], changed: bool) -> Figure:
    figure, panels = theme.grid_of_panels(len(variables), _ACROSS, _PANEL, 0.4, sharey=True)
    sigma = np.where(evidence.expected > 0, evidence.expected, np.nan)
    before, after = (np.asarray(r / sigma) for r in (evidence.before, evidence.after))
    reach = max(_LINEAR, 1.1 * _reach(variables, before, after))
    for i, (axes, variable) in enumerate(zip(panels, variables, strict=True)):
        _against(axes, variable, before, after, changed)
        if reach > 3.0 * _LINEAR:
            _symmetric_logarithm(axes, reach)
        axes.set_ylim(-reach, reach)
        if i % _ACROSS == 0:
            axes.set_ylabel("residual, σ")
    theme.shared_legend(figure, panels, 4)
    return figure


def _reach(variables: Sequence[Variable], before: Array, after: Array) -> float:
    """What the figure must show: nearly all dots, and every mean."""
    means = [np.abs(_binned(v.values, r)[1]).max(initial=0.0) for v in variables for r in (before, after)]
    dots = np.abs(np.concatenate([before, after]))
    return float(max(np.nanpercentile(dots, 99.0) if np.isfinite(dots).any() else 0.0, *means))


def _symmetric_logarithm(axes: Axes, reach: float) -> None:
    """Linear up to four sigma, where noise is; logarithmic beyond, where a missing effect is."""
    from matplotlib.ticker import FixedLocator

    axes.set_yscale("symlog", linthresh=_LINEAR, linscale=1.0)
    sizes = [t for t in (2.0, 10.0, 30.0, 100.0, 300.0, 1e3, 1e4, 1e5, 1e6) if t <= reach]
    axes.yaxis.set_major_locator(FixedLocator([*(-t for t in reversed(sizes)), 0.0, *sizes]))
    theme.plain_numbers(axes.yaxis)


def _against(axes: Axes, variable: Variable, before: Array, after: Array, changed: bool) -> None:
    axes.axhspan(-2.0, 2.0, color=theme.PALE, alpha=0.45, linewidth=0, label="±2 σ, pure error")
    axes.axhline(0.0, color=theme.MUTED, linewidth=0.7)
    series = [("declared model", before, theme.RED, "s")]
    if changed:
        series.append(("with what was found", after, theme.BLUE, "o"))
    keep = _thinned(variable.values, POINTS)
    for label, values, colour, marker in series:
        axes.plot(
            variable.values[keep],
            values[keep],
            marker,
            color=colour,
            alpha=0.3,
            markersize=2.2,
            markeredgewidth=0,
        )
        x, mean = _binned(variable.values, values)
        axes.plot(
            x, mean, marker + "-", color=colour, linewidth=1.5, markersize=3.6, label=f"{label} (means: line)"
        )
    axes.set_xlabel(variable.label)
    if variable.linear is not None and np.abs(variable.values).max() > 10.0 * variable.linear:
        _by_factors(axes, variable)


def _by_factors(axes: Axes, variable: Variable) -> None:
    """Rates and loads from small to large on one axis."""
    from matplotlib.ticker import FixedLocator, NullLocator

    size = float(np.abs(variable.values).max())
    axes.set_xscale("symlog", linthresh=variable.linear, linscale=0.4)
    some = [t for t in (1.0, 10.0, 100.0, 1e3, 1e4) if (variable.linear or 0.0) <= t <= size]
    below = [-t for t in reversed(some)] if variable.values.min() < 0 else []
    axes.xaxis.set_major_locator(FixedLocator([*below, 0.0, *some]))
    axes.xaxis.set_minor_locator(NullLocator())
    theme.plain_numbers(axes.xaxis)


def _binned(x: Array, y: Array) -> tuple[Array, Array]:
    """Means of y over groups of like x: the values themselves when they are few, else equal shares."""
    good = np.isfinite(y)
    x, y = x[good], y[good]
    group = _levels(x)
    if group.max(initial=-1) >= LEVELS or _swept(x, group):
        edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, BINS + 1)))
        group = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
    count = np.bincount(group)
    some = count > 0
    return (
        np.asarray((np.bincount(group, x) / np.maximum(count, 1))[some]),
        np.asarray((np.bincount(group, y) / np.maximum(count, 1))[some]),
    )


def _levels(x: Array) -> NDArray[np.intp]:
    """(n,) number of the level of each value: a level ends where the next is further off than its spread."""
    order = np.argsort(x, kind="stable")
    ordered = x[order]
    gap = np.maximum(float(np.ptp(x)) / 400.0 if len(x) else 1.0, 0.03 * np.abs(ordered[1:]))
    number = np.concatenate([[0], np.cumsum(np.diff(ordered) > np.maximum(gap, 1e-12))])[: len(x)]
    out = np.empty(len(x), dtype=np.intp)
    out[order] = number
    return out


def _swept(x: Array, group: NDArray[np.intp]) -> bool:
    """Whether a level is no point but a stretch of the range: the variable goes through all its values."""
    widths = [float(np.ptp(x[group == k])) for k in range(int(group.max(initial=-1)) + 1)]
    return max(widths, default=0.0) > STRETCH * float(np.ptp(x))


def _groups_of(x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Means of x and y, and the standard errors of y's, over groups of equal width in x with enough dots."""
    edges = np.linspace(x.min(), x.max(), BINS + 1)
    group = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    rows = [np.flatnonzero(group == k) for k in range(BINS)]
    rows = [r for r in rows if len(r) >= LEAST_DOTS]
    means = [(x[r].mean(), y[r].mean(), y[r].std(ddof=1) / np.sqrt(len(r))) for r in rows]
    at, mean, error = np.array(means).reshape(-1, 3).T
    return at, mean, error


def _thinned(x: Array, most: int) -> NDArray[np.intp]:
    """Indices of at most `most` points, evenly over the order of x, so that rare values stay."""
    if len(x) <= most:
        return np.arange(len(x))
    picked = np.linspace(0, len(x) - 1, most).astype(int)
    return np.asarray(np.argsort(x, kind="stable")[picked])


# ---------------------------------------------------------------- before and after


def _draw_change(diagnosis: Diagnosis) -> Figure:
    groups = [[r for r in diagnosis.residual if r.unit == unit] for unit in ("deg/s", "g")]
    groups = [g for g in groups if g]
    figure = theme.new_figure(2.5)
    panels = figure.subplots(1, len(groups), squeeze=False)[0]
    for axes, group in zip(panels, groups, strict=True):
        at = np.arange(len(group))
        for offset, colour, label, key in (
            (-0.12, theme.RED, "before", "before"),
            (0.12, theme.BLUE, "after", "after"),
        ):
            middle, low, high = (
                np.array([from_si(getattr(r, key + end), r.unit) for r in group])
                for end in ("", "_low", "_high")
            )
            low, high = (np.where(np.isfinite(x), x, middle) for x in (low, high))
            axes.errorbar(
                at + offset, middle, yerr=np.stack([middle - low, high - middle]), fmt="o", color=colour,
                markersize=4.5, capsize=3, linewidth=1.3, label=label,
            )  # fmt: skip
        floor = np.array([from_si(r.noise_floor, r.unit) for r in group])
        axes.hlines(
            floor, at - 0.3, at + 0.3, color=theme.DARK, linestyle="--", linewidth=1.2, label="noise floor"
        )
        axes.set_xticks(at, [short(r.channel) for r in group])
        axes.set_xlim(-0.5, len(group) - 0.5)
        _scale_of_change(axes, [x for r in group for x in (r.before, r.after)])
        axes.set_ylabel(f"residual, {group[0].unit}")
    theme.shared_legend(figure, panels, 3)
    return figure


def _scale_of_change(axes: Axes, sizes: Sequence[float]) -> None:
    """From zero; logarithmic where the smallest would lie on the axis beside the largest."""
    known = [x for x in sizes if np.isfinite(x) and x > 0]
    if not known or max(known) < FAR_APART * min(known):
        axes.set_ylim(bottom=0.0)
        return
    axes.set_yscale("log")
    theme.plain_numbers(axes.yaxis)
