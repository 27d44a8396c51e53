"""The command that makes a plan again, no arithmetic: reproduce."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planner.commands.options import AsJson, PlanFile
from planner.commands.output import progress_line, say


def reproduce(
    plan: PlanFile,
    spec: Annotated[
        Path | None,
        typer.Option(metavar="SPEC", help="Spec of the plan [the one near it with its digest]."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Plan again, and say whether the same spec gives the same plan here; plan.json has the packages.

    Figures may differ by a millionth, a campaign by nothing. Exit 1: it is another plan.

    Example: planner reproduce plans/small_uav --spec requirements_specs/small_uav.yaml
    """
    from planner.api import reproducing

    with progress_line() as progress:
        found = reproducing.reproduce(plan, spec=spec, progress=progress)
    say(found, as_json)
