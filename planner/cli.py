"""The commands, no arithmetic: each reads its arguments, calls the pipeline and writes what comes back."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer

from planner.commands import (
    bench,
    data,
    docs,
    effects,
    explaining,
    fleet,
    migrating,
    planning,
    promise,
    recordings,
    reproducing,
    running,
    starting,
)
from planner.commands import diagnosing as diagnosis
from planner.errors import InfeasibleError, InputError, PlannerError

_SETTINGS: dict[str, Any] = {
    "name": "planner",
    "help": "The shortest calibration campaign of an inertial unit that provably suffices for its "
    "navigation.",
    "no_args_is_help": True,
    "add_completion": False,
    "pretty_exceptions_enable": False,
    "rich_markup_mode": None,
}
app = typer.Typer(**_SETTINGS)

INTERRUPTED = 130  # what typer returns for Ctrl-C
OF_THE_PROGRAM = ("--quiet", "--verbose", "--force")  # they may stand behind a command, too


@app.callback(invoke_without_command=True)
def root(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Results and errors alone.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", help="Every stage on stderr, with its time.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
    show_completion: Annotated[
        str | None, typer.Option(metavar="SHELL", help="Print completion for bash, zsh or fish.")
    ] = None,
) -> None:
    """Plan calibration campaigns of inertial units.

    --quiet, --verbose and --force may also stand behind a command. A folder's files are replaced where
    planner wrote them for the same spec, others with --force alone.

    Example: planner init spec.yaml && planner plan spec.yaml
    """
    del quiet, verbose, force  # who says something asks for them: planner.commands.output.asked
    if show_completion is not None:
        from planner.commands.completion import completion

        typer.echo(completion(context.command, show_completion))
        raise typer.Exit()
    if version:
        from planner import __version__

        typer.echo(__version__)
        raise typer.Exit()


COMMANDS = (
    planning.check,
    planning.schema,
    planning.plan,
    planning.sensitivity,
    planning.allow,
    planning.compare,
    planning.why,
    planning.afford,
    bench.export,
    bench.bench_simulator,
    running.run,
    running.bench_check,
    recordings.reduce,
    recordings.look,
    data.simulate,
    data.calibrate,
    data.apply,
    diagnosis.diagnose,
    diagnosis.update,
    promise.verify,
    promise.sweep,
    fleet.accept,
    fleet.forecast,
    fleet.recalibrate,
    effects.effects,
    explaining.explain,
    docs.docs,
    migrating.migrate,
    reproducing.reproduce,
)
app.command(context_settings=starting.UNREAD)(starting.init)
for command in COMMANDS:
    app.command()(command)


def main() -> None:
    """Run the program; every error ends it with its own exit code and no traceback."""
    _open_standard_files()
    try:
        words = _spelt_out(sys.argv[1:])
        code = _needed(words)(words, standalone_mode=False) or 0
        if code == INTERRUPTED:
            raise KeyboardInterrupt
    except SystemExit:
        sys.exit(0)  # typer and rich end like this when the reader of our output has gone
    except PlannerError as error:
        with _deaf_ears():
            _complain(error)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        with _deaf_ears():
            typer.echo("stopped", err=True)
        sys.exit(4)
    except BrokenPipeError:
        sys.stderr.close()  # the reader of our output has gone; nothing is left to say
        sys.exit(0)
    except Exception as error:  # the last resort: exit 70 and a sentence, no traceback
        _usage_or_internal(error)
    sys.exit(code)


def _needed(words: list[str]) -> typer.Typer:
    """The program with the one command that is asked for: typer takes 50 ms to read the options of all."""
    first = next((word for word in words if word not in OF_THE_PROGRAM), "")
    asked = [each for each in app.registered_commands if _called(each) == first]
    if not asked:
        return app
    one = typer.Typer(**_SETTINGS)
    one.registered_callback, one.registered_commands = app.registered_callback, asked
    return one


def _called(command: Any) -> str:
    return str(command.name or command.callback.__name__).replace("_", "-")


def _open_standard_files() -> None:
    """Where one of the first three files was closed, the next file opened would take its number: a program
    that we call would then write its errors into our journal.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest number that is free


@contextmanager
def _deaf_ears() -> Iterator[None]:
    """Saying why it ends: a terminal that is closed or full does not change the exit code."""
    try:
        yield
    except (OSError, ValueError):
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115 - else Python's last flush of it would exit with 120


def _spelt_out(arguments: list[str]) -> list[str]:
    """`accept --plan` without a plan asks for the plan of a check; options of the program stand first."""
    program = [word for word in arguments if word in OF_THE_PROGRAM]
    arguments = [word for word in arguments if word not in program]
    return [*program, *_with_plan_check(arguments)]


def _with_plan_check(arguments: list[str]) -> list[str]:
    if arguments[:1] != ["accept"]:
        return arguments
    after = [*arguments[1:], "-"]
    bare = [a == "--plan" and b.startswith("-") for a, b in zip(arguments, after, strict=True)]
    return ["--plan-check" if is_bare else a for a, is_bare in zip(arguments, bare, strict=True)]


def _usage_or_internal(error: Exception) -> None:
    """Typer's own usage errors exit 2; anything else is a fault of ours: exit 70 and say how to report it."""
    show = getattr(error, "show", None)
    if callable(show):
        show()
        _as_json(getattr(error, "format_message", lambda: str(error))(), 2)
        sys.exit(2)
    if type(error).__name__ == "Abort":
        sys.exit(4)
    said = f"{type(error).__name__}: {error}"
    typer.echo(f"internal error: {said}; set PLANNER_DEBUG=1 for details", err=True)
    _as_json(said, 70)
    if os.environ.get("PLANNER_DEBUG"):
        raise error
    sys.exit(70)


def _complain(error: PlannerError) -> None:
    """Say what is wrong on stderr, and as JSON on stdout when the caller asked for that."""
    said = error.shown if isinstance(error, InputError) else str(error)
    typer.echo(f"error: {said}", err=True)
    faults = [fault.document() for fault in error.faults] if isinstance(error, InputError) else []
    _as_json(str(error), error.exit_code, faults, _of_infeasible(error))


def _as_json(message: str, exit_code: int, faults: list[Any] | None = None, result: Any = None) -> None:
    """The envelope of an error; one that is of no place in a file stands as a fault without a place."""
    if "--json" not in sys.argv:
        return
    from planner.commands.output import json_line

    wrong, _, remedy = message.partition("; ")
    alone = {"code": "", "path": "", "line": 0, "column": 0, "message": wrong, "remedy": remedy}
    typer.echo(json_line(result, exit_code, faults or [alone]))


def _of_infeasible(error: PlannerError) -> dict[str, Any] | None:
    """What binds, and the nearest limit that can be met, of a requirement that cannot."""
    if not isinstance(error, InfeasibleError):
        return None
    return {
        "binds": [{"part": part, "share": share} for part, share in error.binds],
        "nearest_limit": error.nearest_limit,
    }
