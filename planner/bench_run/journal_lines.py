"""The lines of a journal, read back: each is checked, whatever somebody has made of the file."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any

from planner.errors import InputError


@dataclass(frozen=True)
class Entry:
    """One finished step: seconds on the session's clock, the session and the power-on it was made in.

    planned_start_s, planned_end_s: on the plan's clock; None in journals of older planners
    """

    step: str
    start_s: float
    end_s: float
    session: int
    power_on: int
    utc: str
    temperature_degc: float | None = None
    planned_start_s: float | None = None
    planned_end_s: float | None = None


@dataclass(frozen=True)
class Begun:
    """A record that was begun and of which nobody has told the end."""

    step: str
    start_s: float
    power_on: int
    utc: str


@dataclass(frozen=True)
class JournalLines:
    """What stands in a journal."""

    form: Any
    plan_sha256: Any
    entries: tuple[Entry, ...]
    sessions: int
    power_ons: int
    begun: tuple[Begun, ...]


def read_lines(path: Path, whole: bytes) -> JournalLines:
    """Whole lines of a journal. Raises InputError naming the first line that is none of ours."""
    head: Mapping[str, Any] = {}
    entries: list[Entry] = []
    sessions = power_ons = 0
    begun: dict[str, Begun] = {}
    for number, text in enumerate(whole.splitlines(), start=1):
        line = _line(path, number, text)
        if number == 1:
            head = line
        elif "step" in line:
            entries.append(_record(path, number, line, Entry))
            begun.pop(line["step"], None)
        elif "begin" in line:
            one = _record(path, number, {**line, "step": line["begin"]}, Begun)
            begun[one.step] = one
        elif "void" in line:
            begun.pop(str(line["void"]), None)
        elif "power_on" in line:
            power_ons += 1
        elif list(line) == ["session"]:
            sessions += 1
    return JournalLines(
        head.get("journal"),
        head.get("plan_sha256"),
        tuple(entries),
        sessions,
        power_ons,
        tuple(begun.values()),
    )


def _line(path: Path, number: int, text: bytes) -> dict[str, Any]:
    try:
        line = json.loads(text)
    except (ValueError, RecursionError) as error:  # of JSON, of its text, of thousands of brackets
        raise InputError(f"{path}, line {number}, is not JSON: it was changed by hand") from error
    if not isinstance(line, dict):
        raise InputError(f"{path}, line {number}, is no line of a journal")
    return line


def _record(path: Path, number: int, line: Mapping[str, Any], kind: type[Any]) -> Any:
    known = {field.name: field for field in fields(kind)}
    given = {key: value for key, value in line.items() if key in known}
    missing = [name for name, field in known.items() if field.default is MISSING and name not in given]
    strange = [] if kind is Begun else sorted(set(line) - set(known))
    wrong = [name for name, value in given.items() if not _fits(str(known[name].type), value)]
    if missing or strange or wrong:
        named = ", ".join([*missing, *strange, *wrong])
        raise InputError(f"{path}, line {number}, is no line of a journal of planner: see {named}")
    return kind(**given)


def _fits(kind: str, value: object) -> bool:
    """Whether a value is of a field's kind; a truth value is no number, and neither is NaN."""
    if kind == "str":
        return isinstance(value, str)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value is None and kind.endswith("None")
    return isinstance(value, int) if kind == "int" else math.isfinite(value)
