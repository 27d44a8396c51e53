"""Every error that planner raises on purpose; each knows the exit code that it ends the program with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from planner.codes import remedy

QUOTED = 100  # characters of a line that are shown


class PlannerError(Exception):
    """Base of all our errors: something the user can act on, never a traceback."""

    exit_code = 70


class Unfit(ValueError):
    """A value that its field refuses, by the rule of a code."""

    def __init__(self, code: str, message: str) -> None:
        self.code = code
        super().__init__(message)


@dataclass(frozen=True, order=True)
class Fault:
    """One thing wrong in one place of an input file.

    `line` and `column` count from 1; 0 means that the place is the whole file.
    message: what is wrong, and behind its first semicolon what to do
    code: of the rule that it breaks, which `planner explain` explains (`planner.codes`)
    quote: the line of the file, where it was at hand
    """

    file: str
    line: int
    column: int
    path: str
    message: str
    code: str = ""
    quote: str = field(default="", compare=False)

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}:{self.column}" if self.line else self.file
        said = f"{self.path}: {self.message}" if self.path else self.message
        return f"{place}  {said}  [{self.code}]" if self.code else f"{place}  {said}"

    @property
    def wrong(self) -> str:
        """What is wrong, without what to do."""
        return self.message.partition("; ")[0]

    @property
    def remedy(self) -> str:
        """What to do: what the message says of it, else what its rule says."""
        return self.message.partition("; ")[2] or remedy(self.code)

    @property
    def shown(self) -> str:
        """As `str`, with the line of the file and a caret under the place where the line is known."""
        if not self.quote.strip():
            return str(self)
        first = max(0, self.column - 1 - QUOTED // 2) if len(self.quote) > QUOTED else 0
        line = self.quote[first : first + QUOTED].replace("\t", " ")
        margin = f"{self.line:>6} | "
        return f"{self}\n{margin}{line}\n{' ' * (len(margin) + self.column - 1 - first)}^"

    def document(self) -> dict[str, str | int]:
        """As JSON has it."""
        return {
            "code": self.code,
            "file": self.file,
            "path": self.path,
            "line": self.line,
            "column": self.column,
            "message": self.wrong,
            "remedy": self.remedy,
        }


class InputError(PlannerError):
    """The input is wrong (exit 2). Carries every fault that was found, not only the first."""

    exit_code = 2

    def __init__(self, message: str, faults: Sequence[Fault] = ()) -> None:
        self.faults = tuple(sorted(faults))
        self.message = message
        super().__init__("\n".join([message, *map(str, self.faults)]) if faults else message)

    @property
    def shown(self) -> str:
        """As `str`, with the lines of the file that are at fault."""
        return "\n".join([self.message, *(fault.shown for fault in self.faults)])


def unusable_file(file: object, why: OSError | str, give: str) -> InputError:
    """The error of a file that is not there, or holds nothing that could be read.

    why: of the system, or e.g. `is empty`; give: what to give instead, and which command makes it
    """
    known = {FileNotFoundError: "does not exist", IsADirectoryError: "is a folder"}
    wrong = why if isinstance(why, str) else known.get(type(why), f"cannot be opened: {why.strerror}")
    return InputError(f"cannot read {file}", [Fault(str(file), 0, 0, "", f"{wrong}; give {give}", "P001")])


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
