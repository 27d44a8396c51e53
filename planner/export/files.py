"""Writing files whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from planner.errors import InputError


def write_whole(path: Path, text: str | bytes) -> None:
    """Write a text file so that a reader sees the old one or the new one, never a part.

    Temporary file in the same folder, fsync, rename. Raises InputError when the folder cannot be written.
    """
    write_all_whole({path: text})


def write_all_whole(files: Mapping[Path, str | bytes]) -> None:
    """Write several files; none appears before all are safely on the disk.

    Raises InputError, leaving no temporary file and no new folder behind, when a folder cannot be made or
    written, or the disk is full. A device or a pipe is written as it is: nothing must take its place.
    """
    waiting: list[tuple[Path, Path]] = []
    made: list[Path] = []
    try:
        for path, content in files.items():
            target = Path(os.path.realpath(path))
            made += _make_folder(target.parent)
            if target.exists() and not target.is_file() and not target.is_dir():
                target.write_bytes(_bytes(content))
            else:
                waiting.append((_temporary(target, content), target))
        for temporary, target in waiting:
            os.replace(temporary, target)
        made.clear()
    except OSError as error:
        raise InputError(f"cannot write {_place(error, files)}: {error.strerror}") from error
    finally:
        for temporary, _ in waiting:
            temporary.unlink(missing_ok=True)
        for folder in reversed(made):
            with suppress(OSError):
                folder.rmdir()


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


def _bytes(content: str | bytes) -> bytes:
    return content if isinstance(content, bytes) else content.encode()


def _temporary(path: Path, content: str | bytes) -> Path:
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(_bytes(content))
            file.flush()
            os.fsync(file.fileno())
        temporary.chmod(0o644)  # mkstemp makes files that only their owner can read
    except BaseException:  # Ctrl-C too leaves no temporary file behind
        temporary.unlink(missing_ok=True)
        raise
    return temporary
