"""What straight lines between the exported nodes of smooth tables cost in flight.

    d(T) = Σ_terms J_term (θ̂(T) − lines(T)),   root mean square over the table's temperatures

J the linear combination of the flight, which is as warm all the way.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.calibration import SmoothTable
from planner.nouns.sensor import ErrorName
from planner.nouns.trajectory import Trajectory
from planner.plan.flight_response import FlightResponse, flight_response
from planner.protocols import SENSORS
from planner.spec.model import NAVIGATION_ERRORS, Spec
from planner.units import from_si


def lines_in_flight(tables: Sequence[SmoothTable], spec: Spec, trajectory: Trajectory) -> Iterator[str]:
    """A sentence for every requirement of the spec on its flight."""
    errors = dict.fromkeys(ErrorName(table.error) for table in tables)
    ordered = [e for sensor in SENSORS for e in errors if e.sensor == sensor]
    response = flight_response(trajectory, ordered, spec.requirement, spec.initial_alignment)
    degc = np.unique(np.concatenate([t.between_degc for t in tables]))
    missed = _missed(response, tables, degc)
    nodes = max(len(t.temperature_degc) for t in tables)
    for wanted in spec.requirement:
        components, instants = response.of(wanted)
        d = response.errors[instants][:, components].sum(axis=3) @ missed  # (m, c, X)
        size = float(np.sqrt(np.mean(np.sum(d**2, axis=1), axis=1)).max())
        unit = NAVIGATION_ERRORS[wanted.error]
        yield (
            f"smooth tables: straight lines between {nodes} nodes cost {from_si(size, unit):.2g} {unit} of "
            f"{wanted.error} (rms over the table's temperatures), limit {wanted.limit.text}; more --nodes "
            "cost less"
        )


def _missed(response: FlightResponse, tables: Sequence[SmoothTable], degc: Array) -> Array:
    """(F, X) of every flying term at temperatures (X,)."""
    found = np.zeros((len(response.flying), len(degc)))
    for i, f in enumerate(response.flying):
        for table in tables:
            if (table.error, table.term) == (str(f.error), f.term) and table.channel == AXES[f.channel]:
                found[i] = np.interp(degc, table.between_degc, table.missed)
    return found
