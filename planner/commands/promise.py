"""The commands that put a plan's promise to the test, no arithmetic: verify, sweep."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planner.commands.options import AsJson, PlanFile, Seed, SpecFile
from planner.commands.output import asked, progress_line, refuse_others, say
from planner.errors import InputError

Flights = Annotated[
    int | None,
    typer.Option(
        min=0,
        max=10_000_000,
        metavar="N",
        help="Campaigns with flights; 0: count again only; default: 2000, or 10000 where 2000 leave it open.",
    ),
]
FlightTemperature = Annotated[
    str,
    typer.Option(
        metavar="own|flight|range",
        help="Where flights start: each requirement's own temperatures, the spec's flight, or anywhere in "
        "plan.temperatures.range.",
    ),
]
FlightCurves = Annotated[
    str,
    typer.Option(
        metavar="binding|all|cosines|kink|cubic|matern|measured",
        help="Family of the curves over temperature: the one that the plan says binds, one by name, or every "
        "one for which the promise must hold.",
    ),
]
FlightSpreads = Annotated[
    str | None,
    typer.Option(
        metavar="stated|drawn",
        help="Run-to-run spreads as stated, or drawn for types of unit where they are estimates; "
        "default: drawn if the spec says from how many power_ons.",
    ),
]
ThroughFiles = Annotated[
    int,
    typer.Option(
        min=0, max=100, metavar="N", help="So many units go through files: calibrate, apply, flight."
    ),
]


def _some(workers: int) -> int:
    if workers == 0:
        raise InputError("--workers 0: nobody would work; give 1 or more, or -1 for all cores")
    return workers


Workers = Annotated[
    int,
    typer.Option(
        min=-1, metavar="N", callback=_some, help="Local processes; -1 takes all cores. Changes no result."
    ),
]
Cluster = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Scheduler of dask.distributed, tcp://host:8786 (extra: cluster)."),
]


MadeFor = Annotated[
    Path | None,
    typer.Option(
        metavar="OLD", help="Spec that the plan is of, to fly an old plan with units of an updated SPEC."
    ),
]
VerifyFolder = Annotated[
    Path | None, typer.Option("-o", "--out", metavar="DIR", help="Folder for verify.json and report.html.")
]
Vary = Annotated[
    list[str],
    typer.Option(
        metavar="KEY=A..B|A,B,…", help="A key of the spec and its values; may be given several times."
    ),
]


def verify(
    spec: SpecFile,
    plan: PlanFile,
    flights: Flights = None,
    seed: Seed = 1,
    temperature: FlightTemperature = "own",
    curves: FlightCurves = "binding",
    spreads: FlightSpreads = None,
    workers: Workers = 1,
    cluster: Cluster = None,
    through_files: ThroughFiles = 2,
    made_for: MadeFor = None,
    out: VerifyFolder = None,
    as_json: AsJson = False,
) -> None:
    """Count a plan again without the planner's arithmetic, then fly it: is its promise kept?

    Simulated units go through the plan's campaign, are calibrated, and fly the spec's flight nonlinearly,
    each in a power-on of its own, at the temperatures that each requirement speaks of. All that is a second
    code: shared with the planner are effects, spec, units and physics alone; a few units go through
    `calibrate` and `apply`, by files, too. Exit 0: kept; 1: broken; 4: not sure yet, or stopped early.

    Example: planner verify requirements_specs/small_uav.yaml plans/small_uav --flights 10000 --workers 2
    """
    from planner.api import promise

    refuse_others(spec, out, "verify.json", "report.html")
    with progress_line() as progress:
        found = promise.verify(
            spec,
            plan,
            flights=flights,
            seed=seed,
            temperature=temperature,
            curves=curves,
            spreads=spreads,
            workers=workers,
            cluster=cluster,
            through_files=through_files,
            made_for=made_for,
            progress=progress,
        )
    said = "" if out is None else f"wrote {out / 'verify.json'}, report.html"
    say(found, as_json, out, spec, written=said)


def sweep(
    spec: SpecFile,
    vary: Vary,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="DIR", help="Folder [sweeps/<spec name>/].")
    ] = None,
    points: Annotated[int, typer.Option(min=1, max=1000, help="Values in a range A..B.")] = 10,
    workers: Workers = 1,
    cluster: Cluster = None,
    as_json: AsJson = False,
) -> None:
    """Plan a grid of specs: hours against metres, as table, CSV, JSON and a curve.

    Finished points are kept in DIR/points: the same command goes on where it was stopped. --force: replace
    files of DIR that are not of SPEC.

    Example: planner sweep spec.yaml --vary requirement.0.limit=5..50m --vary plan.confidence=90,95,99%
    """
    from planner.api import sweeping

    folder = out or Path("sweeps") / spec.stem
    with progress_line() as progress:
        done = sweeping.sweep(
            spec,
            *vary,
            folder=folder,
            points=points,
            workers=workers,
            cluster=cluster,
            force=asked("--force"),
            progress=progress,
        )
    say(done, as_json, folder, spec, written=f"wrote {folder / 'sweep.csv'}, sweep.json, report.html")
