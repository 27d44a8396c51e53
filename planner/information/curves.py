"""Second moments of every family of temperature curves that the promise must hold for.

A curve's size is its own scale times a shape (`planner.simulate.temperature_curves`); shapes that know no
table are drawn once for all errors, and so is what tables leave of them.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from planner.information.smooth import Moments
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.protocols import SENSORS, Sensor
from planner.simulate.curves.cosines import Cosines
from planner.simulate.curves.grid import Shape, Single, along, centred, largest_left
from planner.simulate.curves.measured import SeveralUnits
from planner.simulate.families import curve_families
from planner.simulate.temperature_curves import (
    LARGEST,
    CurveFamily,
    TableCurves,
    no_larger,
    second_moment,
    sizes_of,
)
from planner.spec.curve_names import families_of
from planner.spec.model import PercentileRule, Spec

CURVES = 2000  # drawn of every family: a second moment is then known to 2 % in sigma, a part of the whole
UNSEEN = 8000, 32_000  # others, by which what was chosen is judged; not kept, they are drawn block by block
TAIL = 3.0  # times the median size, beyond which a prior takes no curve of a shape
BEYOND = 160  # of them beyond a requirement's share: these make its quantile
BLOCK = 500
EVENLY = 4 * BLOCK  # curves that are drawn evenly at once: what there is of them is 8 MB
MOST_SHAPES = 16  # of unseen curves, of which a process remembers what it looked at: plans are of few tables
MOST_KEPT = (
    8  # shapes of the others, 20 MB each with what was looked at: the next plan of a process has the same
)
MOST_POINTS = (
    400  # temperatures at which curves and their second moments are kept, or twice as many as are asked
)


@dataclass(frozen=True)
class Curves:
    """The families of a spec; what is drawn of a shape is kept.

    unseen: whether they are others, and more, than those by which a campaign is searched: the one that is
    found is the luckiest of thousands under the curves that chose it
    on_offer: (N,) temperatures that campaigns may ask for, looked at together when the first one asks
    tamed: whether none is larger than TAIL times the median of its shape
    """

    spec: Spec
    drawn: dict[Hashable, _Drawn] = field(default_factory=dict)
    unseen: bool = False
    on_offer: Array = field(default_factory=lambda: np.empty(0))
    tamed: bool = False
    known: _Known = field(default_factory=lambda: _Known(), repr=False, compare=False)

    def under(self, spec: Spec) -> Curves:
        """Those of another spec: the same ones where its budgets have the same curves."""
        if _curved(spec) == _curved(self.spec):
            return self
        return replace(self, spec=spec, known=_Known())

    def moments(self, degc: Array) -> dict[str, Moments]:
        """family -> (sensor, effect) -> (N, N) second moment at temperatures (N,) ascending, SI².

        One campaign after the other is asked for at much the same temperatures: these are found once.
        """
        known = self.known
        if not np.isin(degc, known.degc).all():
            every = np.union1d(np.union1d(known.degc, self.on_offer), degc)
            known.degc = every if len(every) <= max(MOST_POINTS, 2 * len(degc)) else degc
            known.moments = {
                name: {error: self._moment(family, known.degc) for error, family in each.items()}
                for name, each in self._families.items()
            }
        place = np.ix_(*[np.searchsorted(known.degc, degc)] * 2)
        return {
            name: {error: moment[place] for error, moment in each.items()}
            for name, each in known.moments.items()
        }

    def prior(self, error: tuple[Sensor, str], degc: Array) -> Array | None:
        """(N, N) of one error, the mean over the families, as smooth tables take it; None without a curve."""
        each = [family[error] for family in self._families.values() if error in family]
        return np.mean([self.of_prior._moment(one, degc) for one in each], axis=0) if each else None

    @cached_property
    def of_prior(self) -> Curves:
        """Those that make the prior of smooth tables: the same ones for search, judge and `calibrate`.

        Where a table says little of slopes, a few nearly straight curves are most of a second moment, others
        in every draw: none is taken as larger than TAIL times the median of its shape.
        """
        return Curves(self.spec, self.drawn, on_offer=self.on_offer, tamed=True)

    def means(self, degc: Array) -> dict[tuple[Sensor, str], Array]:
        """(N,) what all units have in common at temperatures (N,), SI: of curves measured on several units.

        The other curves are as likely as their opposites.
        """
        known = next(iter(self._families.values()), {})  # measured on several units, they are so in each
        several = {error: one for error, one in known.items() if isinstance(one, SeveralUnits)}
        return {error: along(degc, one.grid, one.mean) for error, one in several.items()}

    def pool(self, name: str, error: tuple[Sensor, str], degc: Array) -> NDArray[np.float32]:
        """(N, n) curves of one error and family at temperatures (N,), SI."""
        return np.ascontiguousarray(self._seen(self._families[name][error], degc).T, dtype=np.float32)

    def slopes(self, degc: Array) -> dict[ErrorName, Array]:
        """Error -> (N,) slopes at temperatures (N,), root mean square over curves and families, SI/K."""
        found: dict[ErrorName, list[Array]] = {}
        for each in self.slopes_by_family(degc).values():
            for error, slopes in each.items():
                found.setdefault(error, []).append(slopes**2)
        return {error: np.sqrt(np.mean(squares, axis=0)) for error, squares in found.items()}

    def slopes_by_family(self, degc: Array) -> dict[str, dict[ErrorName, Array]]:
        """Family -> error -> (N,) slopes at temperatures (N,), root mean square over its curves, SI/K."""
        return {
            name: {error: steep[_segments(grid, degc)] for error, (grid, steep) in each.items()}
            for name, each in self._steepness.items()
        }

    @cached_property
    def _steepness(self) -> dict[str, dict[ErrorName, tuple[Array, Array]]]:
        """Family -> error -> (G,) grid and (G - 1,) root mean squares of the slopes between its points."""
        return {
            name: {
                ErrorName.of(*error): (family.grid, np.sqrt(self._squares_of_slopes(family)))
                for error, family in each.items()
            }
            for name, each in self._families.items()
        }

    def _squares_of_slopes(self, family: CurveFamily) -> Array:
        """(G - 1,) mean squares between the points of a family's grid, (SI/K)²."""
        if not isinstance(family, TableCurves) or family.figure == "sigma":
            squares = np.sum(np.diff(family.rows(CURVES, self._rng()), axis=1) ** 2, axis=0)
        else:
            known = self._kept(family.shape)
            known.look(np.empty(0), self.on_offer, family)
            squares = known.scales(family) ** 2 @ known.steps / CURVES
        return np.asarray(squares / np.diff(family.grid) ** 2)

    @cached_property
    def _families(self) -> dict[str, dict[tuple[Sensor, str], CurveFamily]]:
        return {name: curve_families(self.spec, name) for name in families_of(self.spec)}

    @property
    def _count(self) -> int:
        return unseen_curves(self.spec) if self.unseen else CURVES

    def _rng(self) -> np.random.Generator:
        seed = self.spec.plan.seed
        return np.random.default_rng([seed, 1] if self.unseen else seed)

    def _moment(self, family: CurveFamily, degc: Array) -> Array:
        if not isinstance(family, TableCurves) or family.figure == "sigma":
            return second_moment(family, degc, self._count, self._rng())
        seen = self._seen(family, degc)
        return np.asarray(seen.T @ seen / len(seen))

    def _seen(self, family: CurveFamily, degc: Array) -> Array:
        """(n, N) curves of a family; those that differ by their scale only are drawn once."""
        if not isinstance(family, TableCurves) or family.figure == "sigma":
            return along(degc, family.grid, family.draws(self._count, self._rng()))
        known = self._redrawn(family.shape) if self.unseen else self._kept(family.shape)
        known.look(degc, self.on_offer, family)
        scales = known.scales(family)
        if self.tamed:
            scales = no_larger(scales, known.sizes, TAIL * float(np.median(scales * known.sizes)))
        return np.asarray(known.at(degc, family) * scales[:, None])

    def _kept(self, shape: Shape) -> _Drawn:
        key = (_key(shape), self.spec.plan.seed)
        if key not in self.drawn:
            self.drawn[key] = _remembered(_KEPT, MOST_KEPT, key, lambda: self._drawn_once(shape))
        return self.drawn[key]

    def _drawn_once(self, shape: Shape) -> _Drawn:
        curves = centred(shape.evenly(CURVES, self._rng()))
        return _Drawn(lambda: [curves])

    def _redrawn(self, shape: Shape) -> _Drawn:
        """Curves that are drawn whenever they are looked at, the same ones again, instead of being kept."""
        key = (_key(shape), self.spec.plan.seed, self._count)
        blocks = partial(_blocks, shape, self._rng, self._count)
        return _remembered(_REDRAWN, MOST_SHAPES, key, lambda: _Drawn(blocks))


@dataclass
class _Known:
    """Second moments of every family and error at temperatures (N,), ascending."""

    degc: Array = field(default_factory=lambda: np.empty(0))
    moments: dict[str, Moments] = field(default_factory=dict)


@dataclass
class _Drawn:
    """Curves of one shape, block by block (n, POINTS), and the largest that tables of N points leave.

    seen: ends of the range -> (N,) temperatures, ascending, and (n, N) curves there
    sizes: (n,) root mean squares over the range, before a table scales them; none before the first look
    """

    blocks: Callable[[], Iterable[Single]]
    left: dict[int, Array] = field(default_factory=dict)
    seen: dict[bytes, tuple[Array, Array]] = field(default_factory=dict)
    sizes: Array = field(default_factory=lambda: np.empty(0))

    @cached_property
    def steps(self) -> Array:
        """(n, POINTS - 1) squares of the differences between neighbouring points of every curve."""
        return np.concatenate([np.diff(block, axis=1) ** 2 for block in self.blocks()])

    def look(self, degc: Array, on_offer: Array, family: TableCurves) -> None:
        """Curves at temperatures and what a family's tables leave of them, where not known, in one go."""
        numbers = [n for n in family.numbers if n not in self.left]
        at, curves = self.seen.get(_ends(family), (np.empty(0), np.empty((0, 0))))
        new = np.empty(0) if np.isin(degc, at).all() else np.setdiff1d(np.union1d(degc, on_offer), at)
        if not numbers and not len(new):
            return
        if len(at) + len(new) > max(MOST_POINTS, 2 * len(degc)):
            at, curves, new = np.empty(0), np.empty((0, 0)), degc
        found = [
            (along(new, family.grid, block), sizes_of(block), *(largest_left(block, n) for n in numbers))
            for block in self.blocks()
        ]
        there, self.sizes, *left = (np.concatenate(each) for each in zip(*found, strict=True))
        self.left |= dict(zip(numbers, left, strict=True))
        if len(new):
            at = np.concatenate([at, new])
            order = np.argsort(at)
            both = np.hstack([curves, there]) if len(curves) else there
            self.seen[_ends(family)] = (at[order], both[:, order])

    def at(self, degc: Array, family: TableCurves) -> Array:
        """(n, N) at temperatures (N,); errors whose curves have one shape ask for the same."""
        at, curves = self.seen[_ends(family)]
        return curves[:, np.searchsorted(at, degc)]

    def scales(self, family: TableCurves) -> Array:
        """(n,) with which each meets the family's table at one N and exceeds it at none.

        Those that would be larger than LARGEST medians are as large as that.
        """
        each = [
            allowed / np.where(self.left[n] > 0, self.left[n], np.inf)
            for n, allowed in zip(family.numbers, family.residual, strict=True)
        ]
        least = np.min(each, axis=0)
        scales = np.where(np.isfinite(least), least, 0.0)
        return no_larger(scales, self.sizes, LARGEST * float(np.median(scales * self.sizes)))


def about_means(
    moments: Moments, means: Mapping[tuple[Sensor, str], Array]
) -> dict[tuple[Sensor, str], Array]:
    """Covariances (N, N) of curves: their second moments less what all units have in common, (N,)."""
    return {e: M - np.outer(means[e], means[e]) if e in means else M for e, M in moments.items()}


def _segments(grid: Array, degc: Array) -> NDArray[np.intp]:
    """(N,) which segment of a grid temperatures lie on; the end ones go on beyond it."""
    return np.clip(np.searchsorted(grid, degc, side="right") - 1, 0, len(grid) - 2)


def unseen_curves(spec: Spec) -> int:
    """How many curves of a family judge campaigns: more where the least share of flights is left out."""
    rules = [wanted.rule for wanted in spec.requirement]
    out = min((1.0 - rule.percentile for rule in rules if isinstance(rule, PercentileRule)), default=1.0)
    return BLOCK * round(float(np.clip(BEYOND / max(out, 1e-9), *UNSEEN)) / BLOCK)


def _blocks(shape: Shape, rng: Callable[[], np.random.Generator], count: int) -> Iterator[Single]:
    """(BLOCK, POINTS), so many of which are even together: the more, the less their moments scatter."""
    one = rng()
    sizes = (min(EVENLY, count - first) for first in range(0, count, EVENLY))
    return (centred(block) for size in sizes for block in np.split(shape.evenly(size, one), size // BLOCK))


_KEPT: dict[Hashable, _Drawn] = {}
_REDRAWN: dict[Hashable, _Drawn] = {}


def _remembered(
    known: dict[Hashable, _Drawn], most: int, key: Hashable, draw: Callable[[], _Drawn]
) -> _Drawn:
    """What a process knows of curves; the oldest goes where there are too many."""
    if key not in known:
        while len(known) >= most:
            known.pop(next(iter(known)))
        known[key] = draw()
    return known[key]


def _curved(spec: Spec) -> object:
    """What curves are made of; equal for specs whose curves are the same ones."""
    budgets = [
        (sensor, effect, budget.temperature_residual)
        for sensor in SENSORS
        for effect, budget in getattr(spec.unit, sensor).items()
    ]
    return budgets, spec.plan.temperatures.range, spec.plan.seed


def _ends(family: TableCurves) -> bytes:
    return family.grid[[0, -1]].tobytes()


def _key(shape: Shape) -> Hashable:
    """Equal for shapes that draw the same curves."""
    return shape.amplitude.tobytes() if isinstance(shape, Cosines) else type(shape)
