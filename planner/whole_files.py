"""Writing files whole or not at all, and files that belong together together.

A file is written beside its place, synced, and renamed. Files of one set are renamed right after one another
by a process of their own: kill -9 of the writer, at any moment, leaves the old set or the new one.
"""

from __future__ import annotations

import os
import re
import secrets
import signal
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from planner.errors import InputError

_OURS = re.compile(r"\.(?P<name>.+)\.(?P<pid>\d+)-\w{8}\.part")  # the file's name, whose process it is
Moves = list[tuple[Path, Path]]  # from, to


def write_whole(path: Path, text: str | bytes) -> None:
    """Write a text file so that a reader sees the old one or the new one, never a part.

    Temporary file in the same folder, fsync, rename. Raises InputError when the folder cannot be written.
    """
    write_all_whole({path: text})


def write_all_whole(files: Mapping[Path, str | bytes]) -> None:
    """Write several files; none appears before all are safely on the disk, and then all do.

    Raises InputError, leaving no temporary file and no new folder behind, when a folder cannot be made or
    written, or the disk is full. A device or a pipe is written as it is: nothing must take its place.
    What a process that died left behind in these folders is swept away.
    """
    waiting: Moves = []
    made: list[Path] = []
    try:
        for path, content in files.items():
            target = Path(os.path.realpath(path))
            made += _make_folder(target.parent)
            if target.exists() and not target.is_file() and not target.is_dir():
                target.write_bytes(as_bytes(content))
            else:
                waiting.append((_temporary(target, content), target))
        _replace_together(waiting)
        made.clear()
    except OSError as error:
        raise InputError(f"cannot write {_place(error, files)}: {error.strerror}") from error
    finally:
        for temporary, _ in waiting:
            temporary.unlink(missing_ok=True)
        for folder in reversed(made):
            with suppress(OSError):
                folder.rmdir()


def _replace_together(moves: Moves) -> None:
    """Rename all, by another process where there are several: it goes on when this one is killed.

    Raises OSError before anything is renamed for a place that is a folder.
    """
    for _, target in moves:
        if target.is_dir():
            raise IsADirectoryError(21, os.strerror(21), str(target))
    if len(moves) < 2 or not hasattr(os, "fork"):
        _rename(moves)
        return
    with _undisturbed():
        olds = [old for _, target in moves if (old := _second_name(target)) is not None]
        try:
            _by_another(moves)
        finally:
            for old in olds:
                old.unlink(missing_ok=True)


def _second_name(target: Path) -> Path | None:
    """Another name for the old file: to free its blocks within the renaming would take milliseconds."""
    name = target.with_name(f".{target.name}.{os.getpid()}-{secrets.token_hex(4)}.part")
    with suppress(OSError):
        os.link(target, name)
        return name
    return None


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Ctrl-C waits until all is renamed."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _by_another(moves: Moves) -> None:
    told, tell = os.pipe()
    done, say_done = os.pipe()
    try:
        child = os.fork()
    except OSError:  # no memory for a second process
        child = -1
    if child == 0:
        os.close(tell)
        _follow(moves, told, say_done)
    for handle in (told, say_done):
        os.close(handle)
    renamed = False
    try:
        if child > 0:
            os.write(tell, b"!")
            renamed = os.read(done, 1) == b"!"
            os.waitpid(child, 0)
        if not renamed:  # whatever became of the other one
            _rename([(old, new) for old, new in moves if old.exists()])
    finally:
        os.close(tell)
        os.close(done)


def _follow(moves: Moves, told: int, say_done: int) -> None:
    """The other process: rename when told to; sweep when the writer dies before. Never returns."""
    try:
        os.setsid()  # so that a signal to the writer's group does not reach it
        if os.read(told, 1) == b"!":
            _rename(moves)
            os.write(say_done, b"!")
        else:
            for temporary, _ in moves:
                with suppress(OSError):
                    os.unlink(temporary)
    finally:
        os._exit(0)


def _rename(moves: Moves) -> None:
    for temporary, target in moves:
        os.replace(temporary, target)


def _sweep(target: Path) -> None:
    """Temporary files of this file whose process has died."""
    for path in target.parent.glob(f".{_escaped(target.name)}.*.part"):
        found = _OURS.fullmatch(path.name)
        if found and found["name"] == target.name and not _alive(int(found["pid"])):
            path.unlink(missing_ok=True)


def _escaped(name: str) -> str:
    return re.sub(r"([*?\[])", r"[\1]", name)


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True  # somebody else's
    return True


def _place(error: OSError, files: Mapping[Path, str | bytes]) -> str:
    """The file that could not be written; never the name of its temporary one."""
    at = Path(error.filename2 or error.filename) if error.filename else None
    if at is None or at.name.startswith("."):
        return str(next(iter(files), at) if at is None else at.parent)
    return str(at)


def _make_folder(folder: Path) -> list[Path]:
    """Make a folder and those above it; which ones are new."""
    new = []
    while not folder.exists():
        new.append(folder)
        folder = folder.parent
    for each in reversed(new):
        each.mkdir(exist_ok=True)
    return new[::-1]


def as_bytes(content: str | bytes) -> bytes:
    """What stands in the file."""
    return content if isinstance(content, bytes) else content.encode()


def temporary_beside(target: Path) -> tuple[int, Path]:
    """A new file in the folder of another, open for writing, to be renamed to it when it is whole.

    Those that dead processes left for the same file are swept away.
    """
    _sweep(target)
    handle, name = tempfile.mkstemp(
        prefix=f".{target.name}.{os.getpid()}-", suffix=".part", dir=target.parent
    )
    return handle, Path(name)


def _temporary(path: Path, content: str | bytes) -> Path:
    handle, temporary = temporary_beside(path)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(as_bytes(content))
            file.flush()
            os.fsync(file.fileno())
        temporary.chmod(0o644)  # mkstemp makes files that only their owner can read
    except BaseException:  # Ctrl-C too leaves no temporary file behind
        temporary.unlink(missing_ok=True)
        raise
    return temporary
