"""What commands say: results on stdout, as text or JSON; progress on stderr, on a terminal only."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.console import Console

SpecFile = Annotated[Path, typer.Argument(metavar="SPEC", help="YAML spec.", show_default=False)]
AsJson = Annotated[bool, typer.Option("--json", help="Machine-readable result on stdout.")]
SHOWN_PATHS = 10


def answer(document: dict[str, Any], text: str, as_json: bool) -> None:
    """Print the result: the document as JSON, or the text."""
    typer.echo(json.dumps(document, ensure_ascii=False) if as_json else text)


def listed(paths: list[str]) -> str:
    """A line for each file written; long lists are cut."""
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
