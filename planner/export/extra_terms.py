"""A calibration's terms outside its temperature tables, sorted by what they become in firmware."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planner import catalog
from planner.effects.cross_coupling import PAIRS
from planner.nouns.array import Array
from planner.nouns.calibration import ExtraTerm
from planner.protocols import AXES


@dataclass(frozen=True)
class ExtraTerms:
    """The terms of one sensor; an effect that the calibration lacks is zero."""

    terms: Sequence[ExtraTerm]

    def of(self, effect: str) -> list[ExtraTerm]:
        """The terms of one effect."""
        return [e for e in self.terms if e.effect == effect]

    def channels(self, effect: str) -> Array:
        """(3,) a coefficient a channel."""
        found = np.zeros(3)
        for e in self.of(effect):
            found[AXES.index(e.term)] = e.value
        return found

    def matrix(self, effect: str) -> Array:
        """(3, 3) a coefficient a channel and body axis."""
        found = np.zeros((3, 3))
        for e in self.of(effect):
            found[AXES.index(e.term[0]), AXES.index(e.term[1])] = e.value
        return found

    def products(self, effect: str) -> Array:
        """(3, 6) a coefficient a channel and product of two axes, xx xy xz yy yz zz."""
        found = np.zeros((3, len(PAIRS)))
        for e in self.of(effect):
            channel, one, other = (AXES.index(axis) for axis in e.term)
            found[channel, PAIRS.index((one, other))] = e.value
        return found

    def warm_up(self) -> tuple[Array, Array]:
        """Amplitudes and time constants; 1 s where there is none."""
        tau = np.ones(3)
        for e in self.of("warm_up"):
            shape = {**catalog.effects()["warm_up"].nonlinear, **e.nonlinear}
            tau[AXES.index(e.term)] = shape["time_constant"]
        return self.channels("warm_up"), tau
