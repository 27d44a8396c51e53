"""Writing files whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from planner.errors import InputError


def write_whole(path: Path, text: str) -> None:
    """Write a text file so that a reader sees the old one or the new one, never a part.

    Temporary file in the same folder, fsync, rename. Raises InputError when the folder cannot be written.
    """
    write_all_whole({path: text})


def write_all_whole(files: Mapping[Path, str]) -> None:
    """Write several files; none appears before all are safely on the disk.

    Raises InputError, leaving no temporary file behind, when a folder cannot be made or written.
    """
    waiting: list[tuple[Path, Path]] = []
    try:
        for path, text in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            waiting.append((_temporary(path, text), path))
        for temporary, path in waiting:
            os.replace(temporary, path)
    except OSError as error:
        raise InputError(f"cannot write {error.filename or 'the output'}: {error.strerror}") from error
    finally:
        for temporary, _ in waiting:
            temporary.unlink(missing_ok=True)


def _temporary(path: Path, text: str) -> Path:
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    temporary = Path(name)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        temporary.chmod(0o644)  # mkstemp makes files that only their owner can read
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    return temporary
