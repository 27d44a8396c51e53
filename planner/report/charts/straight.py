"""Charts straight to SVG: panels of dots, lines, intervals on linear, logarithmic or mixed scales.

Loading and running a plotting package for three charts of dots took 0.4 s of a diagnosis of four. Lengths in
points, y downwards, 648 across as other charts of a page (`theme.WIDTH_IN`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np

from planner.nouns.array import Array
from planner.report.charts import theme
from planner.report.numbers import digits

Values = Array | Sequence[float]
WIDTH = 72.0 * theme.WIDTH_IN
LETTER = 0.55  # of the size of letters, how wide one is
_NICE = (1.0, 2.0, 2.5, 5.0, 10.0)
_ROOM = 4.0  # between an axis and its numbers


@dataclass(frozen=True)
class Scale:
    """From `low` to `high`. linear: linear up to there and then logarithmic; 0 logarithmic throughout

    ticks: values with a number; share: decades that the linear part is as long as, on each side
    """

    low: float
    high: float
    ticks: tuple[float, ...]
    linear: float = math.inf
    share: float = 1.0

    def at(self, values: Values) -> Array:
        """(n,) 0 at `low` … 1 at `high`."""
        low, high = (float(self._along(np.array([end]))[0]) for end in (self.low, self.high))
        return np.asarray((self._along(np.asarray(values, dtype=float)) - low) / (high - low))

    def _along(self, x: Array) -> Array:
        if math.isinf(self.linear):
            return x
        if self.linear == 0.0:
            return np.log10(np.maximum(x, 1e-300))
        size = np.maximum(np.abs(x) / self.linear, 1e-300)
        return np.sign(x) * np.where(
            size <= 1.0, self.share * size, self.share + np.log10(np.maximum(size, 1.0))
        )


def linear(low: float, high: float, count: int = 5) -> Scale:
    """A linear scale with at most so many steps between its round numbers."""
    if not high > low:
        low, high = low - 0.5, high + 0.5
    raw = (high - low) / count
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(n * power for n in _NICE if n * power >= raw * (1.0 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return Scale(low, high, tuple(k * step for k in range(first, last + 1)))


def logarithmic(low: float, high: float) -> Scale:
    """A logarithmic scale with 1, 2, 5 of each decade where it has few of them."""
    few = math.log10(high / low) < 2.0
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    ticks = (n * 10.0**k for k in decades for n in ((1.0, 2.0, 5.0) if few else (1.0,)))
    return Scale(low, high, tuple(t for t in ticks if low <= t <= high), 0.0)


def around(values: Array, share: float = 0.05) -> tuple[float, float]:
    """The ends of some values with room beside them."""
    low, high = float(np.min(values)), float(np.max(values))
    room = share * (high - low) or max(abs(high), 1.0) * share
    return low - room, high + room


@dataclass
class Panel:
    """One pair of axes. left, top, wide, high: its frame; numbers: whether the y axis has some

    marks: value and word in place of numbers of the x axis
    """

    left: float
    top: float
    wide: float
    high: float
    x: Scale
    y: Scale
    title: str = ""
    across: str = ""
    up: str = ""
    numbers: bool = True
    marks: Sequence[tuple[float, str]] = ()
    drawn: list[str] = field(default_factory=list)

    def band(self, low: float, high: float, colour: str, opacity: float) -> None:
        """A stretch of y from side to side."""
        bottom, top = self._down([low, high])
        self.drawn.append(
            f'<rect x="{self.left:.1f}" y="{top:.1f}" width="{self.wide:.1f}" height="{bottom - top:.1f}" '
            f'fill="{colour}" fill-opacity="{opacity}"/>'
        )

    def level(self, value: float) -> None:
        """A thin line from side to side."""
        self.line([self.x.low, self.x.high], [value, value], theme.MUTED, 0.7)

    def line(
        self,
        x: Values,
        y: Values,
        colour: str,
        width: float,
        dash: str = "",
    ) -> None:
        """Through points (n,), (n,)."""
        way = "L".join(self._points(x, y))
        dashed = f' stroke-dasharray="{dash}"' if dash else ""
        self._stroke(f"M{way}" if way else "", colour, width, dashed)

    def dots(
        self, x: Values, y: Values, colour: str, size: float,
        opacity: float = 1.0, *, square: bool = False,
    ) -> None:  # fmt: skip
        """Points (n,), (n,) as discs or squares: ends of lines of no length."""
        way = "".join(f"M{point}h0" for point in self._points(x, y))
        cap = "square" if square else "round"
        self._stroke(way, colour, size, f' stroke-linecap="{cap}" stroke-opacity="{opacity}"')

    def intervals(self, x: Array, low: Array, high: Array, colour: str, cap: float = 2.5) -> None:
        """From low to high (n,), with ends."""
        at, down, above = self._right(x), self._down(low), self._down(high)
        way = "".join(
            f"M{a:.1f} {b:.1f}V{c:.1f}M{a - cap:.1f} {b:.1f}h{2 * cap}M{a - cap:.1f} {c:.1f}h{2 * cap}"
            for a, b, c in zip(at, down, above, strict=True)
            if math.isfinite(b) and math.isfinite(c)
        )
        self._stroke(way, colour, 1.1)

    def _stroke(self, way: str, colour: str, width: float, more: str = "") -> None:
        if way:
            self.drawn.append(f'<path d="{way}" stroke="{colour}" stroke-width="{width}"{more}/>')

    def _points(self, x: Values, y: Values) -> list[str]:
        pairs = zip(self._right(x), self._down(y), strict=True)
        return [f"{a:.1f} {b:.1f}" for a, b in pairs if math.isfinite(a) and math.isfinite(b)]

    def _right(self, x: Values) -> Array:
        return np.asarray(self.left + self.wide * self.x.at(x))

    def _down(self, y: Values) -> Array:
        beyond = np.clip(self.y.at(y), -1.0, 2.0)  # a spike is cut at the frame, wherever it ends
        return np.asarray(self.top + self.high * (1.0 - beyond))

    def svg(self, clip: str) -> str:
        """The panel: grid, what is drawn within the frame, axes, words. clip: id of its frame."""
        bottom = self.top + self.high
        words, grid = [], []
        for value, word in self.marks or [(t, digits(t)) for t in self.x.ticks]:
            (at,) = self._right([value])
            grid.append(f"M{at:.1f} {self.top:.1f}V{bottom:.1f}")
            words.append(_text(at, bottom + _ROOM + 8.0, word, "middle"))
        for t in self.y.ticks:
            (at,) = self._down([t])
            grid.append(f"M{self.left:.1f} {at:.1f}h{self.wide:.1f}")
            if self.numbers:
                words.append(_text(self.left - _ROOM, at + 3.0, digits(t), "end"))
        words += [_text(self.left, self.top - 5.0, self.title, "start")] if self.title else []
        if self.across:
            words.append(_text(self.left + self.wide / 2.0, bottom + _ROOM + 20.0, self.across, "middle"))
        if self.up:
            x, y = self.left - 42.0, self.top + self.high / 2.0
            words.append(_text(x, y, self.up, "middle", f' transform="rotate(-90 {x:.1f} {y:.1f})"'))
        frame = f'x="{self.left:.1f}" y="{self.top:.1f}" width="{self.wide:.1f}" height="{self.high:.1f}"'
        return (
            f'<clipPath id="{clip}"><rect {frame}/></clipPath>'
            f'<path d="{"".join(grid)}" stroke="{theme.GRID}" stroke-width="0.6"/>'
            f'<g clip-path="url(#{clip})">{"".join(self.drawn)}</g>'
            f'<path d="M{self.left:.1f} {self.top:.1f}V{bottom:.1f}h{self.wide:.1f}" stroke="{theme.MUTED}" '
            f'stroke-width="0.8"/><g stroke="none" fill="{theme.INK}">{"".join(words)}</g>'
        )


@dataclass(frozen=True)
class Entry:
    """One entry of a legend. look: `dots`, `squares`, `line`, `dashes`, `band`."""

    label: str
    colour: str
    look: str


@dataclass(frozen=True)
class Chart:
    """Panels under one legend. high: of the whole, points."""

    panels: Sequence[Panel]
    high: float
    legend: Sequence[Entry] = ()

    def svg(self, name: str, alt: str) -> str:
        """Inline SVG, the same bytes every time. name: of its ids on the page; alt: what it shows."""
        body = "".join(p.svg(f"{name}-frame{i}") for i, p in enumerate(self.panels))
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH:g} {self.high:g}" role="img" '
            f'aria-labelledby="{name}-title" font-family="system-ui, sans-serif" font-size="9" fill="none">'
            f'<title id="{name}-title">{escape(alt)}</title>{self._legend()}{body}</svg>'
        )

    def _legend(self) -> str:
        out, x = [], 6.0
        for e in self.legend:
            out += [_LOOKS[e.look].format(x=x, colour=e.colour), _text(x + 26.0, 14.0, e.label, "start")]
            x += 44.0 + 9.0 * LETTER * len(e.label)
        return f'<g fill="{theme.INK}">{"".join(out)}</g>' if out else ""


_LOOKS = {
    "dots": '<path d="M{x} 11h20" stroke="{colour}" stroke-width="1.4"/><circle cx="{x}" cy="11" r="2.2" '
    'transform="translate(10)" fill="{colour}"/>',
    "squares": '<path d="M{x} 11h20" stroke="{colour}" stroke-width="1.4"/><rect x="{x}" y="9" width="4" '
    'height="4" transform="translate(8)" fill="{colour}"/>',
    "dashes": '<path d="M{x} 11h20" stroke="{colour}" stroke-width="1.3" stroke-dasharray="4 2"/>',
    "band": '<rect x="{x}" y="7" width="20" height="8" fill="{colour}" fill-opacity="0.45"/>',
}  # fmt: skip


def _text(x: float, y: float, word: str, anchor: str, more: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{more}>{escape(word)}</text>'
