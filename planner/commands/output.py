"""What commands say: results on stdout, as text or JSON; progress on stderr, on a terminal only."""

from __future__ import annotations

import json
import math
import os
import re
import shlex
import signal
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from planner.commands.sign import showing, wanted
from planner.nouns.progress import silent

if TYPE_CHECKING:
    from rich.console import Console

    from planner.api.answer import Answer
    from planner.report.blocks import Report

SHOWN_PATHS = 10
STANDARD = "-"  # instead of a file: standard input or output
_COUNTED = re.compile(r"(\d+) of (\d+)")
_SAYING_ONLY = ("--json", "--quiet", "--verbose", "--force")
_VALUES_WITHOUT_EFFECT = ("-o", "--out", "--workers", "--cluster")


def answer(document: Mapping[str, Any], text: str, as_json: bool, exit_code: int = 0) -> None:
    """Print the result: the document in the envelope of all JSON, or the text."""
    typer.echo(json_line(document, exit_code) if as_json else text)


def json_line(result: Any, exit_code: int = 0, faults: Sequence[Mapping[str, Any]] = ()) -> str:
    """What every command says with --json, whatever its exit code: one shape, one line."""
    from planner import __version__

    document = {
        "command": command_name(),
        "version": __version__,
        "ok": exit_code == 0,
        "exit_code": exit_code,
        "faults": list(faults),
        "result": result,
    }
    return json.dumps(document, ensure_ascii=False, allow_nan=False)


def command_name() -> str:
    """The command that runs, `plan`; nothing where the command line names none."""
    return next((word for word in sys.argv[1:] if not word.startswith("-")), "")


class Said:
    """What was said of an answer before all of it was there: nobody waits for what stands beside it."""

    def __init__(self, *, silently: bool = False) -> None:
        self.silently = silently
        self.answer: Answer | None = None

    def say(self, found: Answer) -> None:
        """Print an answer with its notes; the same is then not said again."""
        if self.silently:
            return
        self.answer = found
        notes(found.notes)
        try:
            _print(found.reports, "")
            sys.stdout.flush()
        except (BrokenPipeError, SystemExit):  # who reads has gone, as `| head -1` does (rich then exits):
            pass  # the files are wanted all the same


def say(
    found: Answer,
    as_json: bool,
    out: Path | None = None,
    of: Path | str | None = None,
    *,
    written: str | None = None,
    extra: Mapping[str, Any] | None = None,
    first: Said | None = None,
) -> None:
    """Write an answer's files, say its notes, print it, and end with its exit code.

    out: where the files go, None for nowhere; of: what they are of, the spec or a word (`planner.own_files`);
    written: what is said of them, otherwise a line for each;
    extra: what the document says beside the answer, as where its files are.
    first: what was said of it already
    """
    from planner.own_files import write_own

    files: dict[Path, str | bytes] = {}
    if out is not None:
        with progress_line() as progress:
            progress("drawing and writing")
            files = found.placed(out, invocation())
            write_own(files, of, out, force=asked("--force"))
    said = None if first is None else first.answer
    notes(note for note in found.notes if said is None or note not in said.notes)
    if as_json:
        typer.echo(json_line({**(extra or {}), **found.to_dict()}, found.exit_code))
    else:
        _print(found.reports if said is None else (), listed(files) if written is None else written)
    if found.remark:
        typer.echo(found.remark, err=True)
    if found.exit_code:
        raise typer.Exit(found.exit_code)


def result(document: Mapping[str, Any], report: Report, as_json: bool) -> None:
    """Print the result: the document as JSON, or the report."""
    if as_json:
        typer.echo(json_line(document))
    else:
        _print([report], "")


def _print(reports: Sequence[Report], written: str) -> None:
    from planner.report.console import show

    for report in reports:
        show(report, console())
    if written:
        typer.echo(f"\n{written}")


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
        elif word not in _SAYING_ONLY and not word.startswith("-o"):
            kept.append(_by_name(word))
    return shlex.join(kept)


def _by_name(word: str) -> str:
    """`calibration.json@2026-03-01` of a path to that file; other words as they are."""
    return Path(word).name if os.path.exists(word.partition("@")[0]) else word


def asked(option: str) -> bool:
    """Whether an option of the whole program was given: --quiet, --verbose, --force."""
    return option in sys.argv[1:]


def refuse_existing(path: Path) -> None:
    """Raises InputError for a file that is there already, unless --force says that it may go."""
    from planner import own_files

    if not asked("--force"):
        own_files.refuse_existing(path)


def refuse_others(of: Path | str, out: Path | None, *names: str) -> None:
    """Raises InputError, before there is anything to lose, for files of a folder that are not to be replaced.

    And for a folder that cannot be written to.
    names: files that the command always writes; `say` looks at all, once they are made.
    """
    from planner import own_files

    if out is None or str(out) == STANDARD:
        return
    own_files.refuse_unwritable(out)
    if not asked("--force"):
        own_files.refuse_others({out / name: None for name in names}, of)


def notes(lines: Iterable[str]) -> None:
    """Say on stderr what the reader of a result should know; nothing with --quiet."""
    for line in lines if not asked("--quiet") else ():
        typer.echo(f"note: {line}", err=True)


def say_text(text: str | bytes, found: Answer) -> NoReturn:
    """One file of an answer on standard output instead of in a folder, and nothing else there."""
    notes(found.notes)
    sys.stdout.write(text.decode() if isinstance(text, bytes) else text)
    sys.stdout.flush()
    raise typer.Exit(found.exit_code)


@contextmanager
def until_ctrl_c() -> Iterator[Callable[[], bool]]:
    """Whether Ctrl-C was pressed: once asks for the best so far, twice ends at once."""
    pressed: list[int] = []

    def stop(number: int, frame: object) -> None:
        pressed.append(number)
        signal.signal(signal.SIGINT, before)
        typer.echo("stopping with the best so far; Ctrl-C again ends at once", err=True)

    try:
        before = signal.signal(signal.SIGINT, stop)
    except ValueError:  # not the main thread: whoever runs us listens
        yield lambda: False
        return
    try:
        yield lambda: bool(pressed)
    finally:
        signal.signal(signal.SIGINT, before)


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
    """A line that says what is being done, for how long and for how much longer, on stderr.

    On a terminal only, where its seconds run on while the work is silent; with --verbose a line for every
    stage anywhere, and one a second of what counts; with --quiet nowhere.
    """
    line = ProgressLine()
    if asked("--verbose") and sys.stderr is not None:
        yield line.print
        return
    if not wanted(sys.argv[1:]):
        yield silent
        return
    with showing(lambda: str(line)):
        yield line.say


class ProgressLine:
    """What is being done, since when, and since when at all; seconds by the given clock."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.clock = clock
        self.began = self.since = clock()
        self.message, self.printed = "starting", -math.inf

    def say(self, message: str) -> None:
        """Say something else now. A stage goes on while only its figures change."""
        if _stage(message) != _stage(self.message):
            self.since, self.printed = self.clock(), -math.inf
        self.message = message

    def print(self, message: str) -> None:
        """The same as a line of its own, of one stage at most one a second."""
        self.say(message)
        if self.clock() - self.printed >= 1.0:
            self.printed = self.clock()
            typer.echo(str(self), err=True)

    def __str__(self) -> str:
        now = self.clock()
        return timed(self.message, now - self.began, now - self.since)


def _stage(message: str) -> str:
    return re.sub(r"[0-9.]+", "", message)


def timed(message: str, seconds: float, in_stage: float) -> str:
    """A message with the time so far; where it counts (`3 of 10`), with the time that its stage has left."""
    found = _COUNTED.search(message)
    done, wanted = (int(found[1]), int(found[2])) if found else (0, 0)
    left = f", about {in_stage * (wanted - done) / done:.0f} s left" if 0 < done <= wanted else ""
    return f"{message} ({seconds:.0f} s{left})"
