"""The commands for raw recordings, no arithmetic: reduce, look."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planner.commands.options import AsJson
from planner.commands.output import answer, progress_line, refuse_existing, refuse_others, say
from planner.errors import InputError

Columns = Annotated[
    Path | None,
    typer.Option(metavar="MAP.yaml", help="Which column is what, in which unit, with which sign."),
]
OfPlan = Annotated[
    Path | None, typer.Option(metavar="PLAN", help="plan.json or its folder: the records are its steps.")
]
Latitude = Annotated[
    float | None,
    typer.Option(min=-90.0, max=90.0, metavar="DEG", help="Of the bench: references from the plan."),
]


def reduce(
    raw: Annotated[
        list[Path] | None,
        typer.Argument(metavar="RAW...", help="Recordings, or folders of their files.", show_default=False),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="DATA", help="Dwell table to write: .csv, .parquet or .h5."),
    ] = None,
    columns: Columns = None,
    guess: Annotated[
        bool, typer.Option("--guess", help="Write a commented map from what the files show; -o names it.")
    ] = False,
    map_help: Annotated[bool, typer.Option("--map-help", help="Explain every key of a map.")] = False,
    plan: OfPlan = None,
    latitude: Latitude = None,
    as_json: AsJson = False,
) -> None:
    """Reduce raw recordings to a dwell table; an account of every sample stands beside it.

    A map is lines like `rate: 1000 Hz` and `gyro: {x: gx, y: gy, z: -gz, unit: deg/s}`; --guess writes one.
    Text, Parquet, HDF5, MATLAB, .npy and the unit's packet stream are known by what the file holds.

    Example: planner reduce recording.csv --columns map.yaml -o data.csv
    """
    if map_help:
        _explain_map(as_json)
    elif not raw:
        raise InputError("name the recordings to reduce, or ask for --map-help")
    elif guess:
        _guess_map(raw, out, as_json)
    elif out is None:
        raise InputError("name the dwell table to write, as in -o data.csv")
    else:
        _reduce(raw, out, columns, plan, latitude, as_json)


def look(
    recording: Annotated[
        list[Path],
        typer.Argument(metavar="RECORDING...", help="One, in one file or several.", show_default=False),
    ],
    columns: Annotated[
        Path | None, typer.Option(metavar="MAP.yaml", help="Which column is what [guessed].")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="DIR", help="Folder [looks/<recording's name>/].")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Look at a recording: signals, rests, temperature, noise, gaps, what is odd, and the map that reads it.

    Writes report.html and map.yaml.

    Example: planner look recording.csv
    """
    from planner.api import data

    folder = out or Path("looks") / recording[0].stem
    refuse_others(recording[0], folder, "report.html", "map.yaml")
    with progress_line() as progress:
        seen = data.look(*recording, columns=columns, progress=progress)
    say(seen, as_json, folder, recording[0])


def _explain_map(as_json: bool) -> None:
    from planner.recordings.map_help import map_help_text

    text = map_help_text()
    answer({"help": text}, text.rstrip("\n"), as_json)


def _guess_map(raw: list[Path], out: Path | None, as_json: bool) -> None:
    """The map on stdout, or in a file that is not there yet."""
    from planner.recordings.guess_map import guessed_map
    from planner.whole_files import write_whole

    if out is not None:
        refuse_existing(out)
    with progress_line() as say:
        say(f"looking at {raw[0]}")
        text = guessed_map(raw)
    document = {"map": text, "written": [] if out is None else [str(out)]}
    if out is None:
        answer(document, text.rstrip("\n"), as_json)
        return
    write_whole(out, text)
    unsure = sum("CHECK" in line for line in text.splitlines()[2:])
    told = f"; {unsure} lines say CHECK" if unsure else ""
    answer(document, f"wrote {out}{told}; next: planner reduce {raw[0]} --columns {out} -o data.csv", as_json)


def _reduce(
    raw: list[Path], out: Path, columns: Path | None, plan: Path | None, latitude: float | None, as_json: bool
) -> None:
    from planner.api import data

    _, beside = data.account_place(out, (*raw, *(path for path in (columns, plan) if path is not None)))
    with progress_line() as progress:
        found = data.reduce(*raw, columns=columns, plan=plan, latitude_deg=latitude, progress=progress)
    say(found, as_json, out, extra={"written": [str(out), str(beside)]})
