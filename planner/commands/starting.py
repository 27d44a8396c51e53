"""The command that writes files to start from, no arithmetic."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planner.commands.options import AsJson
from planner.commands.output import answer
from planner.errors import InputError


def register(app: typer.Typer) -> None:
    """Add the command to the program."""
    app.command()(init)


def init(
    file: Annotated[Path | None, typer.Argument(metavar="[FILE]", help="Where to write it.")] = None,
    flight: Annotated[
        Path | None,
        typer.Option(metavar="CSV", help="Write a flight with every column explained, to put yours in."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write a commented starter spec that plans as it stands; with --flight a flight file, in place of it.

    A flight is a CSV with time_s, lat_deg, lon_deg, alt_m, v_north_mps, v_east_mps, v_down_mps, roll_deg,
    pitch_deg, heading_deg, and temp_degc if it is known. The three velocities may be left out, and the three
    angles: then they are derived, and `planner check` says how.

    Example: planner init spec.yaml && planner init --flight flight.csv
    """
    texts = {file or Path("spec.yaml"): _spec} if file is not None or flight is None else {}
    if flight is not None:
        texts[flight] = _flight
    for target in texts:
        if target.exists():
            raise InputError(f"{target} exists already; give another name")
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


def _next(target: Path, is_flight: bool) -> str:
    return f"trajectory: {{file: {target.name}}} in the spec" if is_flight else f"planner plan {target}"
