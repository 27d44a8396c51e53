"""What a residual table says of a narrow range of use, in words."""

from __future__ import annotations

from planner.protocols import SENSORS
from planner.spec.model import Spec
from planner.units import from_si

NARROW_K = 10.0  # curves of sensors are measured over tens of kelvins


def narrow_range(spec: Spec) -> str | None:
    """A remark on residual tables that are taken over less than NARROW_K; None where none is."""
    from planner import catalog

    low, high = spec.plan.temperatures.range
    if not 0.0 < high - low < NARROW_K:
        return None
    for sensor in SENSORS:
        for effect, budget in getattr(spec.unit, sensor).items():
            table = budget.residual_table
            if table and effect in catalog.effects() and max(table.values()) > 0:
                unit = catalog.effects()[effect].units[sensor]
                points, left = next(iter(table.items()))
                error = f"{sensor}.{effect} with {points} point{'s' if points > 1 else ''}"
                return _said(error, f"{from_si(left, unit):.3g} {unit}", f"{high - low:g} K")
    return None


def _said(error: str, left: str, span: str) -> str:
    return (
        f"spans {span}, and residual tables are what is left over this range: {error} {left} within {span}. "
        "Every further point is a soak; where the tables were measured over a wider range give that range or "
        "the measured curve, or leave temperature_residual out"
    )
