"""What is left of the channels against every variable, before and after: pictures, and a table of all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.dwells.table_rows import rows_of
from planner.nouns.array import Array
from planner.nouns.diagnosis import Evidence
from planner.nouns.dwell_table import DwellTable
from planner.nouns.sensor import short
from planner.report.blocks import Picture, Table
from planner.report.blocks import table as build_table
from planner.report.charts import theme
from planner.report.numbers import NOTHING, digits
from planner.report.subjects import diagnosis_words as words
from planner.units import STANDARD_GRAVITY_MPS2 as G

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POINTS = 160  # dots a panel: every further one hides behind them, and the page stays small
BINS = 12
LEVELS = 24  # of a variable that is set, not swept: a table and a centrifuge have some twenty rates
STRETCH = 0.1  # of a variable's range
ROUNDING = 1e-4  # standard errors: means over power-ons of which each has a level of its own
_PANEL = 1.2
_ACROSS = 3
_LINEAR = 4.0  # sigma


@dataclass(frozen=True)
class Variable:
    """Something that the residual may vary with: (n,) values in the unit of its label; run: (n,) power-ons.

    key: the variable of an unnamed part that follows it; linear: up to here its scale is, and then
        logarithmic: rates and loads go by factors (None: linear throughout)
    """

    name: str
    label: str
    values: Array
    run: NDArray[np.int64]
    key: str
    linear: float | None = None


def residual_picture(
    evidence: Sequence[Evidence], table: DwellTable, changed: Sequence[str]
) -> Picture | None:
    """Residuals of channels in sigma, each against what it follows most, before and after overlaid.

    changed: channels on which something was found
    """
    rows = [(e, vs[:_ACROSS]) for e in evidence if _is_of(e, table) and (vs := most_telling(e, table))]
    if not rows:
        return None
    told = "; ".join(f"{short(e.channel)} against {', '.join(v.name for v in vs)}" for e, vs in rows)
    caption = (
        "Residuals over the spread that the noise model expects; of every channel the variables that its "
        "means follow most, what is left before and, where something was found, after."
    )
    return Picture("residual", f"Residual of {told}", caption, lambda: _draw_residual(rows, changed))


def residual_table(evidence: Sequence[Evidence], table: DwellTable, changed: Sequence[str]) -> Table | None:
    """How far the means stray from zero, in their own standard errors: every channel against every variable.

    Of some twenty means of noise the largest is about 3.
    """
    known = [e for e in evidence if _is_of(e, table)]
    told: dict[str, dict[str, str]] = {}
    for e in known:
        for v in _variables(e, table):
            before, after = (_strays(v, e, r) for r in (e.before, e.after))
            both = f"{digits(before, 2)} → {digits(after, 2)}"
            said = both if same_channel(e.channel, changed) else digits(before, 2)
            told.setdefault(v.name, {})[short(e.channel)] = said
    names = [short(e.channel) for e in known]
    rows = [(name, *(cells.get(n, NOTHING) for n in names)) for name, cells in told.items()]
    return build_table(
        "Residual against every variable: the furthest mean, in standard errors by the noise model",
        " | ".join(["against", *names]),
        rows,
    )


def most_telling(evidence: Evidence, table: DwellTable) -> list[Variable]:
    """The variables of a channel, what its residual follows most first; of two kinds of rate the better."""
    every = _variables(evidence, table)
    order = sorted(every, key=lambda v: -_strays(v, evidence, evidence.before))
    return [v for i, v in enumerate(order) if v.key != "rate" or v.key not in {o.key for o in order[:i]}]


def _strays(variable: Variable, e: Evidence, residual: Array) -> float:
    """The largest mean of a group, of residual (n,), in its standard errors; power-ons share parts of theirs.

    Of m rows, m² var = Σ (σ_i² − Σ_k s_ki²) + Σ_k Σ_runs (Σ_i s_ki)²
    """
    good = np.isfinite(residual) & (e.expected > 0.0)
    group, (runs, run) = groups_of(variable.values[good]), np.unique(variable.run[good], return_inverse=True)
    shared, square = e.shared[:, good], e.expected[good] ** 2
    own = np.bincount(group, np.maximum(square - np.sum(shared**2, axis=0), 0.0))
    cells = len(own) * len(runs)
    met = sum((np.bincount(group * len(runs) + run, s, cells) ** 2 for s in shared), np.zeros(cells))
    variance = own + met.reshape(len(own), len(runs)).sum(axis=1)
    mean = np.bincount(group, residual[good])
    furthest = float(np.max(np.abs(mean) / np.sqrt(np.maximum(variance, 1e-300)), initial=0.0))
    return furthest if furthest > ROUNDING else 0.0


def unnamed_picture(
    varies_with: str, channels: Sequence[str], evidence: Sequence[Evidence], table: DwellTable
) -> Picture | None:
    """What is left of the channels once what was found is in the model, against the variable."""
    shown = [
        (e, v)
        for e in evidence
        if same_channel(e.channel, channels) and _is_of(e, table)
        for v in _variables(e, table)
        if v.key == varies_with
    ]
    if not shown:
        return None
    where = ", ".join(dict.fromkeys(short(e.channel) for e, _ in shown))
    what = words.varies_with(varies_with)
    caption = f"What is left against {what}, over its expected spread."
    alt = f"Residual of {where} against {what}"
    return Picture(f"unnamed-{varies_with}", alt, caption, lambda: _draw_unnamed(shown))


def _is_of(e: Evidence, table: DwellTable) -> bool:
    """Whether it is evidence of that table: of every row, or of those that it names."""
    return len(e.before) == len(table) if e.rows is None else bool(e.rows.max(initial=-1) < len(table))


def _variables(e: Evidence, table: DwellTable) -> list[Variable]:
    """The variables of the channel over the rows of its evidence."""
    return variables_of(e.channel, table if e.rows is None else rows_of(table, e.rows))


def variables_of(channel: str, table: DwellTable) -> list[Variable]:
    """Every variable of the table that takes more than one value, in the units of the dwell table."""
    axis = "xyz".index(channel[-1])
    conditions = table.conditions()
    rate = np.degrees(conditions.rate)
    told: list[tuple[str, str, Array, str, float | None]] = [
        ("temperature", "temperature, °C", table.temperature_degc, "temperature", None),
        ("rate of temperature", "dT/dt, K/min", table.temperature_rate * 60.0, "temperature_rate", None),
        ("time since power-on", "time since power-on, s", table.time_on, "time_on", None),
        ("day", "day", table.day, "day", None),
        ("rate", f"rate about {channel[-1]}, deg/s", rate[:, axis], "rate", 5.0),
        ("whole rate", "rate about any axis, deg/s", np.linalg.norm(rate, axis=1), "rate", 5.0),
        *(
            (f"specific force {a}", f"specific force {a}, g", f / G, "specific_force", 1.0)
            for a, f in zip("xyz", conditions.specific_force.T, strict=True)
        ),
    ]
    every = [Variable(name, label, x, table.run, key, linear) for name, label, x, key, linear in told]
    return [v for v in every if np.ptp(v.values) > 1e-9 * max(1.0, float(np.abs(v.values).max(initial=0.0)))]


def same_channel(channel: str, channels: Sequence[str]) -> bool:
    """Whether a channel is among others, `acc_x` being `accelerometer_x`."""
    return short(channel) in {short(c) for c in channels}


def _draw_unnamed(shown: Sequence[tuple[Evidence, Variable]]) -> Figure:
    figure, panels = theme.grid_of_panels(len(shown), 2, 1.8, theme.Room(above=0.3))
    for axes, (evidence, variable) in zip(panels, shown, strict=True):
        left = np.asarray(evidence.after / np.where(evidence.expected > 0, evidence.expected, np.nan))
        _against(axes, variable, left, left, False)
        reach = max(_LINEAR, 1.1 * _reach([variable], left, left))
        axes.set_ylim(-reach, reach)
        axes.set_title(short(evidence.channel))
        axes.set_ylabel("residual, σ")
    return figure


def _draw_residual(rows: Sequence[tuple[Evidence, Sequence[Variable]]], changed: Sequence[str]) -> Figure:
    room = theme.Room(above=0.0, below=0.55, between=0.1)
    figure, panels = theme.fixed_panels([_PANEL] * len(rows), _ACROSS, room, head=0.35)
    for line, (evidence, variables) in zip(panels, rows, strict=True):
        sigma = np.where(evidence.expected > 0, evidence.expected, np.nan)
        before, after = (np.asarray(r / sigma) for r in (evidence.before, evidence.after))
        reach = max(_LINEAR, 1.1 * _reach(variables, before, after))
        for i, (axes, variable) in enumerate(zip(line, variables, strict=False)):
            _against(axes, variable, before, after, same_channel(evidence.channel, changed))
            if reach > 3.0 * _LINEAR:
                _symmetric_logarithm(axes, reach)
            axes.set_ylim(-reach, reach)
            axes.locator_params(axis="x", nbins=5) if axes.get_xscale() == "linear" else None
            axes.tick_params(axis="y", labelleft=i == 0)
        line[0].set_ylabel(f"{short(evidence.channel)}, σ")
        for spare in line[len(variables) :]:
            spare.set_visible(False)
    theme.shared_legend(figure, [axes for line in panels for axes in line], 4)
    return figure


def _reach(variables: Sequence[Variable], before: Array, after: Array) -> float:
    """What the figure must show: nearly all dots, and every mean."""
    means = [np.abs(binned(v.values, r)[1]).max(initial=0.0) for v in variables for r in (before, after)]
    dots = np.abs(np.concatenate([before, after]))
    return float(max(np.nanpercentile(dots, 99.0) if np.isfinite(dots).any() else 0.0, *means))


def _symmetric_logarithm(axes: Axes, reach: float) -> None:
    """Linear up to four sigma, where noise is; logarithmic beyond, where a missing effect is."""
    from matplotlib.ticker import FixedLocator

    axes.set_yscale("symlog", linthresh=_LINEAR, linscale=1.0)
    sizes = [t for t in (10.0, 30.0, 100.0, 300.0, 1e3, 1e4, 1e5, 1e6) if t <= reach]
    sizes = sizes[-1 :: -max(len(sizes) // 2, 1)][::-1]  # two a side: more overlap in a low panel
    axes.yaxis.set_major_locator(FixedLocator([*(-t for t in reversed(sizes)), 0.0, *sizes]))
    theme.plain_numbers(axes.yaxis)


def _against(axes: Axes, variable: Variable, before: Array, after: Array, changed: bool) -> None:
    axes.axhspan(-2.0, 2.0, color=theme.PALE, alpha=0.45, linewidth=0, label="±2 σ, pure error")
    axes.axhline(0.0, color=theme.MUTED, linewidth=0.7)
    series = [("declared model", before, theme.RED, "s")]
    if changed:
        series.append(("with what was found", after, theme.BLUE, "o"))
    keep = thinned(variable.values, POINTS)
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
        x, mean = binned(variable.values, values)
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


def binned(x: Array, y: Array) -> tuple[Array, Array]:
    """Means of x and y over groups of like x (`groups_of`)."""
    good = np.isfinite(y)
    x, y = x[good], y[good]
    group = groups_of(x)
    count = np.bincount(group)
    some = count > 0
    x, y = (np.bincount(group, each)[some] / count[some] for each in (x, y))
    return x, y


def groups_of(x: Array) -> NDArray[np.intp]:
    """(n,) groups of like values: each that is set where these are few, else equal shares."""
    group = _levels(x)
    if group.max(initial=-1) < LEVELS and not _swept(x, group):
        return group
    edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, BINS + 1)))
    return np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)


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


def thinned(x: Array, most: int) -> NDArray[np.intp]:
    """Indices of at most `most` points, evenly over the order of x, so that rare values stay."""
    if len(x) <= most:
        return np.arange(len(x))
    picked = np.linspace(0, len(x) - 1, most).astype(int)
    return np.asarray(np.argsort(x, kind="stable")[picked])
