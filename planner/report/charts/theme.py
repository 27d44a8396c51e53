"""How figures look: one palette, one size of letters, dark on white, and what several charts draw alike."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any, Literal

from planner.report.numbers import digits

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

INK, MUTED, GRID, SURFACE = "#1b1e23", "#5d6570", "#d9dde3", "#ffffff"
# Okabe & Ito 2008: safe for the colour-blind
BLUE, ORANGE, GREEN, PINK = "#0072b2", "#e69f00", "#009e73", "#cc79a7"
RED, SKY, GREY, DARK = "#d55e00", "#56b4e9", "#9aa2ad", "#4a5160"
PALE = "#c9ced6"
PURPLE, OLIVE, BROWN, LILAC, TEAL, ROSE = "#6a3d9a", "#b3b846", "#8c5a2b", "#b9a3e3", "#1d6f72", "#e0a0a8"

SHORT_TO_LONG = ("#2f86c8", "#a08fa0", "#d8852a")  # middle tones: seen on white and on black
SERIES = (BLUE, RED, GREEN, PINK, ORANGE, SKY, DARK, GREY)
TESTS = (PURPLE, OLIVE, BROWN, LILAC, TEAL, ROSE)  # none of the actions' colours: both stand in one chart
ACTION_COLOURS: Mapping[str, str] = {
    "install": DARK,
    "ramp": RED,
    "soak": ORANGE,
    "power_on": GREEN,
    "move": PINK,
    "record": BLUE,
    "power_off": GREEN,
    "cool_down": SKY,
    "pause": PALE,
    "remove": DARK,
}
PART_COLOURS: Mapping[str, str] = {  # cold: stays whatever the campaign does; warm: what the campaign buys
    "run_to_run": BLUE,
    "in_run": SKY,
    "storage": GREY,
    "temperature": ORANGE,
    "estimate": RED,
}

FRAMED: Mapping[str, Any] = {  # a legend that curves may run behind
    "frameon": True,
    "facecolor": SURFACE,
    "edgecolor": "none",
    "framealpha": 0.75,
}
_FEW_DECADES = 2.0
BAR = 0.95  # inches for a colour bar with its numbers and label
WIDTH_IN = 9.0  # 648 pt, shown at 900 px: 9 pt letters come out as 12.5 px


def _settings(salt: str) -> Any:
    """Matplotlib settings of one figure; `salt` keeps its ids apart from other figures on the page."""
    return {
        "svg.fonttype": "none",
        "svg.hashsalt": salt,
        "font.family": ["sans-serif"],
        "font.sans-serif": ["DejaVu Sans"],
        "font.size": 9.0,
        "axes.titlesize": 9.5,
        "axes.titlelocation": "left",
        "axes.labelsize": 9.0,
        "legend.fontsize": 8.5,
        "legend.frameon": False,
        "text.color": INK,
        "axes.labelcolor": INK,
        "axes.edgecolor": MUTED,
        "xtick.color": MUTED,
        "ytick.color": MUTED,
        "xtick.labelcolor": INK,
        "ytick.labelcolor": INK,
        "axes.facecolor": "none",
        "figure.facecolor": "none",
        "axes.grid": True,
        "axes.titley": 1.0,  # else every axis is laid out twice, to see whether its numbers stand above
        "axes.axisbelow": True,
        "grid.color": GRID,
        "grid.linewidth": 0.6,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.unicode_minus": True,
        "path.simplify": True,
        "mathtext.default": "regular",
    }


def drawn(name: str, description: str, draw: Callable[[], Figure]) -> str:
    """Inline SVG of the figure that `draw` returns: themed, accessible, the same bytes every time.

    `draw` runs under our settings, which leave no trace in matplotlib's own.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    with mpl.rc_context():
        mpl.rcdefaults()  # a user's matplotlibrc must not change the bytes
        mpl.rcParams.update(_settings(name))
        figure, buffer = draw(), io.StringIO()
        nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        # the canvas itself: savefig draws every figure twice, the first time to throw it away
        canvas: Any = FigureCanvasSVG(figure)  # matplotlib has no types for print_svg
        canvas.print_svg(buffer, metadata=nothing)
    return _inline(buffer.getvalue(), name, description)


def _inline(svg: str, name: str, description: str) -> str:
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>\s*", "", body, flags=re.DOTALL)
    body = re.sub(r"<!--.*?-->\s*", "", body, flags=re.DOTALL)
    body = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{name}-", body)
    body = re.sub(r"'DejaVu Sans'(, sans-serif)?", "system-ui, sans-serif", body)
    title = f'<title id="{name}-title">{escape(description)}</title>'
    size = re.search(r'viewBox="([^"]+)"', body)
    box = size[1] if size else f"0 0 {72 * WIDTH_IN:g} 300"
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'viewBox="{box}" role="img" aria-labelledby="{name}-title">{title}'
    )
    return re.sub(r"<svg[^>]*>", lambda _: head, body, count=1)


@dataclass(frozen=True)
class Room:
    """Inches beside each panel for what stands there: nothing is measured, so that a chart costs half.

    left: of the first panel of a row, between: of the others; left and below: numbers and one label
    above: 0.3 with a title
    """

    left: float = 0.8
    right: float = 0.15
    above: float = 0.1
    below: float = 0.5
    between: float = 0.8


def fixed_panels(
    heights: Sequence[float],
    across: int = 1,
    room: Room = Room(),
    *,
    head: float = 0.0,
    foot: float = 0.0,
    beside: float = 0.0,
    share: Literal["x", "y", ""] = "",
) -> tuple[Figure, list[list[Axes]]]:
    """Rows of panels in fixed places; heights: of their frames. All in inches.

    head, foot: for legends, beside: for a colour bar; share: the first panel's axis, that all others have too
    """
    from matplotlib.figure import Figure

    high = head + sum(heights) + len(heights) * (room.above + room.below) + foot
    figure = Figure(figsize=(WIDTH_IN, high))
    gaps = room.left + (across - 1) * room.between + across * room.right + beside
    wide = (WIDTH_IN - gaps) / across
    found, y = list[list["Axes"]](), high - head
    for row, height in enumerate(heights, 1):
        y -= room.above + height
        line = list["Axes"]()
        for column in range(across):
            x = room.left + column * (wide + room.right + room.between)
            place = (x / WIDTH_IN, y / high, wide / WIDTH_IN, height / high)
            first = (found[0] if found else line)[:1]
            known: Any = {f"share{share}": first[0]} if share and first else {}
            line.append(figure.add_axes(place, **known))
            if share == "y" and column:
                line[-1].tick_params(axis="y", labelleft=False)
            if share == "x" and row < len(heights):
                line[-1].tick_params(axis="x", labelbottom=False)
        found.append(line)
        y -= room.below
    return figure, found


def grid_of_panels(
    count: int, across: int, height: float, room: Room = Room(), **around: Any
) -> tuple[Figure, list[Axes]]:
    """`count` fixed panels in rows of `across`; around: as for `fixed_panels`."""
    across = min(across, count)
    figure, rows = fixed_panels([height] * -(-count // across), across, room, **around)
    every = [axes for row in rows for axes in row]
    for spare in every[count:]:
        spare.set_visible(False)
    return figure, every[:count]


def colour_bar(figure: Figure, shown: ScalarMappable, panels: Sequence[Axes], label: str) -> None:
    """As high as the panels, which left BAR beside them."""
    places = [axes.get_position() for axes in panels]
    low, high = min(p.y0 for p in places), max(p.y1 for p in places)
    place = (1.0 - (BAR - 0.1) / WIDTH_IN, low, 0.15 / WIDTH_IN, high - low)
    figure.colorbar(shown, cax=figure.add_axes(place), label=label)


def lines(names: int, columns: int) -> float:
    """Inches of a legend of so many names in columns."""
    return 0.15 + 0.18 * -(-names // columns)


def letters(names: Iterable[str]) -> float:
    """Inches that the longest of some names takes."""
    return 0.069 * max(map(len, names), default=0) + 0.08


def shared_legend(
    figure: Figure,
    panels: Sequence[Axes],
    columns: int,
    loc: Literal["upper left", "lower left"] = "upper left",
) -> None:
    """One legend of all panels in the figure's head or foot, each label once."""
    handles = {
        label: line for axes in panels for line, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(handles.values(), handles.keys(), loc=loc, ncols=columns)


def stacked_bars(
    axes: Axes,
    names: Sequence[str],
    parts: Mapping[str, tuple[str, Sequence[float]]],
    total: Callable[[float], str],
) -> None:
    """Bars across, one a name, their totals at the ends; parts: of the budget -> label, lengths by name."""
    left = [0.0] * len(names)
    for part, (label, widths) in parts.items():
        axes.barh(names, widths, left=left, height=0.62, color=PART_COLOURS[part], label=label)
        left = [a + b for a, b in zip(left, widths, strict=True)]
    for name, value in zip(names, left, strict=True):
        axes.annotate(total(value), (value, name), (4, 0), textcoords="offset points", va="center")
    axes.invert_yaxis()
    axes.set_xlim(0.0, max(*left, 1e-12) * 1.12)
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="y", visible=False)


def plain_numbers(axis: Axis, said: Callable[[float], str] = digits) -> None:
    """Numbers as pages write them, instead of `6 × 10¹`."""
    from matplotlib.ticker import FuncFormatter, NullFormatter

    axis.set_major_formatter(FuncFormatter(lambda value, _: said(value)))
    axis.set_minor_formatter(NullFormatter())


def plain_decades(axis: Axis) -> None:
    """Powers of ten in letters, plain numbers between a hundredth and a thousand."""
    plain_numbers(axis, _decade)


def readable_log(axis: Axis) -> None:
    """A logarithmic axis whose numbers can be read: 1, 2, 5 of each decade where it has few of them."""
    from matplotlib.ticker import LogLocator

    low, high = axis.get_view_interval()
    few = low > 0 and math.log10(high / low) < _FEW_DECADES
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
    plain_decades(axis)


def _decade(value: float) -> str:
    power = round(math.log10(value)) if value > 0 else 0
    raised = str(power).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return digits(value) if -2 <= power <= 3 else f"10{raised}"
