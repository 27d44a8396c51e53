"""Panels of dots, lines and bands as SVG, written straight: the charts of a diagnosis, without matplotlib.

Matplotlib takes half a second to import and a second to measure its letters; here every place is fixed.
Lengths are points on a page 648 wide, as in `theme`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from planner.nouns.array import Array
from planner.report.charts.theme import GRID, INK, MUTED, WIDTH_IN
from planner.report.numbers import digits

WIDTH = 72.0 * WIDTH_IN
LETTER = 0.56  # of a letter's size: its mean width
TICKS = 6  # about so many on an axis
_SIZE, _SMALL = 9.0, 8.5
_LEFT, _RIGHT, _TOP, _BELOW, _NUMBERS, _GAP = 54.0, 11.0, 25.0, 40.0, 18.0, 18.0
_TITLE = 13.0


# ---------------------------------------------------------------- scales


@dataclass(frozen=True)
class Scale:
    """Values low … high along an axis.

    linear: up to there the scale is, and then logarithmic (None: throughout)
    share: of a decade's length that the linear part has; marks: the values that are written; () chooses them
    names: what stands there instead of the numbers
    """

    low: float
    high: float
    linear: float | None = None
    share: float = 1.0
    marks: tuple[float, ...] = ()
    names: tuple[str, ...] = ()

    def at(self, values: Array) -> Array:
        """0 at the low end, 1 at the high one; (n,) values."""
        low, high = self._along(np.array([self.low, self.high]))
        return np.asarray((self._along(np.asarray(values, dtype=float)) - low) / ((high - low) or 1.0))

    def _along(self, x: Array) -> Array:
        if self.linear is None:
            return x
        inner = self.share / 0.9
        size = np.maximum(np.abs(x) / self.linear, 1e-300)
        return np.asarray(
            np.where(size <= 1.0, x / self.linear * inner, np.sign(x) * (inner + np.log10(size)))
        )

    def ticks(self) -> list[tuple[float, str]]:
        """Values and what is written there."""
        if self.names:
            return list(zip(self.marks, self.names, strict=True))
        if self.marks:
            return [(v, digits(v)) for v in self.marks if self.low <= v <= self.high]
        step = _round_step((self.high - self.low) / TICKS)
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        decimals = max(0, -math.floor(math.log10(step) + 1e-9))
        return [(k * step, f"{k * step:.{decimals}f}".replace("-", "−")) for k in range(first, last + 1)]


def _round_step(least: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    if not math.isfinite(least) or least <= 0.0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(least))
    return power * next(k for k in (1.0, 2.0, 5.0, 10.0) if k * power >= least * (1.0 - 1e-9))


def around(values: Array, room: float = 0.05) -> Scale:
    """A linear scale that holds the values (n,) with a share of room at both ends."""
    low, high = float(np.min(values)), float(np.max(values))
    more = room * (high - low) or max(abs(high), 1.0) * room
    return Scale(low - more, high + more)


# ---------------------------------------------------------------- marks


@dataclass(frozen=True)
class Dots:
    """A dot for every (x, y) within the panel; square: instead of round; radius in points."""

    x: Array
    y: Array
    colour: str
    radius: float
    opacity: float = 1.0
    square: bool = False
    label: str = ""

    def drawn(self, p: Panel) -> Iterator[str]:
        """A path of strokes without length, whose ends are the dots."""
        x, y = p.place(self.x, self.y)
        inside = (
            np.isfinite(x) & np.isfinite(y) & (y >= p.top) & (y <= p.bottom) & (x >= p.left) & (x <= p.right)
        )
        where = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(x[inside], y[inside], strict=True))
        cap = "square" if self.square else "round"
        if where:
            yield (
                f'<path d="{where}" fill="none" stroke="{self.colour}" stroke-width="{2 * self.radius:g}" '
                f'stroke-linecap="{cap}" stroke-opacity="{self.opacity:g}"/>'
            )


@dataclass(frozen=True)
class Line:
    """Through all (x, y); dashed or not."""

    x: Array
    y: Array
    colour: str
    width: float = 1.5
    dashed: bool = False
    label: str = ""

    def drawn(self, p: Panel) -> Iterator[str]:
        """A polyline that ends at the panel's edges, not beyond."""
        x, y = p.place(self.x, self.y)
        points = " ".join(
            f"{a:.1f},{b:.1f}"
            for a, b in zip(x, np.clip(y, p.top, p.bottom), strict=True)
            if math.isfinite(a + b)
        )
        dash = ' stroke-dasharray="4.5 2.5"' if self.dashed else ""
        yield (
            f'<polyline points="{points}" fill="none" stroke="{self.colour}" '
            f'stroke-width="{self.width:g}"{dash}/>'
        )


@dataclass(frozen=True)
class Bars:
    """Intervals low … high (n,) at x (n,), with caps."""

    x: Array
    low: Array
    high: Array
    colour: str
    width: float = 1.2
    cap: float = 2.5

    def drawn(self, p: Panel) -> Iterator[str]:
        """A path of uprights and their caps."""
        x, low = p.place(self.x, self.low)
        _, high = p.place(self.x, self.high)
        low, high = np.clip(low, p.top, p.bottom), np.clip(high, p.top, p.bottom)
        c = self.cap
        where = "".join(
            f"M{a - c:.1f} {b:.1f}h{2 * c:g}M{a - c:.1f} {t:.1f}h{2 * c:g}M{a:.1f} {b:.1f}V{t:.1f}"
            for a, b, t in zip(x, low, high, strict=True)
            if math.isfinite(a + b + t)
        )
        yield f'<path d="{where}" fill="none" stroke="{self.colour}" stroke-width="{self.width:g}"/>'


@dataclass(frozen=True)
class Band:
    """A stripe across the panel between two values."""

    low: float
    high: float
    colour: str
    opacity: float
    label: str = ""

    def drawn(self, p: Panel) -> Iterator[str]:
        """A rectangle."""
        _, y = p.place(np.zeros(2), np.array([self.high, self.low]))
        top, bottom = np.clip(y, p.top, p.bottom)
        yield (
            f'<rect x="{p.left:.1f}" y="{top:.1f}" width="{p.right - p.left:.1f}" '
            f'height="{bottom - top:.1f}" fill="{self.colour}" fill-opacity="{self.opacity:g}"/>'
        )


Mark = Dots | Line | Bars | Band


# ---------------------------------------------------------------- panels


@dataclass(frozen=True)
class Axes:
    """What a panel shows; numbers: whether y's are written."""

    x: Scale
    y: Scale
    marks: Sequence[Mark]
    x_label: str = ""
    y_label: str = ""
    title: str = ""
    numbers: bool = True


@dataclass(frozen=True)
class Panel:
    """Axes at a place on the sheet."""

    axes: Axes
    left: float
    right: float
    top: float
    bottom: float

    def place(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Points on the sheet."""
        across = self.left + self.axes.x.at(x) * (self.right - self.left)
        return across, self.bottom - self.axes.y.at(y) * (self.bottom - self.top)

    def drawn(self) -> Iterator[str]:
        """Grid, marks, axes, letters."""
        at_x = [
            (float(self.place(np.array([v]), np.zeros(1))[0][0]), name) for v, name in self.axes.x.ticks()
        ]
        at_y = [
            (float(self.place(np.zeros(1), np.array([v]))[1][0]), name) for v, name in self.axes.y.ticks()
        ]
        grid = "".join(f"M{x:.1f} {self.top:.1f}V{self.bottom:.1f}" for x, _ in at_x)
        grid += "".join(f"M{self.left:.1f} {y:.1f}H{self.right:.1f}" for y, _ in at_y)
        yield f'<path d="{grid}" fill="none" stroke="{GRID}" stroke-width="0.6"/>'
        for mark in self.axes.marks:
            yield from mark.drawn(self)
        frame = f"M{self.left:.1f} {self.top:.1f}V{self.bottom:.1f}H{self.right:.1f}"
        yield f'<path d="{frame}" fill="none" stroke="{MUTED}" stroke-width="0.8"/>'
        yield from (_text(x, self.bottom + 11.5, name, "middle") for x, name in at_x)
        if self.axes.numbers:
            yield from (_text(self.left - 4.0, y + 3.0, name, "end") for y, name in at_y)
        if self.axes.x_label:
            yield _text((self.left + self.right) / 2, self.bottom + 24.0, self.axes.x_label, "middle")
        if self.axes.y_label:
            middle = (self.top + self.bottom) / 2
            yield _text(self.left - 40.0, middle, self.axes.y_label, "middle", turned=True)
        if self.axes.title:
            yield _text(self.left, self.top - 5.0, self.axes.title, "start")


def _text(x: float, y: float, text: str, anchor: str, size: float = _SIZE, *, turned: bool = False) -> str:
    turn = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if turned else ""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size:g}px" font-family="system-ui, sans-serif" '
        f'text-anchor="{anchor}" fill="{INK}"{turn}>{escape(text)}</text>'
    )


# ---------------------------------------------------------------- sheets


@dataclass(frozen=True)
class Sheet:
    """Rows of panels below one legend, in fixed places; row: height of each in points.

    titled: whether rows need room for titles; spaced: whether every panel has numbers of its own
    """

    rows: Sequence[Sequence[Axes]]
    across: int
    row: float
    titled: bool = False
    spaced: bool = False

    def panels(self) -> Iterator[Panel]:
        """Every panel in its place."""
        gap = _LEFT if self.spaced else _GAP
        wide = (WIDTH - _LEFT - _RIGHT - (self.across - 1) * gap) / self.across
        above = _TITLE if self.titled else 0.0
        below = _BELOW if any(a.x_label for line in self.rows for a in line) else _NUMBERS
        for r, line in enumerate(self.rows):
            for c, a in enumerate(line):
                left, top = _LEFT + c * (wide + gap), self._top + r * self.row + above
                yield Panel(a, left, left + wide, top, self._top + (r + 1) * self.row - below)

    @property
    def _top(self) -> float:
        return _TOP if self._labels() else 6.0

    def _labels(self) -> dict[str, Mark]:
        marks = (m for line in self.rows for a in line for m in a.marks)
        return {m.label: m for m in marks if not isinstance(m, Bars) and m.label}

    def svg(self, name: str, alt: str) -> str:
        """Inline SVG: title for who cannot see it, legend, panels."""
        height = self._top + self.row * len(self.rows)
        body = "\n".join([*self._explained(), *(part for p in self.panels() for part in p.drawn())])
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {height:g}" role="img" '
            f'aria-labelledby="{name}-title"><title id="{name}-title">{escape(alt)}</title>\n{body}\n</svg>'
        )

    def _explained(self) -> Iterable[str]:
        """The legend: every label once, in a line above all panels."""
        x, y = 8.0, 12.0
        for label, mark in self._labels().items():
            key = np.array([x, x + 17.0]), np.array([y - 3.0, y - 3.0])
            if isinstance(mark, Band):
                yield (
                    f'<rect x="{x:.1f}" y="{y - 6.0:.1f}" width="17" height="6" fill="{mark.colour}" '
                    f'fill-opacity="{mark.opacity:g}"/>'
                )
            else:
                yield from _sample(mark, *key)
            yield _text(x + 22.0, y, label, "start", _SMALL)
            x += 22.0 + LETTER * _SMALL * len(label) + 16.0


def _sample(mark: Dots | Line | Bars, x: Array, y: Array) -> Iterator[str]:
    """A line's or a dot's sample in the legend, in points of the sheet."""
    if isinstance(mark, Line):
        dash = ' stroke-dasharray="4.5 2.5"' if mark.dashed else ""
        yield (
            f'<path d="M{x[0]:.1f} {y[0]:.1f}H{x[1]:.1f}" stroke="{mark.colour}" '
            f'stroke-width="{mark.width:g}"{dash}/>'
        )
    elif isinstance(mark, Dots):
        cap = "square" if mark.square else "round"
        yield (
            f'<path d="M{x.mean():.1f} {y[0]:.1f}h0" stroke="{mark.colour}" '
            f'stroke-width="{2 * mark.radius:g}" stroke-linecap="{cap}"/>'
        )
