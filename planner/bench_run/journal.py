"""The journal: one line of JSON per finished step, on the disk before the next step begins.

A line that a power cut tore is no line: its step had not been reported as finished. A record is finished when
its line is on the disk; raw data of a record without a line are void, and it is made again.
"""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planner.errors import InputError

FORMAT = 1


@dataclass(frozen=True)
class Entry:
    """One finished step: seconds on the session's clock, the session and the power-on it was made in."""

    step: str
    start_s: float
    end_s: float
    session: int
    power_on: int
    utc: str
    temperature_degc: float | None = None


@dataclass(frozen=True)
class Past:
    """What a journal tells: finished steps in order, sessions begun, power-ons made."""

    entries: tuple[Entry, ...] = ()
    sessions: int = 0
    power_ons: int = 0


class Journal:
    """An open journal, ours alone; `append` returns when the line is on the disk."""

    def __init__(self, path: Path, handle: int, past: Past) -> None:
        self.path, self.past = path, past
        self._handle = handle
        self.session, self.power_ons = past.sessions + 1, past.power_ons

    def append(self, line: Mapping[str, Any]) -> None:
        """Write one line and wait for the disk. Raises InputError when it is full."""
        data = (json.dumps(line, ensure_ascii=False, allow_nan=False) + "\n").encode()
        try:
            while data:
                data = data[os.write(self._handle, data) :]
            os.fsync(self._handle)
        except OSError as error:
            raise InputError(
                f"cannot write {self.path}: {error.strerror}; make room, then go on with --resume"
            ) from error

    def finished(self, entry: Entry) -> None:
        """A step is done."""
        self.append({key: value for key, value in vars(entry).items() if value is not None})

    def power_on(self) -> int:
        """Number of the power-on that begins now, over all sessions; on the disk before it is used."""
        self.power_ons += 1
        self.append({"power_on": self.power_ons, "session": self.session})
        return self.power_ons

    def close(self) -> None:
        """Let others have it."""
        os.close(self._handle)


def open_journal(path: Path, plan_sha256: str, steps: Sequence[str], *, resume: bool) -> Journal:
    """A new journal, or with `resume` the one that is there, cut back to its last whole line.

    Raises InputError when one is there that tells of finished steps and `resume` is not given, for the
    journal of another plan, for one that does not tell this plan's steps in order, and while another run has
    it open.
    """
    handle = _opened(path)
    try:
        data = path.read_bytes()
        whole = data[: data.rfind(b"\n") + 1]
        past = (
            _past(path, whole, plan_sha256, steps)
            if resume or not whole
            else _unbegun(path, whole, plan_sha256)
        )
        if len(whole) < len(data):
            os.ftruncate(handle, len(whole))
        journal = Journal(path, handle, past)
        if not whole:
            journal.append({"journal": FORMAT, "plan_sha256": plan_sha256, "steps": len(steps)})
            _sync_folder(path.parent)
        journal.append({"session": journal.session})
    except BaseException:  # Ctrl-C too closes the file
        os.close(handle)
        raise
    return journal


def read_past(path: Path, plan_sha256: str, steps: Sequence[str]) -> Past:
    """What a journal tells, without opening it for writing; nothing when there is none."""
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        return Past()
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from error
    return _past(path, data[: data.rfind(b"\n") + 1], plan_sha256, steps)


def _opened(path: Path) -> int:
    import fcntl

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from error
    if not stat.S_ISREG(os.fstat(handle).st_mode):  # a device may have no end to read to
        os.close(handle)
        raise InputError(f"{path} is no file; give another --journal FILE")
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)  # the system lets go of it even after kill -9
    except OSError as error:
        os.close(handle)
        raise InputError(f"{path} is in use by another run") from error
    return handle


def _unbegun(path: Path, whole: bytes, plan_sha256: str) -> Past:
    """A journal of this plan in which no step was finished: its run never reached the bench."""
    try:
        return _past(path, whole, plan_sha256, ())  # refuses any finished step
    except InputError:
        raise InputError(
            f"{path} is there already: go on with --resume, or give another --journal FILE"
        ) from None


def _sync_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _past(path: Path, whole: bytes, plan_sha256: str, steps: Sequence[str]) -> Past:
    lines = [_line(path, number, text) for number, text in enumerate(whole.splitlines(), start=1)]
    if not lines:
        return Past()
    if lines[0].get("journal") != FORMAT:
        raise InputError(f"{path} is no journal of planner; give another --journal FILE")
    if lines[0].get("plan_sha256") != plan_sha256:
        raise InputError(f"{path} is the journal of another plan; give another --journal FILE")
    try:
        entries = tuple(Entry(**line) for line in lines[1:] if "step" in line)
    except TypeError as error:
        raise InputError(f"{path} is no journal of planner: {error}") from error
    if [entry.step for entry in entries] != list(steps[: len(entries)]):
        raise InputError(f"{path} does not tell the plan's steps in order: it was changed by hand")
    sessions = sum(1 for line in lines[1:] if list(line) == ["session"])
    return Past(entries, sessions, sum(1 for line in lines if list(line)[:1] == ["power_on"]))


def _line(path: Path, number: int, text: bytes) -> dict[str, Any]:
    try:
        line = json.loads(text)
    except ValueError as error:
        raise InputError(f"{path}, line {number}, is not JSON: it was changed by hand") from error
    if not isinstance(line, dict):
        raise InputError(f"{path}, line {number}, is no line of a journal")
    return line
