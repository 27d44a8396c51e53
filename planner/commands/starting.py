"""The command that writes files to start from, no arithmetic."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import typer

from planner.commands.options import AsJson
from planner.commands.output import STANDARD, answer, refuse_existing
from planner.errors import InputError

UNREAD = {"allow_extra_args": True, "ignore_unknown_options": True}  # the terms of data sheets


def init(
    context: typer.Context,
    file: Annotated[Path | None, typer.Argument(metavar="[FILE]", help="Where to; -: stdout.")] = None,
    flight: Annotated[
        Path | None,
        typer.Option(metavar="CSV", help="Write a flight with every column explained, to put yours in."),
    ] = None,
    from_datasheet: Annotated[
        bool,
        typer.Option(
            "--from-datasheet",
            help="Take the unit from a data sheet: --gyro-bias-instability '0.5 deg/h' --gyro-arw … ; "
            "without figures a terminal asks for them, and elsewhere every term is listed.",
        ),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Write a commented starter spec that plans as it stands; with --flight a flight file, in place of it.

    A flight is a CSV with time_s, lat_deg, lon_deg, alt_m, v_north_mps, v_east_mps, v_down_mps, roll_deg,
    pitch_deg, heading_deg, and temp_degc if it is known. The three velocities may be left out, and the three
    angles: then they are derived, and `planner check` says how.

    Example: planner init spec.yaml --from-datasheet --gyro-arw '0.15 deg/sqrt(h)' --gyro-bias-error …
    """
    texts: dict[Path, Callable[[], str]] = {}
    if from_datasheet:
        figures = _figures(context.args)
        texts[file or Path("spec.yaml")] = lambda: _from_datasheet(figures)
    elif context.args:
        raise InputError(
            f"no such option of init: {context.args[0]}; figures of a data sheet go with --from-datasheet"
        )
    elif file is not None or flight is None:
        texts[file or Path("spec.yaml")] = _spec
    if flight is not None:
        texts[flight] = _flight
    for target in texts:
        refuse_existing(target)
    if file is not None and str(file) == STANDARD:
        typer.echo(texts[file](), nl=False)
        return
    from planner.whole_files import write_all_whole

    write_all_whole({target: text() for target, text in texts.items()})
    said = [f"wrote {target}; next: {_next(target, target == flight)}" for target in texts]
    names = [str(target) for target in texts]
    answer({"written": names[0] if len(names) == 1 else names}, "\n".join(said), as_json)


def _spec() -> str:
    from planner.spec.starter import starter_text

    return starter_text()


def _flight() -> str:
    from planner.export.flight import flight_template

    return flight_template()


def _from_datasheet(figures: dict[str, str]) -> str:
    from planner.spec.datasheet import datasheet_spec

    return datasheet_spec(figures)


def _figures(words: Sequence[str]) -> dict[str, str]:
    """`--gyro-arw '0.15 deg/sqrt(h)'`, `--gyro-arw=…`; none: asked for, or every term listed."""
    found: dict[str, str] = {}
    rest = iter(words)
    for word in rest:
        flag, is_set, value = word.partition("=")
        if not flag.startswith("--"):
            raise InputError(f"{word!r} belongs to no term; write --gyro-arw '0.15 deg/sqrt(h)', in quotes")
        text = value if is_set else next(rest, "")
        if not text or text.startswith("--"):
            raise InputError(f"{flag} has no figure; write e.g. {flag}{_example(flag)}")
        found[flag[2:]] = text
    return found or (_asked() if sys.stdin.isatty() else _listed())


def _example(flag: str) -> str:
    from planner.spec.datasheet import terms

    term = terms().get(flag[2:])
    return f" '{term.example}'" if term else " '0.5 deg/h'"


def _asked() -> dict[str, str]:
    """The figures by questions; an empty answer: not on the sheet."""
    from planner.spec.datasheet import refused, terms

    found: dict[str, str] = {}
    typer.echo("Figures of the data sheet with their units; Enter alone: not on the sheet.", err=True)
    for flag, term in terms().items():
        while term.asked:
            said = typer.prompt(
                f"{flag}: {term.says}, e.g. {term.example}", default="", show_default=False, err=True
            )
            why = refused(term, said) if said.strip() else None
            if why is None:
                found |= {flag: said} if said.strip() else {}
                break
            typer.echo(why, err=True)
    return found


def _listed() -> dict[str, str]:
    from planner.spec.datasheet import terms

    lines = [f"  --{flag} '{term.example}'  {term.says}" for flag, term in terms().items()]
    raise InputError("\n".join(["no figures; those that a data sheet may have:", *lines]))


def _next(target: Path, is_flight: bool) -> str:
    return f"trajectory: {{file: {target.name}}} in the spec" if is_flight else f"planner plan {target}"
