"""Figures compared one by one: what was checked, how many figures, and every fault with its place."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

Document = Mapping[str, Any]  # plan.json, or a part of it
SAME = 1e-9  # figures of plan.json have twelve digits


@dataclass(frozen=True)
class Fault:
    """One figure that is not what the spec and the rest of the plan make it."""

    check: str
    where: str
    what: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}"


@dataclass(frozen=True)
class Check:
    """One kind of check: what it says, how many figures it compared, and whether all were right."""

    name: str
    what: str
    figures: int
    ok: bool


@dataclass
class Findings:
    """Collects comparisons of one kind of check."""

    name: str
    what: str
    figures: int = 0
    faults: list[Fault] = field(default_factory=list)

    def fault(self, where: str, what: str) -> None:
        """Something is wrong."""
        self.figures += 1
        self.faults.append(Fault(self.name, where, what))

    def same(self, where: str, found: Any, wanted: Any, tolerance: float = SAME) -> bool:
        """`found` must be `wanted`; numbers to a relative tolerance."""
        self.figures += 1
        if is_same(found, wanted, tolerance):
            return True
        self.faults.append(Fault(self.name, where, f"is {shown(found)}, must be {shown(wanted)}"))
        return False

    def near(self, where: str, found: float, wanted: float, within: float) -> bool:
        """`found` may be so far from `wanted`."""
        self.figures += 1
        if abs(found - wanted) <= within:
            return True
        self.faults.append(Fault(self.name, where, f"is {shown(found)}, must be about {shown(wanted)}"))
        return False

    def at_most(self, where: str, found: float, limit: float, tolerance: float = SAME) -> bool:
        """`found` must not exceed the limit."""
        self.figures += 1
        if found <= limit + tolerance * max(1.0, abs(limit)):
            return True
        self.faults.append(Fault(self.name, where, f"is {shown(found)}, more than {shown(limit)}"))
        return False

    def check(self) -> Check:
        """The outcome."""
        return Check(self.name, self.what, self.figures, not self.faults)


def is_same(found: Any, wanted: Any, tolerance: float = SAME) -> bool:
    """Equality of plain trees in which numbers count as equal to a relative tolerance."""
    if isinstance(found, bool) or isinstance(wanted, bool):
        return found is wanted
    if isinstance(found, int | float) and isinstance(wanted, int | float):
        return math.isclose(found, wanted, rel_tol=tolerance, abs_tol=1e-15)
    if isinstance(found, Mapping) and isinstance(wanted, Mapping):
        return found.keys() == wanted.keys() and all(is_same(found[k], wanted[k], tolerance) for k in wanted)
    if isinstance(found, list | tuple) and isinstance(wanted, list | tuple):
        return len(found) == len(wanted) and all(map(is_same, found, wanted, [tolerance] * len(wanted)))
    return bool(found == wanted)


def shown(value: Any) -> str:
    """A figure in a sentence."""
    if isinstance(value, float):
        return f"{value:.12g}"
    text = "nothing" if value is None else str(value)
    return text if len(text) <= 120 else text[:117] + "…"
