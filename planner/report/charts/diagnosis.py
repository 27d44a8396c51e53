"""Pictures of a diagnosis: added-variable plots, the residual of every channel before and after."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.nouns.array import Array
from planner.nouns.diagnosis import Diagnosis, Evidence, FoundEffect, ResidualChange
from planner.report.blocks import Drawing
from planner.report.charts import theme
from planner.report.charts.panels import Axes, Bars, Dots, Line, Mark, Scale, Sheet, around
from planner.report.charts.residuals import BINS, POINTS, same_channel, thinned
from planner.report.subjects import diagnosis_words as words
from planner.report.subjects.diagnosis_words import short
from planner.units import from_si

FAR_APART = 15.0
LEAST_DOTS = 5  # whose mean and its error are worth drawing
UNITS = {"gyro": "deg/s", "acc": "g", "accelerometer": "g"}


def added_variable_picture(
    effect: str, found: Sequence[FoundEffect], evidence: Sequence[Evidence]
) -> Drawing | None:
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
    return Drawing(f"added-{effect}", alt, caption, lambda: _draw_added(effect, shown))


def change_picture(diagnosis: Diagnosis) -> Drawing | None:
    """Residual of every channel before and after with intervals, beside the noise floor, within runs in σ."""
    if not diagnosis.residual:
        return None
    text = "; ".join(
        f"{short(r.channel)} {from_si(r.before, r.unit):.3g} to {from_si(r.after, r.unit):.3g} {r.unit}"
        for r in diagnosis.residual
    )
    caption = "Root mean square on rows held out, with 95 % intervals over power-ons; dashed: replicates."
    return Drawing("change", f"Residual before and after: {text}", caption, lambda: _draw_change(diagnosis))


def _draw_added(effect: str, shown: Sequence[Evidence]) -> Sheet:
    axes = [_added(evidence, evidence.added[effect]) for evidence in shown]
    across = min(3, len(axes))
    rows = [axes[i : i + across] for i in range(0, len(axes), across)]
    return Sheet(rows, across, 200.0, titled=True, spaced=True)


def _added(evidence: Evidence, points: Array) -> Axes:
    unit = UNITS[evidence.channel.split("_")[0]]
    points = points[np.isfinite(points).all(axis=1)]  # rows that were not judged have none
    x, y = (np.array([from_si(v, unit) for v in column]) for column in points.T)
    keep = thinned(x, 4 * POINTS)
    ends = np.array([x.min(), x.max()])
    slope = float(x @ y / (x @ x)) if float(x @ x) > 0 else 0.0
    at, mean, error = _groups_of(x, y)
    low, high = np.percentile(y, [0.5, 99.5])  # a spike of 40 sigma must not flatten the rest
    low, high = min(low, float((slope * ends).min())), max(high, float((slope * ends).max()))
    room = 0.12 * max(high - low, 1e-6 * abs(high) + 1e-12)
    marks: list[Mark] = [
        Dots(x[keep], y[keep], theme.BLUE, 1.3, opacity=0.45),
        Line(ends, slope * ends, theme.RED, 1.4),
        Bars(at, mean - 2.0 * error, mean + 2.0 * error, theme.DARK, 1.0, 2.0),
        Dots(at, mean, theme.DARK, 1.8),
        Line(ends, np.zeros(2), theme.MUTED, 0.7),
    ]
    return Axes(
        around(x), Scale(low - room, high + room), marks, f"what the effect adds, {unit}",
        f"reading, {unit}", short(evidence.channel),
    )  # fmt: skip


def _groups_of(x: Array, y: Array) -> tuple[Array, Array, Array]:
    """Means of x and y, and the standard errors of y's, over groups of equal width in x with enough dots."""
    edges = np.linspace(x.min(), x.max(), BINS + 1)
    group = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    rows = [np.flatnonzero(group == k) for k in range(BINS)]
    rows = [r for r in rows if len(r) >= LEAST_DOTS]
    means = [(x[r].mean(), y[r].mean(), y[r].std(ddof=1) / np.sqrt(len(r))) for r in rows]
    at, mean, error = np.array(means).reshape(-1, 3).T
    return at, mean, error


def _draw_change(diagnosis: Diagnosis) -> Sheet:
    groups = [[r for r in diagnosis.residual if r.unit == unit] for unit in ("deg/s", "g")]
    axes = [_change(group) for group in groups if group]
    return Sheet([axes], len(axes), 150.0, spaced=True)


def _change(group: Sequence[ResidualChange]) -> Axes:
    """One unit's channels side by side."""
    at = np.arange(len(group), dtype=float)
    marks: list[Mark] = []
    for offset, colour, key in ((-0.12, theme.RED, "before"), (0.12, theme.BLUE, "after")):
        middle, low, high = (
            np.array([from_si(getattr(r, key + end), r.unit) for r in group]) for end in ("", "_low", "_high")
        )
        low, high = (np.where(np.isfinite(x), x, middle) for x in (low, high))
        marks += [
            Bars(at + offset, low, high, colour, 1.3),
            Dots(at + offset, middle, colour, 2.2, label=key),
        ]
    for k, r in enumerate(group):
        ends, floor = np.array([k - 0.3, k + 0.3]), from_si(r.noise_floor, r.unit)
        marks.append(Line(ends, np.full(2, floor), theme.DARK, 1.2, dashed=True, label="noise floor"))
    names = tuple(short(r.channel) for r in group)
    x = Scale(-0.5, len(group) - 0.5, marks=tuple(at.tolist()), names=names)
    sizes = [from_si(v, r.unit) for r in group for v in (r.before, r.before_high, r.after, r.after_high)]
    low_ends = [from_si(v, r.unit) for r in group for v in (r.before_low, r.after_low, r.before, r.after)]
    return Axes(x, _scale_of_change(sizes, low_ends), marks, y_label=f"residual, {group[0].unit}")


def _scale_of_change(sizes: Sequence[float], low_ends: Sequence[float]) -> Scale:
    """From zero; logarithmic where the smallest would lie on the axis beside the largest."""
    known = [x for x in sizes if np.isfinite(x) and x > 0] or [1.0]
    least = min([x for x in low_ends if np.isfinite(x) and x > 0] or known)
    if max(known) < FAR_APART * least:
        return Scale(0.0, 1.08 * max(known))
    low, high = 0.8 * least, 1.25 * max(known)
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    each = (1.0, 3.0) if high / low < 1e3 else (1.0,)
    marks = tuple(k * 10.0**d for d in decades for k in each if low <= k * 10.0**d <= high)
    return Scale(low, high, linear=low, share=1e-9, marks=marks)
