"""The journal: one line of JSON per finished step, on the disk before the next step begins.

A line that a power cut tore is no line: its step had not been reported as finished. A record is finished when
its line is on the disk; raw data of a record without a line are void, and it is made again. That a record
begins (`begin`) and that one was void (`void`) have lines of their own.
"""

from __future__ import annotations

import json
import os
import stat
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from planner.bench_run.errors import BenchFault
from planner.bench_run.journal_lines import Begun, Entry, JournalLines, read_lines
from planner.errors import InputError, unusable_file
from planner.nouns.given_files import JOURNAL

FORMAT = 1
HEAD = b'{"journal": '  # what every journal begins with

__all__ = ["Begun", "Entry", "Journal", "Past", "now_text", "open_journal", "read_past"]


@dataclass(frozen=True)
class Past:
    """What a journal tells: finished steps, sessions begun, power-ons made, records that have no end."""

    entries: tuple[Entry, ...] = ()
    sessions: int = 0
    power_ons: int = 0
    begun: tuple[Begun, ...] = ()


class Journal:
    """An open journal, ours alone; `append` returns when the line is on the disk."""

    def __init__(self, path: Path, handle: int, past: Past) -> None:
        self.path, self.past = path, past
        self._handle, self._lock, self._counting = handle, threading.Lock(), threading.Lock()
        self.session, self.power_ons = past.sessions + 1, past.power_ons
        self.told = len(past.entries)  # finished steps

    def append(self, line: Mapping[str, Any]) -> None:
        """Write one line and wait for the disk. Raises BenchFault when it is full: no part of it stays."""
        data = (json.dumps(line, ensure_ascii=False, allow_nan=False) + "\n").encode()
        with self._lock:
            size = self._size()
            try:
                while data:
                    data = data[os.write(self._handle, data) :]
                os.fsync(self._handle)
            except OSError as error:
                with suppress(OSError):
                    os.ftruncate(self._handle, size)
                raise BenchFault(
                    f"cannot write {self.path}: {error.strerror}; make room, then go on with --resume"
                ) from error
            self.told += "step" in line

    def finished(self, entry: Entry) -> None:
        """A step is done."""
        self.append({key: value for key, value in vars(entry).items() if value is not None})

    def begun(self, step: str, start_s: float) -> None:
        """A record begins: known to be void if its end is never told."""
        self.append({"begin": step, "start_s": round(start_s, 6), **self._now()})

    def void(self, step: str, why: str, start_s: float, end_s: float | None) -> None:
        """A record was made in vain; end_s: None where nobody knows."""
        end = None if end_s is None else round(end_s, 6)
        self.append({"void": step, "why": why, "start_s": round(start_s, 6), "end_s": end, **self._now()})

    def power_on(self) -> int:
        """Number of the power-on that begins now, over all sessions; on the disk before it is used."""
        with self._counting:
            self.power_ons += 1
            number = self.power_ons
        self.append({"power_on": number, "session": self.session})
        return number

    def close(self) -> None:
        """Let others have it."""
        os.close(self._handle)

    def _now(self) -> dict[str, Any]:
        return {"session": self.session, "power_on": self.power_ons, "utc": now_text()}

    def _size(self) -> int:
        return os.fstat(self._handle).st_size


class LaneJournal(Journal):
    """The part of a journal that tells of one bench, of several that work side by side and share the file."""

    def __init__(self, whole: Journal, steps: Sequence[str]) -> None:
        own, past = set(steps), whole.past
        entries = tuple(entry for entry in past.entries if entry.step in own)
        begun = tuple(one for one in past.begun if one.step in own)
        super().__init__(whole.path, -1, replace(past, entries=entries, begun=begun))
        self._whole, self.session = whole, whole.session
        self.power_ons = entries[-1].power_on if entries else past.power_ons

    def append(self, line: Mapping[str, Any]) -> None:
        """As one of the whole."""
        self._whole.append(line)

    def power_on(self) -> int:
        """Numbers are given once for all benches."""
        self.power_ons = self._whole.power_on()
        return self.power_ons

    def close(self) -> None:
        """The whole is closed by whoever opened it."""


def now_text() -> str:
    """The moment in UTC, to the millisecond."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def open_journal(
    path: Path,
    plan_sha256: str,
    steps: Sequence[str],
    *,
    resume: bool,
    from_start: bool = False,
    lanes: Sequence[Sequence[str]] = (),
) -> Journal:
    """A new journal, or with `resume` the one that is there, cut back to its last whole line.

    from_start: with `resume`, whether a journal that tells nothing (missing, empty, torn in its first line)
    may be begun; such a one may be all that is left of a campaign half made.
    lanes: the steps of benches that work side by side, each in its order; left out: all steps in one
    Raises InputError when one is there that tells of finished steps and `resume` is not given, for the
    journal of another plan, for one that does not tell this plan's steps in order, and while another run has
    it open.
    """
    if resume and not from_start and not path.exists():
        raise InputError(_nothing_told(path, "is not there"))
    handle = _opened(path)
    try:
        data = path.read_bytes()
        whole = data[: data.rfind(b"\n") + 1]
        if not whole:
            _check_new(path, data, resume and not from_start)
            past = Past()
        else:
            past = _past(path, whole, plan_sha256, (lanes or (steps,)) if resume else None)
        if whole and from_start and past.entries:
            raise InputError(
                f"{path} tells of {len(past.entries)} finished steps; leave --from-start out to go on after "
                "them, or give another --journal FILE"
            )
        if len(whole) < len(data):
            os.ftruncate(handle, len(whole))
        journal = Journal(path, handle, past)
        if not whole:
            journal.append({"journal": FORMAT, "plan_sha256": plan_sha256, "steps": len(steps)})
            _sync_folder(path.parent)
        journal.append({"session": journal.session})
    except BaseException as error:  # Ctrl-C too closes the file
        os.close(handle)
        if isinstance(error, BenchFault):  # nothing has moved yet
            raise InputError(str(error)) from error
        raise
    return journal


def read_past(
    path: Path, plan_sha256: str, steps: Sequence[str], lanes: Sequence[Sequence[str]] = ()
) -> Past:
    """What a journal tells, without opening it for writing; nothing when there is none."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise InputError(f"{path} is no file; give another --journal FILE")
        data = path.read_bytes()
    except FileNotFoundError:
        return Past()
    except OSError as error:
        raise unusable_file(path, error, JOURNAL) from error
    return _past(path, data[: data.rfind(b"\n") + 1], plan_sha256, lanes or (steps,))


def _check_new(path: Path, data: bytes, resumed: bool) -> None:
    """Raises InputError when a file without a whole line cannot be begun as a journal."""
    if data and not HEAD.startswith(data[: len(HEAD)]):
        raise InputError(f"{path} is no journal of planner; give another --journal FILE")
    if resumed:
        raise InputError(_nothing_told(path, "is torn in its first line" if data else "is empty"))


def _nothing_told(path: Path, how: str) -> str:
    return (
        f"there is nothing to resume: {path} {how}. If nothing of this campaign has been made, begin with "
        "--resume --from-start; else find its journal"
    )


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


def _sync_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _in_order(told: JournalLines, lanes: Sequence[Sequence[str]]) -> bool:
    """Whether the finished steps are the first of every lane, in its order."""
    lane_of = {step: i for i, lane in enumerate(lanes) for step in lane}
    made: list[list[str]] = [[] for _ in lanes]
    for entry in told.entries:
        if entry.step not in lane_of:
            return False
        made[lane_of[entry.step]].append(entry.step)
    return all(own == list(lane[: len(own)]) for own, lane in zip(made, lanes, strict=True))


def _past(path: Path, whole: bytes, plan_sha256: str, lanes: Sequence[Sequence[str]] | None) -> Past:
    """lanes: None where no step may have been finished, because the campaign is to begin."""
    if not whole:
        return Past()
    told = read_lines(path, whole)
    if told.form != FORMAT:
        raise InputError(f"{path} is no journal of planner; give another --journal FILE")
    if told.plan_sha256 != plan_sha256:
        raise InputError(f"{path} is the journal of another plan; give another --journal FILE")
    if lanes is None and told.entries:
        raise InputError(f"{path} is there already: go on with --resume, or give another --journal FILE")
    if lanes is not None and not _in_order(told, lanes):
        raise InputError(f"{path} does not tell the plan's steps in order: it was changed by hand")
    return Past(told.entries, told.sessions, told.power_ons, told.begun)
