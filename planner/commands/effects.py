"""The command that shows the effects there are, and writes the skeleton of a new one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planner.commands.options import AsJson
from planner.commands.output import answer, notes, refuse_existing, result
from planner.errors import InputError


def effects(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="Show this one only.")] = None,
    template: Annotated[
        str | None, typer.Option(metavar="NAME", help="Write the skeleton of a new effect of this name.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="Where the skeleton goes [stdout].")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """What effects there are, ours and installed packages': equation, terms, units, parameters, source.

    --template writes a commented module that is an effect as it stands, with the lines by which a package of
    your own offers it.

    Example: planner effects --template self_heating -o self_heating.py
    """
    if template is not None:
        _skeleton(template, name, out, as_json)
        return
    if out is not None:
        raise InputError("-o says where a skeleton goes; give --template NAME")
    from planner import catalog
    from planner.export.effects import effect_document, effect_named, effects_document
    from planner.report.subjects.effects import effects_report

    if name is not None:
        one = effect_document(effect_named(name))
        result(one, effects_report([one]), as_json)
        return
    document = effects_document()
    notes(map(str, catalog.unloadable()))
    result(document, effects_report(document["effects"]), as_json)


def _skeleton(template: str, name: str | None, out: Path | None, as_json: bool) -> None:
    from planner.export.effects import effect_template
    from planner.whole_files import write_whole

    if name is not None:
        raise InputError(f"{name}: --template takes the name of the new effect; give one name")
    text = effect_template(template)
    if out is None:
        answer({"effect": template, "text": text}, text.rstrip("\n"), as_json)
        return
    refuse_existing(out)
    write_whole(out, text)
    answer(
        {"effect": template, "written": str(out)},
        f"wrote {out}; its first lines say how to install it",
        as_json,
    )
