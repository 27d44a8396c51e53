"""What commands say: results on stdout, as text or JSON; progress on stderr, on a terminal only."""

from __future__ import annotations

import json
import os
import shlex
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from planner.report.blocks import Report

SHOWN_PATHS = 10
_VALUES_WITHOUT_EFFECT = ("-o", "--out", "--workers", "--cluster")


def answer(document: Mapping[str, Any], text: str, as_json: bool) -> None:
    """Print the result: the document as JSON, or the text."""
    typer.echo(json.dumps(document, ensure_ascii=False, allow_nan=False) if as_json else text)


def result(
    document: Mapping[str, Any], report: Report | Sequence[Report], as_json: bool, written: str = ""
) -> None:
    """Print the result: the document as JSON, or the report, then what was written."""
    if as_json:
        answer(document, "", as_json)
        return
    from planner.report.blocks import Report
    from planner.report.console import show

    for each in [report] if isinstance(report, Report) else report:
        show(each, console())
    if written:
        typer.echo(f"\n{written}")


def deliver(
    files: Mapping[Path, str | bytes],
    remarks: Iterable[str],
    document: Mapping[str, Any],
    report: Report | Sequence[Report],
    as_json: bool,
    written: str | None = None,
) -> None:
    """Write the files; then notes, the result and a line for each file, or what `written` says of them."""
    from planner.whole_files import write_all_whole

    write_all_whole(files)
    notes(remarks)
    result(document, report, as_json, listed(files) if written is None else written)


def page_of(report: Report) -> str:
    """The report as a page that names the command which made it."""
    from planner.report.page import html

    return html(replace(report, command=invocation()))


def invocation() -> str:
    """The command line without what changes no page: where to write, workers; of a file its name alone."""
    words, kept = iter(sys.argv[1:]), ["planner"]
    for word in words:
        option, is_set, value = word.partition("=")
        if option in _VALUES_WITHOUT_EFFECT:
            if not is_set:
                next(words, None)
        elif word.startswith("--") and is_set:
            kept.append(f"{option}={_by_name(value)}")
        elif word != "--json" and not word.startswith("-o"):
            kept.append(_by_name(word))
    return shlex.join(kept)


def _by_name(word: str) -> str:
    """`calibration.json@2026-03-01` of a path to that file; other words as they are."""
    return Path(word).name if os.path.exists(word.partition("@")[0]) else word


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
    if sys.stderr is None or not sys.stderr.isatty() or "NO_COLOR" in os.environ:
        yield lambda message: None
        return
    from rich.console import Console

    with Console(stderr=True).status("starting") as status:
        yield lambda message: status.update(message)
