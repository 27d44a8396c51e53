"""Second moments of every family of temperature curves that the promise must hold for.

A curve's size is its own scale times a shape (`planner.simulate.temperature_curves`); shapes that know no
table are drawn once for all errors, and so is what tables leave of them.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from planner.information.smooth import Moments
from planner.nouns.array import Array
from planner.protocols import Sensor
from planner.simulate.curves.cosines import Cosines
from planner.simulate.curves.grid import Shape, along, centred, largest_left
from planner.simulate.families import curve_families
from planner.simulate.temperature_curves import CurveFamily, TableCurves, second_moment
from planner.spec.curve_names import families_of
from planner.spec.model import Spec

CURVES = 2000  # drawn of every family: a second moment is then known to 2 % in sigma, a part of the whole
KEPT = 4  # sets of temperatures at which curves are kept: of what is on offer, and of the campaign in hand
MOST_POINTS = 400  # temperatures at which second moments are kept


@dataclass(frozen=True)
class Curves:
    """The families of a spec; what is drawn of a shape is kept."""

    spec: Spec
    drawn: dict[Hashable, _Drawn] = field(default_factory=dict)
    known: _Known = field(default_factory=lambda: _Known(), repr=False, compare=False)

    def moments(self, degc: Array) -> dict[str, Moments]:
        """family -> (sensor, effect) -> (N, N) second moment at temperatures (N,) ascending, SI².

        One campaign after the other is asked for at much the same temperatures: these are found once.
        """
        known = self.known
        if not np.isin(degc, known.degc).all():
            every = np.union1d(known.degc, degc)
            known.degc = every if len(every) <= MOST_POINTS else degc
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
        return np.mean([self._moment(one, degc) for one in each], axis=0) if each else None

    def pool(self, name: str, error: tuple[Sensor, str], degc: Array) -> Array:
        """(CURVES, N) curves of one error and family at temperatures (N,), SI."""
        return self._seen(self._families[name][error], degc)

    @cached_property
    def _families(self) -> dict[str, dict[tuple[Sensor, str], CurveFamily]]:
        return {name: curve_families(self.spec, name) for name in families_of(self.spec)}

    def _moment(self, family: CurveFamily, degc: Array) -> Array:
        if not isinstance(family, TableCurves) or family.figure == "sigma":
            return second_moment(family, degc, CURVES, np.random.default_rng(self.spec.plan.seed))
        seen = self._seen(family, degc)
        return np.asarray(seen.T @ seen / CURVES)

    def _seen(self, family: CurveFamily, degc: Array) -> Array:
        """(CURVES, N) curves of a family; those that differ by their scale only are drawn once."""
        rng = np.random.default_rng(self.spec.plan.seed)
        if not isinstance(family, TableCurves) or family.figure == "sigma":
            return along(degc, family.grid, family.draws(CURVES, rng))
        key = _key(family.shape)
        if key not in self.drawn:
            self.drawn[key] = _Drawn(centred(family.shape.draws(CURVES, rng)))
        known = self.drawn[key]
        return np.asarray(known.at(degc, family.grid) * known.scales(family)[:, None])


@dataclass
class _Known:
    """Second moments of every family and error at temperatures (N,), ascending."""

    degc: Array = field(default_factory=lambda: np.empty(0))
    moments: dict[str, Moments] = field(default_factory=dict)


@dataclass
class _Drawn:
    """Curves (CURVES, POINTS) of one shape, and the largest that tables of N points leave of each."""

    curves: Array
    left: dict[int, Array] = field(default_factory=dict)
    seen: dict[bytes, Array] = field(default_factory=dict)

    def at(self, degc: Array, grid: Array) -> Array:
        """(CURVES, N) at temperatures (N,); errors whose curves have one shape ask for the same."""
        key = degc.tobytes() + grid[[0, -1]].tobytes()
        if key not in self.seen:
            if len(self.seen) >= KEPT:
                self.seen.clear()
            self.seen[key] = along(degc, grid, self.curves)
        return self.seen[key]

    def scales(self, family: TableCurves) -> Array:
        """(CURVES,) with which each meets the family's table at one N and exceeds it at none."""
        for n in family.numbers:
            if n not in self.left:
                self.left[n] = largest_left(self.curves, n)
        each = [
            allowed / np.where(self.left[n] > 0, self.left[n], np.inf)
            for n, allowed in zip(family.numbers, family.residual, strict=True)
        ]
        least = np.min(each, axis=0)
        return np.where(np.isfinite(least), least, 0.0)


def _key(shape: Shape) -> Hashable:
    """Equal for shapes that draw the same curves."""
    return shape.amplitude.tobytes() if isinstance(shape, Cosines) else type(shape)
