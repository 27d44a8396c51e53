"""Pictures of a diagnosis: added-variable plots, the residual of every channel before and after."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from planner.nouns.array import Array
from planner.nouns.diagnosis import Diagnosis, Evidence, FoundEffect
from planner.nouns.sensor import short
from planner.report.blocks import Picture
from planner.report.charts import theme
from planner.report.charts.residuals import BINS, POINTS, same_channel, thinned
from planner.report.subjects import diagnosis_words as words
from planner.units import from_si

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FAR_APART = 15.0
LEAST_DOTS = 5  # whose mean and its error are worth drawing
UNITS = {"gyro": "deg/s", "acc": "g", "accelerometer": "g"}


def added_variable_picture(
    effect: str, found: Sequence[FoundEffect], evidence: Sequence[Evidence]
) -> Picture | None:
    """What the reading says against what the effect adds, both cleared of the declared model."""
    channels = [c for e in found if e.effect == effect for c in e.channels]
    shown = [e for e in evidence if effect in e.added and same_channel(e.channel, channels)]
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


def change_picture(diagnosis: Diagnosis) -> Picture | None:
    """Residual of every channel before and after with intervals, beside the noise floor, within runs in σ."""
    if not diagnosis.residual:
        return None
    text = "; ".join(
        f"{short(r.channel)} {from_si(r.before, r.unit):.3g} to {from_si(r.after, r.unit):.3g} {r.unit}"
        for r in diagnosis.residual
    )
    caption = "Root mean square on rows held out, with 95 % intervals over power-ons; dashed: replicates."
    loud = [r for r in diagnosis.residual if r.rises_by_the_loudest]
    if loud:
        weighed = (f"{short(r.channel)} {r.weighed_before:.3g} to {r.weighed_after:.3g} σ" for r in loud)
        caption += f" Each record weighed by its noise, where 1 is noise alone: {'; '.join(weighed)}."
    return Picture("change", f"Residual before and after: {text}", caption, lambda: _draw_change(diagnosis))


def _draw_added(effect: str, shown: Sequence[Evidence]) -> Figure:
    figure, panels = theme.grid_of_panels(len(shown), 3, 2.1, theme.Room(above=0.3))
    for axes, evidence in zip(panels, shown, strict=True):
        _added(axes, evidence, evidence.added[effect])
    return figure


def _added(axes: Axes, evidence: Evidence, points: Array) -> None:
    unit = UNITS[evidence.channel.split("_")[0]]
    points = points[np.isfinite(points).all(axis=1)]  # rows that were not judged have none
    x, y = (np.array([from_si(v, unit) for v in column]) for column in points.T)
    keep = thinned(x, 4 * POINTS)
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


def _groups_of(x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Means of x and y, and the standard errors of y's, over groups of equal width in x with enough dots."""
    edges = np.linspace(x.min(), x.max(), BINS + 1)
    group = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    rows = [np.flatnonzero(group == k) for k in range(BINS)]
    rows = [r for r in rows if len(r) >= LEAST_DOTS]
    means = [(x[r].mean(), y[r].mean(), y[r].std(ddof=1) / np.sqrt(len(r))) for r in rows]
    at, mean, error = np.array(means).reshape(-1, 3).T
    return at, mean, error


def _draw_change(diagnosis: Diagnosis) -> Figure:
    groups = [[r for r in diagnosis.residual if r.unit == unit] for unit in ("deg/s", "g")]
    groups = [g for g in groups if g]
    figure, [panels] = theme.fixed_panels([1.8], len(groups), theme.Room(below=0.35), head=0.3)
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
