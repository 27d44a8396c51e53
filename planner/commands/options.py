"""Arguments and options that several commands have, with their words for `--help`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

SpecFile = Annotated[Path, typer.Argument(metavar="SPEC", help="YAML spec.", show_default=False)]
SpecOption = Annotated[Path, typer.Option("--spec", metavar="SPEC", help="YAML spec.", show_default=False)]
PlanFile = Annotated[
    Path, typer.Argument(metavar="PLAN", help="plan.json or its folder.", show_default=False)
]
DataTable = Annotated[Path, typer.Argument(metavar="DATA", help="Dwell table.", show_default=False)]
Seed = Annotated[int, typer.Option(min=0, help="Of every random number.")]
Axes = Annotated[int, typer.Option(min=1, max=6, help="How many axes the table has.")]
AsJson = Annotated[bool, typer.Option("--json", help="Machine-readable result on stdout.")]
