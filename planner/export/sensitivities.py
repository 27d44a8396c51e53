"""`planner sensitivity --json`: signed navigation errors at the end of the flight (interfaces, section 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from planner.plan.spec_to_sensitivity import SensitivityRow


def sensitivity_document(rows: Sequence[SensitivityRow]) -> dict[str, Any]:
    """`columns`: one entry a coefficient, per one display unit of it; error = computed − true."""
    return {"columns": [asdict(row) for row in rows]}
