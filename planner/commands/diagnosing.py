"""The commands that close the loop, no arithmetic: diagnose, update."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planner.commands.options import AsJson, DataTable, Seed, SpecFile, SpecOption
from planner.commands.output import progress_line, refuse_others, say
from planner.errors import InputError


def diagnose(
    data: DataTable,
    spec: SpecOption,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="DIR", help="Folder [diagnoses/<data name>/].")
    ] = None,
    plan: Annotated[
        Path | None,
        typer.Option(metavar="PLAN", help="plan.json or its folder: what a flight then comes to in all."),
    ] = None,
    seed: Seed = 1,
    as_json: AsJson = False,
) -> None:
    """Find what the declared error model lacks; writes diagnosis.json and report.html.

    Residual, missing effect, error before and after on runs that the fit has not seen, cost in flight, what
    to measure next. Exit 0 also when nothing is missing. Several units in one table have a folder each.

    Example: planner diagnose data.csv --spec spec.yaml -o diagnoses/data
    """
    from planner.api import diagnosing

    folder = out or Path("diagnoses") / data.stem
    refuse_others(spec, folder, "diagnosis.json", "report.html")
    with progress_line() as progress:
        found = diagnosing.diagnose(data, spec, plan=plan, seed=seed, progress=progress)
    say(found, as_json, folder, spec)


def update(
    spec: SpecFile,
    diagnosis: Annotated[
        Path, typer.Option(metavar="FILE", help="diagnosis.json or its folder.", show_default=False)
    ],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="SPEC2", help="New spec to write.")],
    plan: Annotated[bool, typer.Option("--plan/--no-plan", help="Plan both specs and compare.")] = True,
    as_json: AsJson = False,
) -> None:
    """Declare in the spec what the diagnosis found: effects, budgets, the tests that calibrate them.

    Comments and layout of the spec stay; the old spec's digest stands in a comment. Prints the difference,
    then hours and metres of both plans.

    Example: planner update spec.yaml --diagnosis diagnoses/data/diagnosis.json -o spec2.yaml
    """
    from planner.api import diagnosing

    if out.resolve() == spec.resolve():
        raise InputError(f"{out} is the old spec, which the diagnosis is of; give the new one another name")
    with progress_line() as progress:
        made = diagnosing.update(spec, diagnosis, out=out, plan=plan, progress=progress)
    say(
        made,
        as_json,
        out,
        written=f"wrote {out}; next: planner plan {out}",
        extra={"written": str(out)},
    )
