"""A table whose rate is another one in every record: readings then scatter with the rate, on every gyro.

    y = … + κ_i ω_i,   κ_i ~ N(0, σ²) of every record anew

A servo that has not settled, records that end within a turn, a ripple: nothing of it goes with any input, and
the noise takes it up. That is told by its variances: what a gyro reads at rest does not grow with the rate,
and its scale factor stays within minutes what it is. Where all gyros show σ, and it is most of what the
fastest records scatter by, the rate was not what is written; or the unit's scale factors are as unsteady,
which the same records do not tell.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from planner.diagnose.noise.components import RATE_NOISE
from planner.diagnose.noise.whitened import Whitened
from planner.diagnose.search.sensor import SensorFound
from planner.measurement import AXES
from planner.nouns.diagnosis import ReferenceSuspect
from planner.solvers.distributions import TWO_SIDED, chi_square_tail
from planner.spec.model import Spec

NAME = "table_rate"
SURE = (
    3.0  # σ² in its own error, of each gyro; of clean campaigns one in 180 had that, of a third of the size
)
MOSTLY = 3.0  # times the noise of a record at rest, that the fastest scatter by it
LARGE = 2e-4  # of the rate: drives and good gyros stray by up to half of it, and are no fault
CHECK = (
    "from record to record the gyros scatter by {0:.2g} % of the rate: see whether the table has settled as "
    "a record begins, holds its rate, and whether records take whole turns; a unit with such unsteady scale "
    "factors is the other cause"
)


def unsteady_rate(
    found: Sequence[SensorFound], wrong: Sequence[ReferenceSuspect], spec: Spec
) -> ReferenceSuspect | None:
    """The table's rate, where each gyro scatters with it, and no other reference is suspected; else None.

    value: σ, a share of the rate; of what the spec states of the benches the worst counts. What it lets scale
    factors draw and wander by is no finding.
    """
    if any(not s.expected for s in wrong):
        return None
    for s in found:
        if s.sensor != "gyro":
            continue
        each = list(_scatters(s))
        if len(each) < len(AXES):
            return None
        square, error = np.mean(each, axis=0)
        low, high = (float(np.sqrt(max(square + x * error, 0.0))) for x in (-TWO_SIDED, TWO_SIDED))
        if low <= np.hypot(LARGE, _budgeted(spec)):
            return None
        stated = max((b.accuracy.rate for b in spec.benches.values()), default=0.0)
        chance = float(chi_square_tail((low / stated) ** 2, 1)) if stated > 0.0 else 1.0
        value, sure = float(np.sqrt(square)), float(square / error)
        p, check = float(chi_square_tail(sure**2, 1)), CHECK.format(100.0 * value)
        return ReferenceSuspect(
            NAME, value, low, high, "1", tuple(c.name for c in s.channels), p, sure, check, 0.0,
            "scale_factor", "whole turns timed against a clock", stated, chance,
        )  # fmt: skip
    return None


def _budgeted(spec: Spec) -> float:
    """One sigma of a gyro's scale factor from record to record, by the spec."""
    budget = spec.unit.gyro.get("scale_factor")
    return 0.0 if budget is None else float(np.hypot(budget.run_to_run_largest, budget.in_run_sigma))


def _scatters(s: SensorFound) -> Iterator[tuple[float, float]]:
    """σ² and its error of the channels that show it."""
    for w in s.found.pool.state.values():
        one = _scatter(w)
        if one is not None:
            yield one


def _scatter(w: Whitened) -> tuple[float, float] | None:
    """σ² and its error of one channel; None where it does not show it."""
    noise = w.noise.by_rows
    if RATE_NOISE not in noise.components:
        return None
    k = noise.components.index(RATE_NOISE)
    square, error = float(noise.variances.theta[k]), float(np.sqrt(max(noise.variances.error[k, k], 0.0)))
    fastest = float(np.max(w.channel.u**2)) * square
    at_rest = float(noise.variances.theta[0])
    told = 0.0 < SURE * error < square
    return (square, error) if told and fastest > MOSTLY**2 * at_rest else None
