"""A check that may stop after every power-on: the same records looked at as they come.

Look k has the first k power-ons of every unit and temperature. Accepting and rejecting take the boundaries of
`solvers.sequential` for all planned looks instead of one quantile, so that the error rates hold for the first
decision, whichever look makes it: below a fixed tangent of the convex T the estimates of the looks are a
Gaussian walk, and the tangent's spread is at most the one that is used. Of many power-ons a look takes
several: after 60 looks further ones hardly save anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from planner.dwells.table_rows import rows_of
from planner.fleet.acceptance import UnitAcceptance, accepted
from planner.fleet.allowed_region import AllowedRegion
from planner.fleet.check_groups import by_temperature
from planner.fleet.check_residual import check_residuals
from planner.fleet.judge import ErrorRates
from planner.nouns.allowances import ErrorModel
from planner.nouns.dwell_table import DwellTable
from planner.solvers.sequential import boundaries

MOST_LOOKS = 60


def accepted_as_they_come(
    table: DwellTable,
    models: Sequence[ErrorModel],
    region: AllowedRegion,
    temperatures: tuple[float, float],
    rates: ErrorRates,
    looks: int,
) -> tuple[UnitAcceptance, ...]:
    """Every unit with the decision of the first look that makes one.

    looks: power-ons a temperature that were planned, each a look unless they are many.
    """
    group = by_temperature(table)
    number = power_on_number(table, group)
    each, count = looks_at(looks)
    levels = _levels(rates, count)
    found: dict[str, UnitAcceptance] = {}
    for k in range(min(count, (int(number.max()) + 1) // each)):
        waiting = ~np.isin(table.unit, [u for u, a in found.items() if a.verdict != "undecided"])
        rows = np.flatnonzero((number < each * (k + 1)) & waiting)
        if len(rows) == 0:
            break
        part = rows_of(table, rows)
        measured = check_residuals(part, group[rows], models, region)
        for unit in accepted(measured, region, temperatures, levels[k]):
            found[unit.unit] = _told(unit, each * (k + 1), each * count)
    return tuple(found[name] for name in sorted(found))


def looks_at(power_ons: int) -> tuple[int, int]:
    """How many power-ons a look has, and how many looks: equal ones, so the last may ask for some more."""
    each = -(-power_ons // MOST_LOOKS)
    return each, -(-power_ons // each)


def power_on_number(table: DwellTable, group: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) which power-on of its unit and temperature a row belongs to, from 0."""
    number = np.empty(len(table), dtype=np.int64)
    for g in np.unique(group):
        rows = np.flatnonzero(group == g)
        number[rows] = np.unique(table.run[rows], return_inverse=True)[1]
    return number


def _levels(rates: ErrorRates, looks: int) -> list[ErrorRates]:
    """The rates whose quantiles are the boundaries of each look."""
    from scipy.special import ndtr

    good, bad = (ndtr(-boundaries(r, looks)) for r in (rates.good_rejected, rates.bad_accepted))
    return [ErrorRates(max(float(g), 1e-12), max(float(b), 1e-12)) for g, b in zip(good, bad, strict=True)]


def _told(unit: UnitAcceptance, look: int, looks: int) -> UnitAcceptance:
    if unit.verdict == "undecided":
        return replace(unit, notes=(*unit.notes, f"undecided after {look} of {looks} power-ons"))
    said = f"{unit.verdict} after {look} of {looks} power-ons: the check may stop there"
    return replace(unit, further=None, notes=(*unit.notes, said))
