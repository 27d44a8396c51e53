"""How figures look: drawn once, coloured by the page's style sheet, so that dark pages and print both work.

Matplotlib writes colours as literals. Every literal of the palette below is replaced by a CSS variable of
the page with the literal as its fallback, so a figure cut out of the page keeps its light colours.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INK, MUTED, GRID, SURFACE = "#1b1e23", "#5d6570", "#d9dde3", "#fefefe"
BLUE, ORANGE, GREEN, PINK = (
    "#0072b2",
    "#e69f00",
    "#009e73",
    "#cc79a7",
)  # Okabe & Ito 2008: safe for the colour-blind
RED, SKY, GREY, DARK = "#d55e00", "#56b4e9", "#9aa2ad", "#4a5160"
PALE = "#c9ced6"
PURPLE, OLIVE, BROWN, LILAC, TEAL, ROSE = "#6a3d9a", "#b3b846", "#8c5a2b", "#b9a3e3", "#1d6f72", "#e0a0a8"

VARIABLES: Mapping[str, str] = {
    INK: "ink",
    MUTED: "muted",
    GRID: "grid",
    SURFACE: "surface",
    BLUE: "blue",
    ORANGE: "orange",
    GREEN: "green",
    PINK: "pink",
    RED: "red",
    SKY: "sky",
    GREY: "grey",
    DARK: "dark",
    PALE: "pale",
    PURPLE: "purple",
    OLIVE: "olive",
    BROWN: "brown",
    LILAC: "lilac",
    TEAL: "teal",
    ROSE: "rose",
}
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

WIDTH_IN = 9.0  # 648 pt, shown at 900 px: 9 pt letters come out as 12.5 px


def settings(salt: str) -> Any:
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

    with mpl.rc_context():
        mpl.rcdefaults()  # a user's matplotlibrc must not change the bytes
        mpl.rcParams.update(settings(name))
        figure = draw()
        buffer = io.StringIO()
        nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        figure.savefig(buffer, format="svg", metadata=nothing)
    return _inline(buffer.getvalue(), name, description)


def new_figure(height_in: float) -> Figure:
    """An empty figure of the page's width, laid out so that no label is cut."""
    from matplotlib.figure import Figure

    return Figure(figsize=(WIDTH_IN, height_in), layout="constrained")


def _inline(svg: str, name: str, description: str) -> str:
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>\s*", "", body, flags=re.DOTALL)
    body = re.sub(r"<!--.*?-->\s*", "", body, flags=re.DOTALL)
    body = re.sub(r'(\bid="|url\(#|href="#)', rf"\g<1>{name}-", body)
    body = re.sub(r"#[0-9a-f]{6}\b", lambda m: _variable(m[0]), body)
    body = re.sub(r"'DejaVu Sans'(, sans-serif)?", "system-ui, sans-serif", body)
    title = f'<title id="{name}-title">{escape(description)}</title>'
    size = re.search(r'viewBox="([^"]+)"', body)
    box = size[1] if size else f"0 0 {72 * WIDTH_IN:g} 300"
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'viewBox="{box}" role="img" aria-labelledby="{name}-title">{title}'
    )
    return re.sub(r"<svg[^>]*>", lambda _: head, body, count=1)


def _variable(literal: str) -> str:
    name = VARIABLES.get(literal)
    return f"var(--{name}, {literal})" if name else literal
