"""Everything an error may choose, as arrays: one row is one set of temperature points at one repeat level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.nouns.choices import ErrorMenu, TemperaturePoints
from planner.plan.costs import Tariff


@dataclass(frozen=True)
class ErrorRows:
    """The rows of one error over all tests that serve it.

    menu, option, level: (R,) which menu, which points in it, which repeat level
    residual, half_width: (R,) the two parts that the row decides, SI; amounts: (R, K) resources used
    """

    error: str
    menus: tuple[ErrorMenu, ...]
    menu: NDArray[np.int64]
    option: NDArray[np.int64]
    level: NDArray[np.int64]
    residual: Array
    half_width: Array
    amounts: Array

    def __len__(self) -> int:
        return len(self.menu)

    def test(self, row: int) -> str:
        """The test of a row."""
        return self.menus[int(self.menu[row])].test

    def points(self, row: int) -> TemperaturePoints:
        """The temperature points of a row."""
        return self.menus[int(self.menu[row])].points[int(self.option[row])]

    def repeats(self, row: int) -> tuple[int, ...]:
        """The repeats of a row, one per temperature."""
        levels = self.menus[int(self.menu[row])].levels[int(self.option[row])]
        return tuple(int(n) for n in levels.repeats[self.level[row]])


def error_rows(error: str, menus: Sequence[ErrorMenu], tariff: Tariff) -> ErrorRows:
    """All rows of one error, in the order of its menus, points and levels."""
    own = tuple(menu for menu in menus if menu.error == error)
    blocks = [(m, o) for m, menu in enumerate(own) for o in range(len(menu.points))]
    counts = [len(own[m].levels[o].half_width) for m, o in blocks]
    return ErrorRows(
        error=error,
        menus=own,
        menu=np.repeat([m for m, _ in blocks], counts),
        option=np.repeat([o for _, o in blocks], counts),
        level=np.concatenate([np.arange(count) for count in counts]),
        residual=np.repeat([own[m].points[o].residual for m, o in blocks], counts),
        half_width=np.concatenate([own[m].levels[o].half_width for m, o in blocks]),
        amounts=np.concatenate([_amounts(own[m], o, tariff) for m, o in blocks]),
    )


def _amounts(menu: ErrorMenu, option: int, tariff: Tariff) -> Array:
    points = menu.points[option]
    repeats = menu.levels[option].repeats
    return tariff.amounts(menu.test, points.temperatures_degc, repeats, room=points.placement == "room")
