"""A spread that is larger than its budget → what it makes of one flight, and of what a plan promises.

    T(σ) = quantile of Σ_i v_i σ_i z_i by the requirement's rule,   v_i the error per unit on channel i

Nothing calibrates these spreads away: every flight draws them anew, so a plan's promise P of the budget b
becomes √(P² + T(m)² − T(b)²) with the measured m, under the worst case P + T(m) − T(b).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.diagnose.diagnosis_to_navigation import left_in_flight
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.diagnosed_spreads import NOISE, WHITE_OF_1_S, BudgetExceeded, SpreadInFlight
from planner.nouns.sensitivities import Constraint
from planner.nouns.trajectory import Trajectory
from planner.plan.flight_response import nine_of, white_response
from planner.protocols import SENSORS
from planner.solvers.distributions import normal_quantile


def in_flight(
    exceeded: Sequence[BudgetExceeded],
    constraints: Sequence[Constraint],
    confidence: float,
    promised: Sequence[float] = (),
) -> tuple[BudgetExceeded, ...]:
    """Every spread with what it makes of a flight, for the requirement of which it takes the largest share.

    promised: what a plan promises of each requirement, SI; empty without one
    """
    return tuple(replace(b, flight=_worst(b, constraints, confidence, promised)) for b in exceeded)


def with_noise(constraints: Sequence[Constraint], flight: Trajectory) -> tuple[Constraint, ...]:
    """The same with what the flight makes of white noise, `<sensor>.noise`: (3 b, k) per SI unit per √Hz.

    All channels of a sensor have that of the noisiest, as a spec says it. It is one draw of many: also under
    the worst case it adds up by squares.
    """
    times = np.array(sorted({c.time_s for c in constraints}))
    white = white_response(flight, times)
    return tuple(_with_noise(c, white[int(np.searchsorted(times, c.time_s))]) for c in constraints)


def _with_noise(c: Constraint, white: Array) -> Constraint:
    """white: (9, 2, 3 b)"""
    found = {}
    for k, sensor in enumerate(SENSORS):
        vectors = white[nine_of(c.error), k].T
        if c.rule == "worst_case":
            vectors = np.array([[np.linalg.norm(vectors)]])
        found[f"{sensor}.{NOISE}"] = vectors
    return replace(c, vectors={**c.vectors, **found})


def _worst(
    b: BudgetExceeded, constraints: Sequence[Constraint], confidence: float, promised: Sequence[float]
) -> SpreadInFlight | None:
    felt = [c for c in constraints if b.error in c.vectors]
    costs = [_cost(b, c, confidence, promised) for c in felt]
    return max(costs, key=lambda f: f.measured / f.limit) if costs else None


def _cost(b: BudgetExceeded, c: Constraint, confidence: float, promised: Sequence[float]) -> SpreadInFlight:
    vectors = c.vectors[b.error]
    if b.part != WHITE_OF_1_S:
        vectors = _of_channel(vectors, b.channel)
    at = float("nan") if not promised else promised[c.requirement]
    halves = (_half(sigma, len(vectors), confidence) for sigma in (b.budget, b.measured))
    budgeted, measured = (left_in_flight(c, vectors, half, confidence) for half in halves)
    return SpreadInFlight(c.error, c.unit, c.limit, budgeted, measured, at, c.rule == "worst_case")


def _of_channel(vectors: Array, channel: str) -> Array:
    """(t, k) of the channel's own terms; of all for a spread of all channels, or without axes."""
    if not channel or len(vectors) != len(AXES):
        return vectors
    return vectors[[AXES.index(channel[-1])]]


def _half(sigma: float, count: int, confidence: float) -> Array:
    return np.full(count, sigma * float(normal_quantile((1.0 + confidence) / 2.0)))


def together(exceeded: Sequence[BudgetExceeded]) -> SpreadInFlight | None:
    """What all spreads together make of the requirement that they load most; None where none is felt.

    Independent draws add by squares, under the worst case by size.
    """
    felt = [b.flight for b in exceeded if b.flight is not None]
    if not felt:
        return None
    worst = max(felt, key=lambda f: f.measured / f.limit)
    mine = [f for f in felt if (f.error, f.limit) == (worst.error, worst.limit)]
    add = math.fsum if worst.worst_case else _root_of_squares
    return replace(worst, budgeted=add([f.budgeted for f in mine]), measured=add([f.measured for f in mine]))


def _root_of_squares(sizes: Sequence[float]) -> float:
    return math.sqrt(math.fsum(x**2 for x in sizes))
