"""`planner allow --json`: the allowed sensor errors in display units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from planner.export.json import number
from planner.nouns.allowances import AllowedErrors
from planner.units import from_si


def allowed_document(allowed: AllowedErrors) -> dict[str, Any]:
    """Bounds, corners (genetic beside exact) and the Pareto set, one mapping of errors a point."""

    def shown(sizes: Mapping[str, float]) -> dict[str, float]:
        return {error: number(from_si(size, allowed.units[error])) for error, size in sizes.items()}

    return {
        "units": dict(allowed.units),
        "smallest": shown(allowed.smallest),
        "largest": shown(allowed.largest),
        "tightness": {str(k): number(v) for k, v in allowed.tightness.items()},
        "corners": [
            {"name": c.name, "genetic": shown(c.genetic), "exact": shown(c.exact), "gap": number(c.gap)}
            for c in allowed.corners
        ],
        "front": [shown(dict(zip(allowed.errors, point, strict=True))) for point in allowed.front],
        "genetic": {
            "generations": allowed.history.generations,
            "evaluations": allowed.history.evaluations,
            "stopped": allowed.history.stopped,
        },
    }
