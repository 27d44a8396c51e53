"""What commands say: results on stdout, as text or JSON; progress on stderr, on a terminal only."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from rich.console import Console

SHOWN_PATHS = 10


def answer(document: Mapping[str, Any], text: str, as_json: bool) -> None:
    """Print the result: the document as JSON, or the text."""
    typer.echo(json.dumps(document, ensure_ascii=False, allow_nan=False) if as_json else text)


def result(
    document: Mapping[str, Any], show: Callable[[Console], None], as_json: bool, written: str = ""
) -> None:
    """Print the result: the document as JSON, or what `show` prints, then what was written."""
    if as_json:
        answer(document, "", as_json)
        return
    show(console())
    if written:
        typer.echo(f"\n{written}")


def deliver(
    files: Mapping[Path, str | bytes],
    remarks: Iterable[str],
    document: Mapping[str, Any],
    show: Callable[[Console], None],
    as_json: bool,
    written: str | None = None,
) -> None:
    """Write the files; then notes, the result and a line for each file, or what `written` says of them."""
    from planner.export.files import write_all_whole

    write_all_whole(files)
    notes(remarks)
    result(document, show, as_json, listed(files) if written is None else written)


def notes(lines: Iterable[str]) -> None:
    """Say on stderr what the reader of a result should know."""
    for line in lines:
        typer.echo(f"note: {line}", err=True)


def of_units(documents: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The document of one unit as it is; those of several under `units`."""
    return documents[0] if len(documents) == 1 else {"units": list(documents)}


def listed(paths: Iterable[Path | str]) -> str:
    """A line for each file written; long lists are cut."""
    paths = list(paths)
    more = f"\nand {len(paths) - SHOWN_PATHS} more" if len(paths) > SHOWN_PATHS else ""
    return "\n".join(f"wrote {path}" for path in paths[:SHOWN_PATHS]) + more


def console() -> Console:
    """The console for tables."""
    from rich.console import Console

    return Console(highlight=False, soft_wrap=not sys.stdout.isatty())


@contextmanager
def progress_line() -> Iterator[Any]:
    """A line that says what is being done, on stderr, only on a terminal."""
    if not sys.stderr.isatty() or "NO_COLOR" in os.environ:
        yield lambda message: None
        return
    from rich.console import Console

    with Console(stderr=True).status("starting") as status:
        yield lambda message: status.update(message)
