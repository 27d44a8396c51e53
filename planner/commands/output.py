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

import click
import typer

if TYPE_CHECKING:
    from rich.console import Console

    from planner.report.blocks import Report

SHOWN_PATHS = 10
_WITHOUT_EFFECT = ("out", "as_json", "workers", "cluster")


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
    from planner.export.files import write_all_whole

    write_all_whole(files)
    notes(remarks)
    result(document, report, as_json, listed(files) if written is None else written)


def page_of(report: Report) -> str:
    """The report as a page that names the command which made it."""
    from planner.report.page import html

    return html(replace(report, command=invocation()))


def invocation() -> str:
    """The command line as it was given, without what changes no result: folders, where to write, workers."""
    from click.core import ParameterSource

    context = click.get_current_context(silent=True)
    if context is None:
        return ""
    words = [context.command_path]
    for parameter in context.command.params:
        name = parameter.name or ""
        given = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if given and name not in _WITHOUT_EFFECT:
            values = context.params[name]
            for value in values if isinstance(values, list | tuple) else [values]:
                words += _argument(parameter, value)
    return shlex.join(words)


def _argument(parameter: click.Parameter, value: Any) -> list[str]:
    """`FILE`, `--seed 3` or `--residual`; of a file its name alone."""
    text = Path(value).name if Path(str(value).partition("@")[0]).exists() else str(value)
    if isinstance(parameter, click.Argument):
        return [text]
    flags = parameter.opts if value is not False else parameter.secondary_opts
    longest = max(flags, key=len, default="")
    return [longest] if isinstance(value, bool) else [longest, text]


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
