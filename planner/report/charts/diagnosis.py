"""Pictures of a diagnosis: added-variable plots, the residual of every channel before and after."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.nouns.array import Array
from planner.nouns.diagnosis import Diagnosis, Evidence, FoundEffect, ResidualChange
from planner.nouns.sensor import short
from planner.report.blocks import Picture, Sketch
from planner.report.charts import theme
from planner.report.charts.residuals import BINS, POINTS, same_channel, thinned
from planner.report.charts.straight import (
    WIDTH,
    Chart,
    Entry,
    Panel,
    Scale,
    around,
    linear,
    logarithmic,
)
from planner.report.subjects import diagnosis_words as words
from planner.units import from_si

FAR_APART = 15.0
LEAST_DOTS = 5  # whose mean and its error are worth drawing
_ROW, _ACROSS = 206.0, 3  # height of a row of panels, points; panels in it
_STATES = ((-0.12, theme.RED, "before"), (0.12, theme.BLUE, "after"))
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
    return Sketch(f"added-{effect}", alt, caption, lambda: _draw_added(effect, shown))


def change_picture(diagnosis: Diagnosis) -> Picture | None:
    """Residual of every channel before and after with intervals, beside the noise floor, within runs in σ."""
    if not diagnosis.residual:
        return None
    text = "; ".join(
        f"{short(r.channel)} {from_si(r.before, r.unit):.3g} to {from_si(r.after, r.unit):.3g} {r.unit}"
        for r in diagnosis.residual
    )
    caption = "Root mean square on rows held out, with 95 % intervals over power-ons; dashed: replicates."
    return Sketch(
        "change",
        f"Residual before and after: {text}",
        caption,
        lambda: _draw_change(diagnosis),
    )


def _draw_added(effect: str, shown: Sequence[Evidence]) -> Chart:
    panels = [_added(evidence, evidence.added[effect], i) for i, evidence in enumerate(shown)]
    return Chart(panels, _ROW * -(-len(shown) // _ACROSS))


def _added(evidence: Evidence, points: Array, place: int) -> Panel:
    unit = UNITS[evidence.channel.split("_")[0]]
    points = points[np.isfinite(points).all(axis=1)]  # rows that were not judged have none
    x, y = (np.array([from_si(v, unit) for v in column]) for column in points.T)
    ends = np.array([x.min(), x.max()])
    slope = float(x @ y / (x @ x)) if float(x @ x) > 0 else 0.0
    low, high = np.percentile(y, [0.5, 99.5])  # a spike of 40 sigma must not flatten the rest
    low, high = min(low, float((slope * ends).min())), max(high, float((slope * ends).max()))
    room = 0.12 * max(high - low, 1e-6 * abs(high) + 1e-12)
    left, top = WIDTH / _ACROSS * (place % _ACROSS) + 58.0, _ROW * (place // _ACROSS) + 18.0
    panel = Panel(
        left, top, WIDTH / _ACROSS - 70.0, _ROW - 54.0, linear(*around(x), 3),
        linear(low - room, high + room), short(evidence.channel),
        f"what the effect adds, {unit}", f"reading, {unit}",
    )  # fmt: skip
    keep = thinned(x, 4 * POINTS)
    panel.dots(x[keep], y[keep], theme.BLUE, 2.6, 0.45)
    panel.line(ends, slope * ends, theme.RED, 1.4)
    at, mean, error = _groups_of(x, y)
    panel.intervals(at, mean - 2.0 * error, mean + 2.0 * error, theme.DARK, 2.0)
    panel.dots(at, mean, theme.DARK, 3.6)
    panel.level(0.0)
    return panel


def _groups_of(x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Means of x and y, and the standard errors of y's, over groups of equal width in x with enough dots."""
    edges = np.linspace(x.min(), x.max(), BINS + 1)
    group = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    rows = [np.flatnonzero(group == k) for k in range(BINS)]
    rows = [r for r in rows if len(r) >= LEAST_DOTS]
    means = [(x[r].mean(), y[r].mean(), y[r].std(ddof=1) / np.sqrt(len(r))) for r in rows]
    at, mean, error = np.array(means).reshape(-1, 3).T
    return at, mean, error


def _draw_change(diagnosis: Diagnosis) -> Chart:
    groups = [[r for r in diagnosis.residual if r.unit == unit] for unit in ("deg/s", "g")]
    groups = [g for g in groups if g]
    wide = WIDTH / len(groups)
    panels = [_changed(group, wide * i + 58.0, wide - 70.0) for i, group in enumerate(groups)]
    floor = Entry("noise floor", theme.DARK, "dashes")
    return Chart(panels, 180.0, [*(Entry(key, colour, "dots") for _, colour, key in _STATES), floor])


def _changed(group: Sequence[ResidualChange], left: float, wide: float) -> Panel:
    at, unit = np.arange(float(len(group))), group[0].unit
    marks = [(float(i), short(r.channel)) for i, r in enumerate(group)]
    scale = _scale_of_change(group)
    panel = Panel(
        left, 24.0, wide, 132.0, linear(-0.5, len(group) - 0.5), scale, marks=marks, up=f"residual, {unit}"
    )
    for offset, colour, key in _STATES:
        middle, low, high = (
            np.array([from_si(getattr(r, key + end), unit) for r in group]) for end in ("", "_low", "_high")
        )
        low, high = (np.where(np.isfinite(x), x, middle) for x in (low, high))
        panel.intervals(at + offset, low, high, colour, 3.0)
        panel.dots(at + offset, middle, colour, 4.5)
    for i, r in enumerate(group):
        floor = from_si(r.noise_floor, unit)
        panel.line([i - 0.3, i + 0.3], [floor, floor], theme.DARK, 1.2, "4 2")
    return panel


def _scale_of_change(group: Sequence[ResidualChange]) -> Scale:
    """From zero; logarithmic where the smallest would lie on the axis beside the largest."""
    unit = group[0].unit
    drawn = (x for r in group for x in (r.before, r.after, r.before_high, r.after_high, r.noise_floor))
    most = max((from_si(x, unit) for x in drawn if np.isfinite(x)), default=1.0) or 1.0
    sizes = (from_si(x, unit) for r in group for x in (r.before, r.after))
    known = [x for x in sizes if np.isfinite(x) and x > 0]
    if not known or max(known) < FAR_APART * min(known):
        return linear(0.0, 1.08 * most, 6)
    lows = (from_si(x, unit) for r in group for x in (r.before_low, r.after_low, r.noise_floor))
    least = min([min(known), *(x for x in lows if np.isfinite(x) and x > 0.1 * min(known))])
    return logarithmic(0.8 * least, 1.25 * most)
