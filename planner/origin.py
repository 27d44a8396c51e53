"""Where a plug-in comes from: ours, or a distribution that is installed beside us."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Kind = Literal["effects", "trajectories", "benches", "readers", "exports"]
OURS = "planner"  # our distribution
NOUNS: Mapping[Kind, str] = {
    "effects": "effect",
    "trajectories": "trajectory",
    "benches": "kind of bench",
    "readers": "reader",
    "exports": "export format",
}


@dataclass(frozen=True)
class Origin:
    """Where a plug-in comes from: a distribution and its version; target: `package.module:OBJECT`."""

    kind: Kind
    name: str
    distribution: str
    version: str
    target: str

    @property
    def foreign(self) -> bool:
        """Whether another package than planner brings it."""
        return self.distribution != OURS

    def document(self) -> dict[str, str]:
        """As files name it that were made with it."""
        return {
            "kind": self.kind,
            "name": self.name,
            "distribution": self.distribution,
            "version": self.version,
        }

    def __str__(self) -> str:
        return f"{NOUNS[self.kind]} {self.name!r} of {self.distribution} {self.version}"
