"""Every error that planner raises on purpose; each knows the exit code that it ends the program with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


class PlannerError(Exception):
    """Base of all our errors: something the user can act on, never a traceback."""

    exit_code = 70


@dataclass(frozen=True, order=True)
class Fault:
    """One thing wrong in one place of an input file.

    `line` and `column` count from 1; 0 means that the place is the whole file.
    """

    file: str
    line: int
    column: int
    path: str
    message: str

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}:{self.column}" if self.line else self.file
        return f"{place}  {self.path}: {self.message}" if self.path else f"{place}  {self.message}"


class InputError(PlannerError):
    """The input is wrong (exit 2). Carries every fault that was found, not only the first."""

    exit_code = 2

    def __init__(self, message: str, faults: Sequence[Fault] = ()) -> None:
        self.faults = tuple(sorted(faults))
        self.message = message
        super().__init__("\n".join([message, *map(str, self.faults)]) if faults else message)


class NothingFound(InputError):
    """The data answer nothing of what was asked (exit 1): what they lack."""

    exit_code = 1


class InfeasibleError(PlannerError):
    """The requirement cannot be met (exit 3): what binds, and the nearest requirement that can be met."""

    exit_code = 3

    def __init__(
        self,
        message: str,
        *,
        requirement: int = 0,
        binds: Sequence[tuple[str, float]] = (),
        nearest_limit: float | None = None,
    ) -> None:
        self.requirement = requirement
        self.binds = tuple(binds)
        self.nearest_limit = nearest_limit
        super().__init__(message)


class StoppedEarly(PlannerError):
    """Stopped before the proof was complete (exit 4); the best answer so far was kept and is marked."""

    exit_code = 4
