"""What no effect names → the bias' budget, widened by what is left: σ² = σ_in_run² + (after² − floor²)."""

from __future__ import annotations

import math
from collections.abc import Set

from planner import catalog
from planner.nouns.diagnosis import Diagnosis, ResidualChange
from planner.spec.budget import ErrorBudget, InRun
from planner.spec.model import Spec
from planner.spec.text_edit import SpecText
from planner.units import from_si

LEAST = 1e-3  # of the budget, below which widening it changes no plan


def widened(
    edits: SpecText,
    spec: Spec,
    diagnosis: Diagnosis,
    done: Set[tuple[str, str]],
    curved: Set[str] = frozenset(),
) -> list[str]:
    """Widen the in-run budget of every sensor on which something without a name is left.

    done: (error, part) that are replaced already, by what the data say; curved: channels of which a measured
        curve is declared
    """
    changes = []
    every = {c for u in diagnosis.found.unknown for c in u.channels}
    channels = {_long(c) for c in every - curved}
    fitted = {c for u in diagnosis.found.unknown if u.curve is not None for c in u.channels}
    for sensor in sorted({c.rsplit("_", 1)[0] for c in channels}):
        mine = {c for c in channels if c.startswith(sensor)}
        here = [r for r in diagnosis.residual if _long(r.channel) in mine]
        left = max((_left(r, fitted) for r in here), default=0.0)
        budget: ErrorBudget | None = getattr(spec.unit, sensor).get("bias")
        if budget is None or left <= 0.0 or (f"{sensor}.bias", "in_run") in done:
            continue
        before = budget.in_run_sigma or 0.0
        after = math.hypot(before, left)
        if after - before > LEAST * max(before, left):
            unit = catalog.effects()["bias"].units[sensor]  # type: ignore[index]  # one of the two sensors
            changes.append(_enter(edits, sensor, budget, after, before, unit))
    return changes


def _long(channel: str) -> str:
    """`accelerometer_x`, also where a file says `acc_x`."""
    return channel.replace("acc_", "accelerometer_")


def _left(r: ResidualChange, fitted: Set[str]) -> float:
    """What the residual of unseen rows has beyond the spread of replicates, SI.

    fitted: channels whose residual after is that with a curve, which is not declared here
    """
    floor = r.noise_floor if math.isfinite(r.noise_floor) else 0.0
    left = r.before if r.channel in fitted else r.after
    return math.sqrt(max(left**2 - floor**2, 0.0)) if math.isfinite(left) else 0.0


def _enter(edits: SpecText, sensor: str, budget: ErrorBudget, after: float, before: float, unit: str) -> str:
    written = f"{from_si(after, unit):.3g} {unit}"
    path: tuple[str, ...] = ("unit", sensor, "bias", "in_run")
    if budget.in_run is None:
        edits.enter(path[:-1], "in_run", written)
    elif isinstance(budget.in_run, InRun):
        edits.replace((*path, "value"), written)
    else:
        edits.replace(path, written)
    return (
        f"unit.{sensor}.bias.in_run: {from_si(before, unit):.3g} {unit} widened to {written} by what is left "
        "without a name"
    )
