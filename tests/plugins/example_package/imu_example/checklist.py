"""The records of a plan as a list to tick off, one line each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from planner.protocols import Exported, ExportOptions


class Checklist:
    """Plain text, `[ ] id`."""

    name = "checklist"
    suffix = ".txt"
    dialects: tuple[str, ...] = ()

    def files(self, document: Mapping[str, Any], options: ExportOptions) -> Exported:
        """checklist.txt."""
        records = [step["id"] for step in document["steps"] if step["action"] == "record"]
        return Exported({"checklist.txt": "".join(f"[ ] {name}\n" for name in records)})


FORMAT = Checklist()
