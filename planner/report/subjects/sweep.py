"""Hours against metres: a sweep as a curve, as a table and as CSV rows."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from planner.report.blocks import Block, Picture, Report, Table, Text, existing, facts, section
from planner.report.charts import theme
from planner.report.numbers import NOTHING, digits, hours
from planner.report.subjects.sweep_answer import (
    Cheapest,
    abscissa,
    cheapest_of,
    cheapest_table,
    knee,
    knee_words,
    number_of,
    unit_of,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Document = Mapping[str, Any]
WIDE = 8.0


_QUANTITY = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s+(\S.*)")


def csv_columns(sweep: Document) -> list[str]:
    """Keys, then what each plan says; a unit stands in a column of its own, times are in seconds."""
    return [
        *(name for key in sweep["keys"] for name in (key, f"{key} unit")[: 1 + _has_unit(sweep, key)]),
        "status",
        "time_s",
        "bound_s",
        "power_on_s",
        *(f"{what}_{i}{tail}" for i in range(_asked(sweep)) for what, tail in _OF_REQUIREMENT),
        "why",
    ]


_OF_REQUIREMENT = (("limit", ""), ("achieved", ""), ("achieved", "_unit"))


def _has_unit(sweep: Document, key: str) -> bool:
    """Whether every value of a key is a number with a unit."""
    values = [str(p["values"][key]) for p in sweep["points"]]
    return bool(values) and all(_QUANTITY.fullmatch(value) for value in values)


def _asked(sweep: Document) -> int:
    """How many requirements the plans have."""
    return max((len(p["requirements"]) for p in sweep["points"] if p["status"] == "planned"), default=0)


def csv_rows(sweep: Document) -> list[list[Any]]:
    """One row a point; figures of a point without a plan are empty."""
    with_unit = {key for key in sweep["keys"] if _has_unit(sweep, key)}
    count = _asked(sweep)
    rows = []
    for p in sweep["points"]:
        known = p["status"] == "planned"
        values = [part for k in sweep["keys"] for part in _parts(p["values"][k], k in with_unit)]
        figures = [p[k] if known else None for k in ("time_s", "bound_s", "power_on_s")]
        asked = p["requirements"] if known else []
        reached = [r[k] for r in asked for k in ("limit", "achieved", "unit")]
        why = "" if known else str(p.get("why", "")).replace("\n", " ")
        rows.append([*values, p["status"], *figures, *(reached or [None] * 3 * count), why])
    return rows


def _parts(value: Any, with_unit: bool) -> list[Any]:
    """`11 m` as the number and its unit; the digits as they were written."""
    found = _QUANTITY.fullmatch(str(value)) if with_unit else None
    return [value] if found is None else [found[1], found[2]]


def sweep_table(sweep: Document) -> Table:
    """What each point costs."""
    columns = (*sweep["keys"], "hours", "powered, h", "achieved", "")
    return Table("Hours of the shortest campaign", columns, tuple(_row(sweep, p) for p in sweep["points"]))


def _row(sweep: Document, p: Document) -> tuple[str, ...]:
    values = [str(p["values"][key]) for key in sweep["keys"]]
    if p["status"] != "planned":
        return (*values, NOTHING, NOTHING, NOTHING, _why(p))
    reached = ", ".join(f"{digits(r['achieved'])} {r['unit']}" for r in p["requirements"])
    proof = "" if p["gap"] == 0 else f"gap {100 * p['gap']:.2g} %"
    return (*values, hours(p["time_s"]), hours(p["power_on_s"]), reached, proof)


def _why(p: Document) -> str:
    if p["status"] != "infeasible":
        what = "no answer in time" if p["status"] == "stopped" else "not a spec"
        return f"{what}: {' '.join(str(p.get('why', '')).split())}"[:120]
    binds = ", ".join(b["part"] for b in p.get("binds", [])[:2])
    return f"cannot be met: {binds} bind" if binds else "cannot be met"


# ---------------------------------------------------------------- the report


def sweep_report(sweep: Document) -> Report:
    """The knee, then the curve and every point."""
    planned = [p for p in sweep["points"] if p["status"] == "planned"]
    short = f"{len(planned)} of {len(sweep['points'])} points have a plan"
    if planned:
        times = [p["time_s"] for p in planned]
        short += f", {hours(min(times))} to {hours(max(times))} h"
    key = abscissa(sweep)
    curve = [] if key is None else cheapest_of(sweep, key)
    bend = knee(curve)
    missing = sweep["wanted"] - len(sweep["points"])
    sentences = [
        "" if bend is None or key is None else f"{short[0].upper()}{short[1:]}.",
        f"{missing} points are still to be planned." if missing else "",
    ]
    return Report(
        kind="Sweep of a spec",
        title=sweep["spec"],
        answer=short if bend is None or key is None else knee_words(curve, bend, key).rstrip("."),
        sentences=tuple(filter(None, sentences)),
        facts=facts(("varied", ", ".join(sweep["keys"]))),
        sections=existing(
            section("curve", "Hours against what is asked for", *_curves(sweep), only="page"),
            section("table", "Every point", _cheapest(sweep, curve, key), sweep_table(sweep)),
        ),
    )


def _cheapest(sweep: Document, curve: Sequence[Cheapest], key: str | None) -> Table | None:
    return None if key is None else cheapest_table(sweep, curve, key)


def _curves(sweep: Document) -> Iterator[Block | None]:
    key = abscissa(sweep)
    if key is None:
        yield Text("No key has numbers to draw a curve against.")
        return
    text = f"Hours of the shortest campaign against {key}"
    caption = "Each dot is the proved optimum of one spec; crosses below: cannot be met."
    yield Picture("sweep", text, caption, lambda: _draw(sweep, key))


def _draw(sweep: Document, key: str) -> Figure:
    figure, [[axes]] = theme.fixed_panels([2.7], head=0.3)
    others = [k for k in sweep["keys"] if k != key]
    groups: dict[str, list[Document]] = {}
    for p in sweep["points"]:
        groups.setdefault(", ".join(f"{k} {p['values'][k]}" for k in others), []).append(p)
    unit = unit_of(sweep, key)
    for i, (name, points) in enumerate(groups.items()):
        colour = theme.SERIES[i % len(theme.SERIES)]
        along, up = _line(points, key, unit)
        axes.plot(
            along, up, "o-", color=colour, linewidth=1.5, markersize=4, label=name or "shortest campaign"
        )
    _scale(axes, [p["time_s"] / 3600 for p in sweep["points"] if p["status"] == "planned"])
    lost = [
        x
        for p in sweep["points"]
        if p["status"] != "planned" and (x := number_of(p["values"][key], unit)) is not None
    ]
    bottom = axes.get_ylim()[0]
    axes.plot(lost, [bottom] * len(lost), "x", color=theme.MUTED, markersize=6, clip_on=False)
    axes.set_xlabel(f"{key}, {unit}" if unit else key)
    axes.set_ylabel("campaign, h")
    theme.shared_legend(figure, [axes], 3)
    return figure


def _scale(axes: Axes, values: Sequence[float]) -> None:
    """From zero; logarithmic where the longest campaign would hide all others."""
    if values and max(values) > WIDE * min(values) > 0:
        axes.set_yscale("log")
        theme.plain_numbers(axes.yaxis)
    else:
        axes.set_ylim(bottom=0.0)


def _line(points: Sequence[Document], key: str, unit: str) -> tuple[list[float], list[float]]:
    pairs = [
        (x, p["time_s"] / 3600)
        for p in points
        if p["status"] == "planned" and (x := number_of(p["values"][key], unit)) is not None
    ]
    pairs.sort()
    return [x for x, _ in pairs], [y for _, y in pairs]
