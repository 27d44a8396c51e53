"""The command that brings a spec to the present format, no arithmetic: migrate."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planner.commands.options import AsJson, SpecFile
from planner.commands.output import STANDARD, asked, refuse_existing, say, say_text


def migrate(
    spec: SpecFile,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="SPEC2", help="New spec; with --force SPEC itself."),
    ] = None,
    published: Annotated[
        bool, typer.Option("--published", help="Plan by the published method, once the default.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Bring a spec of an older planner to the present format; shows the changes, writes them when told to.

    Comments and layout stay. Where a spec does not say how to plan, older planners took the published method:
    keys that the present one does not read are left out, or --published keeps it.

    Example: planner migrate spec.yaml -o spec2.yaml
    """
    from planner.api import migrating

    made = migrating.migrate(spec, published=published)
    if str(out) == STANDARD:
        say_text(made.text, made)
    if out is not None:
        refuse_existing(out)
    target = out or (spec if asked("--force") and str(spec) != STANDARD else None)
    if target is None or (target == spec and not made.changes):
        hint = f"nothing is written; -o SPEC2 writes it, --force into {spec} itself"
        say(made, as_json, written=hint if made.changes else "")
        return
    say(made, as_json, target, extra={"written": str(target)})
