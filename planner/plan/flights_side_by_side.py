"""Stage: sensitivities of several flights in, what each error costs on each out (K table 3.1, fig 3.16).

    k_j = Σ_terms ‖v_term(t)‖      position error per unit of error j, all axes together, as K has it

at the time t that all the flights last.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from planner.nouns.sensitivities import Sensitivities
from planner.plan.error_over_flight import ErrorOverFlight


@dataclass(frozen=True)
class FlightBeside:
    """One flight. per_unit: sensor error -> k_j, m per SI unit; ratio: to the first flight's, or NaN.

    unit: sensor error -> display unit of its coefficient
    """

    name: str
    time_s: float
    per_unit: Mapping[str, float]
    ratio: Mapping[str, float]
    unit: Mapping[str, str]


@dataclass(frozen=True)
class FlownErrors:
    """Sensitivities of the spec's flight, the errors of a unit that nobody has calibrated, other flights.

    curves: of every navigation error that the spec requires, over the time up to its instant
    flights: of several flights, the spec's first; empty without others; totals: position error of each
    """

    found: Sensitivities
    curves: tuple[ErrorOverFlight, ...]
    flights: tuple[FlightBeside, ...]
    totals: dict[str, ErrorOverFlight]


def side_by_side(flights: Mapping[str, Sensitivities]) -> tuple[FlightBeside, ...]:
    """Every flight at the time that all of them last, the first one the measure of the others."""
    time = min(float(s.time_s[-1]) for s in flights.values())
    all_per_unit = {name: _per_unit(s, time) for name, s in flights.items()}
    first = next(iter(all_per_unit.values()))
    units = {c.error: c.unit for s in flights.values() for c in s.columns}
    return tuple(
        FlightBeside(name, time, k, {e: k[e] / first[e] if first[e] > 0 else float("nan") for e in k}, units)
        for name, k in all_per_unit.items()
    )


def _per_unit(found: Sensitivities, time: float) -> dict[str, float]:
    """Sensor error -> Σ over its terms of the length of the position error at `time`, m per SI unit."""
    components = np.stack(
        [
            np.stack([np.interp(time, found.time_s, found.position[:, i, j]) for i in range(3)])
            for j in range(len(found.columns))
        ]
    )
    lengths = np.linalg.norm(components, axis=1)
    names = [c.error for c in found.columns]
    return {e: float(sum(x for x, n in zip(lengths, names, strict=True) if n == e)) for e in names}
