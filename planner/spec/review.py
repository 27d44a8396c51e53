"""What the rules work with: a spec, the places of its parts, and a sheet to note faults and warnings on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

from planner.errors import Fault
from planner.protocols import SENSORS, Sensor
from planner.spec.budget import ErrorBudget
from planner.spec.model import Bench, Requirement, Spec, Test
from planner.spec.places import fault_at, part_at
from planner.spec.unused_tests import is_unused
from planner.spec.yaml12 import Document, Path


@dataclass
class Review:
    """One reading of a spec.

    spec: without its unreadable parts; folder: where the files lie that the spec names
    unreadable: paths of parts that already have a fault; nothing more is said of them
    """

    spec: Spec
    document: Document
    folder: FilePath
    unreadable: frozenset[Path] = frozenset()
    faults: list[Fault] = field(default_factory=list)
    warnings: list[Fault] = field(default_factory=list)

    def fault(self, code: str, path: Path, message: str, *, key: bool = False) -> None:
        """Note what must be changed."""
        if self.readable(path):
            self.faults.append(fault_at(self.document, code, path, message, key=key))

    def warn(self, code: str, path: Path, message: str, *, key: bool = False) -> None:
        """Note what can stay but may not be meant."""
        if self.readable(path):
            self.warnings.append(fault_at(self.document, code, path, message, key=key))

    def readable(self, path: Path) -> bool:
        """Whether neither the part at a path nor anything around it already has a fault."""
        return not any(path[: len(bad)] == bad for bad in self.unreadable)

    def whole(self, *path: str | int | float) -> bool:
        """Whether nothing at, around or under a path already has a fault."""
        return self.readable(path) and not any(bad[: len(path)] == path for bad in self.unreadable)

    def written(self, path: Path) -> Any:
        """What the file says at a path, or None."""
        return part_at(self.document.value, path)

    def names(self, *path: str) -> list[str]:
        """Keys of the mapping at a path as the file has them, the unreadable ones too."""
        value = self.written(path)
        return [str(key) for key in value] if isinstance(value, dict) else []

    def item(self, path: Path, index: int) -> Path:
        """Path of an item that may stand without the brackets of a list."""
        return (*path, index) if isinstance(self.written(path), list) else path

    def requirements(self) -> Iterator[tuple[int, Requirement]]:
        """(number, requirement) of the readable ones."""
        for index, requirement in enumerate(self.spec.requirement):
            if requirement is not None:  # a draft has gaps
                yield index, requirement

    def budgets(self) -> Iterator[tuple[Sensor, str, Path, ErrorBudget]]:
        """(sensor, effect, path, budget) of every readable budget."""
        for sensor in SENSORS:
            for effect, budget in getattr(self.spec.unit, sensor).items():
                yield sensor, effect, ("unit", sensor, effect), budget

    def budget(self, error: str) -> ErrorBudget | None:
        """The readable budget of `gyro.bias`."""
        sensor, _, effect = error.partition(".")
        return getattr(self.spec.unit, sensor).get(effect) if sensor in SENSORS else None

    def budgeted(self) -> list[str]:
        """Names of all errors that have a budget, readable or not."""
        return [f"{sensor}.{effect}" for sensor in SENSORS for effect in self.names("unit", sensor)]

    def calibrated(self) -> dict[str, list[Path]]:
        """error -> places where a readable test that is used calibrates it."""
        found: dict[str, list[Path]] = {}
        for name, test in self.spec.tests.items():
            if is_unused(test, self.spec.plan.fixed.get(name)):
                continue
            for index, error in enumerate(test.calibrates):
                found.setdefault(error, []).append(self.item(("tests", name, "calibrates"), index))
        return found

    def bench_of(self, test: Test, *parts: str) -> Bench | None:
        """The bench of a test, where these parts of it have no fault."""
        sound = all(self.whole("benches", test.bench, part) for part in parts)
        return self.spec.benches.get(test.bench) if sound else None

    @property
    def published(self) -> bool:
        """Whether it is sure that the plan is made by the published method."""
        return self.method_sure and self.spec.planned_by == "published"

    @property
    def by_information(self) -> bool:
        """Whether it is sure that the plan is made by information."""
        return self.method_sure and self.spec.planned_by == "information"

    @property
    def method_sure(self) -> bool:
        """Whether what decides about the method is readable."""
        return all(self.whole(*path) for path in (("requirement",), ("sensitivities",), ("plan", "method")))
